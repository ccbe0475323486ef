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
/*@law_body@*/
}
#if HAS_LAW_FUNCTIONS

/*@law_functions@*/
#endif
