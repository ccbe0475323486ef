#if HAS_POWER
/* phi(x) = L sig(x/L)^r, the position part of the terminal surface, and its slope/*@regularised@*/. */
static whirl_real whirl_phi(const whirl_params *p, whirl_real x) {
#if HAS_BLEND
  const whirl_real a = M(fabs)(x);
  if (a < p->delta) {
    return M(pow)(p->delta / p->length_scale, p->exponent - R(1.0)) * x *
           ((R(2.0) - p->exponent) + (((p->exponent - R(1.0)) * a) / p->delta));
  }
#endif
  return p->length_scale * whirl_sig(x / p->length_scale, p->exponent);
}

static whirl_real whirl_phi_slope(const whirl_params *p, whirl_real x) {
  whirl_real a = M(fabs)(x);
#if HAS_BLEND
  if (a < p->delta) {
    return M(pow)(p->delta / p->length_scale, p->exponent - R(1.0)) *
           ((R(2.0) - p->exponent) + ((R(2.0) * (p->exponent - R(1.0)) * a) / p->delta));
  }
#elif HAS_CLAMP
  if (a < p->delta) {
    a = p->delta;
  }
#endif
  return (a == R(0.0)) ? R(0.0) : (p->exponent * M(pow)(a / p->length_scale, p->exponent - R(1.0)));
}
#endif

/* Control acceleration a of one axis x' = v, v' = f + a + D, m/s^2:
/*@law@*/
   x m, v m/s; f m/s^2 is /*@f@*/; s is the sliding variable, m/s. */
