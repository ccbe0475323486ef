/* Solves z + g sig(z)^r = x for z (one root), 0 < r < 1, g >= 0: in w = z^r the equation w^(1/r) + g w = |x| is convex and
   increasing, Newton from above cannot overshoot; at most 16 steps, fewer than 10 in practice. */
static whirl_real whirl_implicit_power(whirl_real x, whirl_real g, whirl_real exponent) {
  const whirl_real target = M(fabs)(x);
  const whirl_real power = R(1.0) / exponent;
  whirl_real w;
  int32_t i;
  if (!(target > R(0.0)) || (g <= R(0.0))) {
    return x;
  }
  if (exponent == R(0.5)) {
    const whirl_real root = (R(2.0) * target) / (g + M(sqrt)((g * g) + (R(4.0) * target)));
    return M(copysign)(root * root, x);
  }
  w = M(fmin)(target / g, M(pow)(target, exponent));
  for (i = 0; i < 16; i++) {
    const whirl_real lead = M(pow)(w, power - R(1.0));
    const whirl_real next = w - ((((lead * w) + (g * w)) - target) / ((power * lead) + g));
    if (!(next < w)) {
      break;
    }
    w = next;
  }
  return M(copysign)(M(pow)(w, power), x);
}
