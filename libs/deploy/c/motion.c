static whirl_real whirl_clamp(whirl_real x, whirl_real low, whirl_real high) {
  return (x < low) ? low : ((x > high) ? high : x);
}

/* sgn(0) = 0 */
static whirl_real whirl_sgn(whirl_real x) {
  return (x > R(0.0)) ? R(1.0) : ((x < R(0.0)) ? R(-1.0) : R(0.0));
}

/* sig(x)^a = |x|^a sgn x; 0 at x = 0 */
static whirl_real whirl_sig(whirl_real x, whirl_real a) {
  return (x == R(0.0)) ? R(0.0) : M(copysign)(M(pow)(M(fabs)(x), a), x);
}

static whirl_complex whirl_make(whirl_real re, whirl_real im) {
  whirl_complex z;
  z.re = re;
  z.im = im;
  return z;
}

static whirl_complex whirl_add(whirl_complex a, whirl_complex b) { return whirl_make(a.re + b.re, a.im + b.im); }

static whirl_complex whirl_sub(whirl_complex a, whirl_complex b) { return whirl_make(a.re - b.re, a.im - b.im); }

static whirl_complex whirl_scale(whirl_real k, whirl_complex a) { return whirl_make(k * a.re, k * a.im); }

static whirl_complex whirl_mul(whirl_complex a, whirl_complex b) {
  return whirl_make((a.re * b.re) - (a.im * b.im), (a.re * b.im) + (a.im * b.re));
}

static whirl_complex whirl_conj(whirl_complex a) { return whirl_make(a.re, -a.im); }

static whirl_real whirl_norm(whirl_complex a) { return (a.re * a.re) + (a.im * a.im); }

static whirl_complex whirl_divide(whirl_complex a, whirl_complex b) {
  return whirl_scale(R(1.0) / whirl_norm(b), whirl_mul(a, whirl_conj(b)));
}

/* e^(i angle) */
static whirl_complex whirl_phasor(whirl_real angle) { return whirl_make(M(cos)(angle), M(sin)(angle)); }

/* Acceleration of the identified rotor without control and unbalance; `stiffness` scales its linear part. */
static whirl_complex whirl_acceleration(const whirl_params *p, whirl_complex z, whirl_complex v, whirl_real stiffness) {
  const whirl_real hardening = p->k2 * ((z.re * z.re) + (z.im * z.im));
  const whirl_real kx = stiffness * (p->k1 + p->k1_conj_re);
  const whirl_real ky = stiffness * (p->k1 - p->k1_conj_re);
  const whirl_real k_across = stiffness * p->k1_conj_im;
  return whirl_make(
      ((-kx * z.re) - (k_across * z.im) - (hardening * z.re)) - (((p->c + p->c_conj_re) * v.re) + (p->c_conj_im * v.im)),
      ((-ky * z.im) - (k_across * z.re) - (hardening * z.im)) - (((p->c - p->c_conj_re) * v.im) + (p->c_conj_im * v.re)));
}

/* Explicit midpoint step of length dt under the held control acceleration a; the disturbance turns at omega. */
static whirl_motion whirl_predict(const whirl_params *p, whirl_motion s, whirl_complex a, whirl_real omega, whirl_real dt) {
  const whirl_complex half = whirl_phasor(R(0.5) * omega * dt);
  const whirl_complex d_mid = whirl_mul(s.d, half);
  const whirl_complex a0 = whirl_add(whirl_add(whirl_acceleration(p, s.z, s.v, R(1.0)), s.d), a);
  const whirl_complex z_mid = whirl_add(s.z, whirl_scale(R(0.5) * dt, s.v));
  const whirl_complex v_mid = whirl_add(s.v, whirl_scale(R(0.5) * dt, a0));
  const whirl_complex a_mid = whirl_add(whirl_add(whirl_acceleration(p, z_mid, v_mid, R(1.0)), d_mid), a);
  whirl_motion next;
  next.z = whirl_add(s.z, whirl_scale(dt, v_mid));
  next.v = whirl_add(s.v, whirl_scale(dt, a_mid));
  next.d = whirl_mul(d_mid, half);
  return next;
}

/* Control acceleration sent `samples` ticks ago (>= 1). */
static whirl_complex whirl_past(const whirl_state *state, int32_t samples) {
  return state->history[((state->head - samples) + WHIRL_HISTORY) % WHIRL_HISTORY];
}

/* Prediction over one sample under the two pieces of control that acted in it: the loop delay is not a whole number of
   samples. */
static whirl_motion whirl_predict_interval(const whirl_state *state, whirl_real omega) {
  const whirl_params *const p = &state->params;
  const whirl_real split = state->fraction;
  whirl_motion s = state->motion;
  if (split > R(0.0)) {
    s = whirl_predict(p, s, whirl_past(state, state->whole_delay + 2), omega, split * p->sample_time);
  }
  return whirl_predict(p, s, whirl_past(state, state->whole_delay + 1), omega, (R(1.0) - split) * p->sample_time);
}
