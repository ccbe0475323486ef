#if HAS_LPF
/* Backward difference with a first-order low-pass: v = q v + (1 - q)(z - z_last)/h, q = exp(-2 pi cutoff h). */
static whirl_motion whirl_estimate(whirl_state *state, whirl_complex z, bool fresh, whirl_complex forcing, whirl_complex d,
                                   whirl_real omega) {
  whirl_motion out;
  (void)fresh;
  (void)forcing;
  if (!state->started) {
    /* A rotor in steady whirl moves at i omega z: the best guess from one sample. */
    state->v = whirl_mul(whirl_make(R(0.0), omega), z);
    state->started = true;
  } else {
    state->v = whirl_add(whirl_scale(state->pole, state->v), whirl_scale((R(1.0) - state->pole) / state->params.sample_time,
                                                                         whirl_sub(z, state->last)));
  }
  state->last = z;
  out.z = z;
  out.v = state->v;
  out.d = d;
  return out;
}
#endif
#if HAS_RED
/* One axis of Levant's robust exact differentiator, x' = w - k1 sig(x - y)^(1/2), w' = -k2 sgn(x - y), k1 = 1.5 sqrt(L),
   k2 = 1.1 L. */
static void whirl_differentiate(whirl_real *x, whirl_real *w, whirl_real y, const whirl_params *p) {
  const whirl_real h = p->sample_time;
  const whirl_real k1 = R(1.5) * M(sqrt)(p->derivative_rate);
  const whirl_real k2 = R(1.1) * p->derivative_rate;
#if HAS_IMPLICIT_RED
  /* backward Euler solved exactly (Brogliato, Polyakov, Efimov 2020) */
  const whirl_real b = y - *x - (h * *w);
  const whirl_real excess = M(fabs)(b) - (h * h * k2);
  if (excess <= R(0.0)) {
    *w += b / h;
    *x = y;
  } else {
    const whirl_real q = (R(2.0) * excess) / ((h * k1) + M(sqrt)((h * h * k1 * k1) + (R(4.0) * excess)));
    *w += h * k2 * whirl_sgn(b);
    *x = y - (q * q * whirl_sgn(b));
  }
#else
  const whirl_real e = *x - y;
  *x += h * (*w - (k1 * whirl_sig(e, R(0.5))));
  *w -= h * k2 * whirl_sgn(e);
#endif
}

static whirl_motion whirl_estimate(whirl_state *state, whirl_complex z, bool fresh, whirl_complex forcing, whirl_complex d,
                                   whirl_real omega) {
  whirl_motion out;
  (void)fresh;
  (void)forcing;
  if (!state->started) {
    state->red_x = z;
    state->red_w = whirl_mul(whirl_make(R(0.0), omega), z);
    state->started = true;
  } else {
    whirl_differentiate(&state->red_x.re, &state->red_w.re, z.re, &state->params);
    whirl_differentiate(&state->red_x.im, &state->red_w.im, z.im, &state->params);
  }
  out.z = z;
  out.v = state->red_w;
  out.d = d;
  return out;
}
#endif
#if HAS_ESO
/* Linear extended state observer (Gao 2003): three poles at exp(-bandwidth h); the third state turns with the rotor. */
static whirl_motion whirl_estimate(whirl_state *state, whirl_complex z, bool fresh, whirl_complex forcing, whirl_complex d,
                                   whirl_real omega) {
  (void)forcing;
  if (!state->started) {
    state->motion.z = z;
    state->motion.v = whirl_mul(whirl_make(R(0.0), omega), z);
    state->motion.d = d;
    state->started = true;
    return state->motion;
  }
  state->motion = whirl_predict_interval(state, omega);
  if (fresh) {
    const whirl_complex e = whirl_sub(z, state->motion.z);
    state->motion.z = whirl_add(state->motion.z, whirl_scale(state->l1, e));
    state->motion.v = whirl_add(state->motion.v, whirl_scale(state->l2, e));
    state->motion.d = whirl_add(state->motion.d, whirl_scale(state->l3, e));
  }
  return state->motion;
}
#endif
#if HAS_KALMAN
/* Kalman filter in the complex coordinate: nonlinear prediction with the identified model and the force that really acted,
   linearised covariance P of /*@kalman@*/ (isotropic part). F P F^H + Q with F = [f00 f01 b0; f10 f11 b1; 0 0 1]. */