#if HAS_AXIS_MEMORY
static whirl_real whirl_law(const whirl_params *p, whirl_real *memory, whirl_real x, whirl_real v, whirl_real f,
                            whirl_real *s) {
#else
static whirl_real whirl_law(const whirl_params *p, whirl_real x, whirl_real v, whirl_real f, whirl_real *s) {
#endif
#if HAS_TSMC
  *s = v + (p->surface_gain * whirl_phi(p, x));
  return -(f + (p->surface_gain * whirl_phi_slope(p, x) * v) + (p->switching_gain * M(tanh)(*s / p->boundary_layer)));
#endif
#if HAS_LSMC
  *s = v + (p->surface_gain * x);
  return -(f + (p->surface_gain * v) + (p->switching_gain * M(tanh)(*s / p->boundary_layer)));
#endif
#if HAS_NTSMC
  const whirl_real g = R(1.0) / p->exponent;
  const whirl_real unit = p->surface_gain * p->length_scale;
  *s = (p->surface_gain * x) + (unit * whirl_sig(v / unit, g));
  return -(f + ((p->surface_gain / g) * unit * whirl_sig(v / unit, R(2.0) - g)) +
           (p->switching_gain * M(tanh)(*s / p->boundary_layer)));
#endif
#if HAS_FTSMC
  *s = v + (p->linear_gain * x) + (p->surface_gain * whirl_phi(p, x));
  return -(f + ((p->linear_gain + (p->surface_gain * whirl_phi_slope(p, x))) * v) +
           (p->switching_gain * M(tanh)(*s / p->boundary_layer)));
#endif
#if HAS_NFTSMC
  const whirl_real g = R(1.0) / p->exponent;
  const whirl_real unit = p->surface_gain * p->length_scale;
  const whirl_real ratio = x / p->length_scale;
  const whirl_real slope =
      R(1.0) + (p->fast_gain * p->fast_exponent * M(pow)(M(fabs)(ratio), p->fast_exponent - R(1.0)));
  *s = (p->surface_gain * (x + (p->fast_gain * p->length_scale * whirl_sig(ratio, p->fast_exponent)))) +
       (unit * whirl_sig(v / unit, g));
  return -(f + ((p->surface_gain / g) * unit * whirl_sig(v / unit, R(2.0) - g) * slope) +
           (p->switching_gain * M(tanh)(*s / p->boundary_layer)));
#endif
#if HAS_SMC_IMPLICIT
  *s = v + (p->surface_gain * x);
  return -(f + (p->surface_gain * v) + whirl_clamp(*s / p->tau, -p->switching_gain, p->switching_gain));
#endif
#if HAS_TSMC_IMPLICIT
  const whirl_real z =
      p->length_scale * whirl_implicit_power(x / p->length_scale, p->sample_time * p->surface_gain, p->exponent);
  *s = v - ((z - x) / p->sample_time);
  return -f + whirl_clamp(-*s / p->tau, -p->switching_gain, p->switching_gain);
#endif
#if HAS_STA
  const whirl_real h = p->sample_time;
  const whirl_real k1 = R(1.5) * M(sqrt)(p->twisting_rate);
  const whirl_real k2 = R(1.1) * p->twisting_rate;
  whirl_real u;
  *s = v + (p->surface_gain * x);
#if HAS_STA_IMPLICIT
  {
    const whirl_real b = *s + (h * *memory);
    const whirl_real excess = M(fabs)(b) - (h * h * k2);
    if (excess <= R(0.0)) {
      *memory -= b / h;
      u = -*s / h;
    } else {
      const whirl_real q = (R(2.0) * excess) / ((h * k1) + M(sqrt)((h * h * k1 * k1) + (R(4.0) * excess)));
      *memory -= h * k2 * whirl_sgn(b);
      u = (-k1 * q * whirl_sgn(b)) + *memory;
    }
    *memory = whirl_clamp(*memory, -p->twisting_limit, p->twisting_limit);
  }
#else
  u = (-k1 * whirl_sig(*s, R(0.5))) + *memory;
  *memory = whirl_clamp(*memory - (h * k2 * whirl_sgn(*s)), -p->twisting_limit, p->twisting_limit);
#endif
  return (-f - (p->surface_gain * v)) + u;
#endif
#if HAS_ASMC
  *s = v + (p->surface_gain * x);
  *memory = whirl_clamp(
      *memory + (p->sample_time * p->adaptation_rate * M(fabs)(*s) * whirl_sgn(M(fabs)(*s) - p->dead_zone)), p->gain_min,
      p->gain_max);
  return -(f + (p->surface_gain * v) + (*memory * M(tanh)(*s / p->boundary_layer)));
#endif
#if HAS_BSMC
  whirl_real margin;
  whirl_real k = p->gain_max;
  *s = v + (p->surface_gain * x);
  margin = p->barrier_width - M(fabs)(*s);
  if (margin > R(0.0)) {
    k = whirl_clamp((p->barrier_gain * M(fabs)(*s)) / margin, R(0.0), p->gain_max);
  }
  return -(f + (p->surface_gain * v) + (k * whirl_sgn(*s)));
#endif
#if HAS_PD
  *s = R(0.0);
  return ((-p->kp * x) - (p->kd * v)) - f;
#endif
#if HAS_PID
  *s = R(0.0);
  *memory = whirl_clamp(*memory + (p->sample_time * p->ki * x), -p->integral_limit, p->integral_limit);
  return ((-p->kp * x) - (p->kd * v) - *memory) - f;
#endif
}
#if HAS_SYNCHRONOUS

/* Canceller of the synchronous motion: acceleration q F, m/s^2, with the eccentricity q adapted from the phasor
   X = z e^(-i beta) of the displacement and the response of the closed loop to an eccentricity
   G = omega^2 / (k1 - omega^2 + i omega c + (kp + i omega kd) e^(-i omega delay)). `forcing` is F at the time of effect. */
static whirl_complex whirl_synchronous(whirl_state *state, whirl_complex z, whirl_real beta, whirl_real omega,
                                       whirl_complex forcing, bool adapt) {
  const whirl_params *const p = &state->params;
  if (adapt && (M(fabs)(omega) >= p->speed_min)) {
    const whirl_real w2 = omega * omega;
#if HAS_PREDICT
    const whirl_complex feedback = whirl_make(p->kp, omega * p->kd);
#else
    const whirl_complex feedback = whirl_mul(whirl_make(p->kp, omega * p->kd),
                                             whirl_phasor(-omega * (p->delay + (R(0.5) * p->sample_time))));
#endif
    const whirl_complex g =
        whirl_divide(whirl_make(w2, R(0.0)), whirl_add(whirl_make(p->k1 - w2, omega * p->c), feedback));
    const whirl_complex phasor = whirl_mul(z, whirl_phasor(-beta));
#if HAS_INFLUENCE
    /* once per turn q -= adaptation mean(X) / G */
    if (state->count == 0U) {
      state->turn_start = beta;
    }
    state->sum = whirl_add(state->sum, phasor);
    state->count++;
    if (M(fabs)(beta - state->turn_start) >= R(6.283185307179586)) {
      const whirl_complex mean = whirl_scale(R(1.0) / (whirl_real)state->count, state->sum);
      state->q = whirl_sub(state->q, whirl_divide(whirl_scale(p->adaptation, mean), g));
      state->sum = whirl_make(R(0.0), R(0.0));
      state->count = 0U;
    }
#elif HAS_FXLMS
    /* filtered-x LMS: q -= h adaptation conj(G) X */
    state->q =
        whirl_sub(state->q, whirl_scale(p->sample_time * p->adaptation, whirl_mul(whirl_conj(g), phasor)));
#else
    /* generalised notch (Herzog 1996): q -= h adaptation e^(-i arg G) X */
    state->q = whirl_sub(state->q, whirl_scale((p->sample_time * p->adaptation) / M(hypot)(g.re, g.im),
                                               whirl_mul(whirl_conj(g), phasor)));
#endif
  }
#if HAS_INFLUENCE
  else {
    state->sum = whirl_make(R(0.0), R(0.0)); /* a turn with lost samples is no average */
    state->count = 0U;
  }
#endif
  return whirl_mul(state->q, forcing);
}
#endif