#if HAS_THIRD
static void whirl_predict_covariance(whirl_state *state, whirl_complex g) {
#else
static void whirl_predict_covariance(whirl_state *state) {
#endif
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_real c = p->c;
  const whirl_real k = p->k1 + (R(2.0) * p->k2 * whirl_norm(state->motion.z));
  const whirl_real f00 = R(1.0) - (R(0.5) * k * h * h);
  const whirl_real f01 = h - (R(0.5) * c * h * h);
  const whirl_real f10 = -k * h * (R(1.0) - (R(0.5) * c * h));
  const whirl_real f11 = R(1.0) - (c * h) + (R(0.5) * ((c * c) - k) * h * h);
  const whirl_complex p01 = state->p01;
  const whirl_complex p10 = whirl_conj(p01);
  const whirl_real p00 = state->p00;
  const whirl_real p11 = state->p11;
  const whirl_real q = p->acceleration_noise * p->acceleration_noise * h * h;
  whirl_complex m00 = whirl_add(whirl_make(f00 * p00, R(0.0)), whirl_scale(f01, p10));
  whirl_complex m01 = whirl_add(whirl_scale(f00, p01), whirl_make(f01 * p11, R(0.0)));
  whirl_complex m10 = whirl_add(whirl_make(f10 * p00, R(0.0)), whirl_scale(f11, p10));
  whirl_complex m11 = whirl_add(whirl_scale(f10, p01), whirl_make(f11 * p11, R(0.0)));
#if HAS_THIRD
  const whirl_complex b0 = whirl_scale(R(0.5) * h * h, g);
  const whirl_complex b1 = whirl_scale(h * (R(1.0) - (R(0.5) * c * h)), g);
  const whirl_complex p02 = state->p02;
  const whirl_complex p12 = state->p12;
  const whirl_real walk = p->/*@walk@*/ * p->/*@walk@*/ * h;
  const whirl_complex m02 =
      whirl_add(whirl_add(whirl_scale(f00, p02), whirl_scale(f01, p12)), whirl_scale(state->p22, b0));
  const whirl_complex m12 =
      whirl_add(whirl_add(whirl_scale(f10, p02), whirl_scale(f11, p12)), whirl_scale(state->p22, b1));
  m00 = whirl_add(m00, whirl_mul(b0, whirl_conj(p02)));
  m01 = whirl_add(m01, whirl_mul(b0, whirl_conj(p12)));
  m10 = whirl_add(m10, whirl_mul(b1, whirl_conj(p02)));
  m11 = whirl_add(m11, whirl_mul(b1, whirl_conj(p12)));
  state->p00 = ((f00 * m00.re) + (f01 * m01.re) + whirl_mul(m02, whirl_conj(b0)).re) + (R(0.25) * h * h * q);
  state->p01 = whirl_add(whirl_add(whirl_scale(f10, m00), whirl_scale(f11, m01)), whirl_mul(m02, whirl_conj(b1)));
  state->p11 = ((f10 * m10.re) + (f11 * m11.re) + whirl_mul(m12, whirl_conj(b1)).re) + q;
  state->p02 = m02;
  state->p12 = m12;
  state->p22 += walk;
#else
  state->p00 = (f00 * m00.re) + (f01 * m01.re) + (R(0.25) * h * h * q);
  state->p01 = whirl_add(whirl_scale(f10, m00), whirl_scale(f11, m01));
  state->p11 = (f10 * m10.re) + (f11 * m11.re) + q;
#endif
  state->p01.re += R(0.5) * h * q;
}

static whirl_motion whirl_estimate(whirl_state *state, whirl_complex z, bool fresh, whirl_complex forcing, whirl_complex d,
                                   whirl_real omega) {
  const whirl_params *const p = &state->params;
  const whirl_real r = p->measurement_noise * p->measurement_noise;
#if HAS_THIRD
  (void)d;
#endif
#if HAS_NO_FORCING
  (void)forcing;
#endif
  if (!state->started) {
    const whirl_real orbit = M(fabs)(omega) * M(hypot)(z.re, z.im);
    state->motion.z = z;
    state->motion.v = whirl_mul(whirl_make(R(0.0), omega), z);
    state->p01 = whirl_make(R(0.0), R(0.0));
    state->p00 = r;
    state->p11 = (orbit * orbit) + R(1e-4); /* 10 mm/s when nothing is known */
#if HAS_THIRD
    state->p02 = state->p01;
    state->p12 = state->p01;
    state->p22 = p->/*@prior@*/ * p->/*@prior@*/;
#if HAS_OSCILLATOR
    state->phase = R(0.0);
    state->theta = state->p01;
    state->g = whirl_make(R(1.0), R(0.0));
#else
    state->theta = whirl_make(p->eps_re, p->eps_im);
    state->g = forcing;
#endif
#endif
    state->started = true;
  } else {
#if HAS_THIRD
#if HAS_OSCILLATOR
    whirl_complex g_new;
    state->phase = M(remainder)(state->phase + (omega * p->sample_time), R(6.283185307179586));
    g_new = whirl_phasor(state->phase);
#else
    const whirl_complex g_new = forcing;
#endif
    /* The regressor half-way: the mean of the ends, exact to (omega h)^2 / 8 and used in the covariance only. */
    whirl_predict_covariance(state, whirl_scale(R(0.5), whirl_add(state->g, g_new)));
    state->g = g_new;
#else
    whirl_predict_covariance(state);
#endif
    state->motion = whirl_predict_interval(state, omega);
    if (fresh) {
      const whirl_real s = state->p00 + r;
      const whirl_real k0 = state->p00 / s;
      const whirl_complex k1 = whirl_make(state->p01.re / s, -state->p01.im / s);
      const whirl_complex e = whirl_sub(z, state->motion.z);
      state->motion.z = whirl_add(state->motion.z, whirl_scale(k0, e));
      state->motion.v = whirl_add(state->motion.v, whirl_mul(k1, e));
      /* P - K S K^H, Hermitian by construction */
#if HAS_THIRD
      {
        const whirl_complex k2 = whirl_make(state->p02.re / s, -state->p02.im / s);
        state->theta = whirl_add(state->theta, whirl_mul(k2, e));
        state->p22 -= whirl_norm(k2) * s;
        state->p12 = whirl_sub(state->p12, whirl_scale(s, whirl_mul(k1, whirl_conj(k2))));
        state->p02 = whirl_sub(state->p02, whirl_scale(k0 * s, whirl_conj(k2)));
      }
#endif
      state->p11 -= whirl_norm(k1) * s;
      state->p01 = whirl_sub(state->p01, whirl_scale(k0 * s, whirl_conj(k1)));
      state->p00 -= k0 * k0 * s;
    }
  }
#if HAS_THIRD
  state->motion.d = whirl_mul(state->theta, state->g);
#else
  state->motion.d = d;
#endif
  return state->motion;
}
#endif
