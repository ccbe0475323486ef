/* The quadratic program of one step over the horizon. */
typedef struct {
  whirl_real low[WHIRL_MAX_HORIZON]; /* m/s^2, limits of w */
  whirl_real high[WHIRL_MAX_HORIZON];
  whirl_real w[WHIRL_MAX_HORIZON];
  whirl_real gradient[WHIRL_MAX_HORIZON];
  whirl_real feasible[WHIRL_MAX_HORIZON]; /* inside the limits, used by single exchanges */
  int8_t next[WHIRL_MAX_HORIZON];
} whirl_program;

/* x'' = -k1 x - c x' + w sampled with w held over h: series of the matrix exponential and of its integral. */
static void whirl_sample_axis(whirl_axis *axis, whirl_real k1, whirl_real c, whirl_real h) {
  whirl_real t00 = R(1.0);
  whirl_real t01 = R(0.0);
  whirl_real t10 = R(0.0);
  whirl_real t11 = R(1.0);
  int32_t n;
  axis->a00 = R(1.0);
  axis->a01 = R(0.0);
  axis->a10 = R(0.0);
  axis->a11 = R(1.0);
  axis->b0 = R(0.0);
  axis->b1 = R(0.0);
  for (n = 1; n <= 30; n++) {
    const whirl_real part = h / (whirl_real)n;
    const whirl_real n00 = -k1 * t01 * part;
    const whirl_real n01 = (t00 - (c * t01)) * part;
    const whirl_real n10 = -k1 * t11 * part;
    const whirl_real n11 = (t10 - (c * t11)) * part;
    axis->b0 += t01 * part;
    axis->b1 += t11 * part;
    t00 = n00;
    t01 = n01;
    t10 = n10;
    t11 = n11;
    axis->a00 += t00;
    axis->a01 += t01;
    axis->a10 += t10;
    axis->a11 += t11;
  }
}

/* Inputs w and half the gradient of sum (w_k + kp x_k + kd v_k)^2 when the inputs of axis->set stand at their limits: Riccati
   recursion from the last of them to the first free one, then the trajectory, then its adjoint. */
static void whirl_trajectory(const whirl_axis *axis, int32_t n, whirl_real x0, whirl_real v0, whirl_program *q) {
  const whirl_axis a = *axis;
  /* closed loop without limits */
  const whirl_real f00 = a.a00 - (a.b0 * a.kp);
  const whirl_real f01 = a.a01 - (a.b0 * a.kd);
  const whirl_real f10 = a.a10 - (a.b1 * a.kp);
  const whirl_real f11 = a.a11 - (a.b1 * a.kd);
  whirl_real e0[WHIRL_MAX_HORIZON];
  whirl_real e1[WHIRL_MAX_HORIZON];
  whirl_real e2[WHIRL_MAX_HORIZON];
  /* cost to go x's x + 2 q'x, zero behind the last limit; free inputs have
     w + kp x + kd v = e = e0 + e1 x + e2 v */
  whirl_real s00 = R(0.0);
  whirl_real s01 = R(0.0);
  whirl_real s11 = R(0.0);
  whirl_real q0 = R(0.0);
  whirl_real q1 = R(0.0);
  whirl_real x = x0;
  whirl_real v = v0;
  int32_t last = n - 1;
  int32_t first = 0;
  int32_t k;

  while ((last >= 0) && (a.set[last] == 0)) {
    last--;
  }
  while ((first < last) && (a.set[first] != 0)) {
    first++;
  }
  if (first == last) {
    first = last + 1; /* no free input in front of a limit: nothing to choose */
  }
  for (k = last; k >= first; k--) {
    const whirl_real sb0 = (s00 * a.b0) + (s01 * a.b1);
    const whirl_real sb1 = (s01 * a.b0) + (s11 * a.b1);
    whirl_real n00;
    whirl_real n01;
    whirl_real n11;
    whirl_real m0;
    whirl_real m1;
    if (a.set[k] == 0) {
      const whirl_real den = R(1.0) / (R(1.0) + (a.b0 * sb0) + (a.b1 * sb1));
      const whirl_real g0 = (f00 * sb0) + (f10 * sb1);
      const whirl_real g1 = (f01 * sb0) + (f11 * sb1);
      const whirl_real bq = (a.b0 * q0) + (a.b1 * q1);
      const whirl_real t00 = (s00 * f00) + (s01 * f10);
      const whirl_real t01 = (s00 * f01) + (s01 * f11);
      const whirl_real t10 = (s01 * f00) + (s11 * f10);
      const whirl_real t11 = (s01 * f01) + (s11 * f11);
      e0[k] = -bq * den;
      e1[k] = -g0 * den;
      e2[k] = -g1 * den;
      n00 = ((f00 * t00) + (f10 * t10)) - (g0 * g0 * den);
      n01 = ((f00 * t01) + (f10 * t11)) - (g0 * g1 * den);
      n11 = ((f01 * t01) + (f11 * t11)) - (g1 * g1 * den);
      m0 = ((f00 * q0) + (f10 * q1)) - (g0 * bq * den);
      m1 = ((f01 * q0) + (f11 * q1)) - (g1 * bq * den);
    } else {
      const whirl_real u = (a.set[k] < 0) ? q->low[k] : q->high[k];
      const whirl_real r0 = (sb0 * u) + q0;
      const whirl_real r1 = (sb1 * u) + q1;
      const whirl_real t00 = (s00 * a.a00) + (s01 * a.a10);
      const whirl_real t01 = (s00 * a.a01) + (s01 * a.a11);
      const whirl_real t10 = (s01 * a.a00) + (s11 * a.a10);
      const whirl_real t11 = (s01 * a.a01) + (s11 * a.a11);
      e0[k] = R(0.0);
      e1[k] = R(0.0);
      e2[k] = R(0.0);
      n00 = (a.kp * a.kp) + (a.a00 * t00) + (a.a10 * t10);
      n01 = (a.kp * a.kd) + (a.a00 * t01) + (a.a10 * t11);
      n11 = (a.kd * a.kd) + (a.a01 * t01) + (a.a11 * t11);
      m0 = (a.kp * u) + (a.a00 * r0) + (a.a10 * r1);
      m1 = (a.kd * u) + (a.a01 * r0) + (a.a11 * r1);
    }
    s00 = n00;
    s01 = n01;
    s11 = n11;
    q0 = m0;
    q1 = m1;
  }
  for (k = 0; k < n; k++) {
    const whirl_real regulator = (-a.kp * x) - (a.kd * v);
    whirl_real e;
    whirl_real next;
    if (a.set[k] == 0) {
      e = (k < last) ? (e0[k] + (e1[k] * x) + (e2[k] * v)) : R(0.0);
      q->w[k] = regulator + e;
    } else {
      q->w[k] = (a.set[k] < 0) ? q->low[k] : q->high[k];
      e = q->w[k] - regulator;
    }
    q->gradient[k] = e; /* its own part, all of it behind the last limit, where e is 0 */
    next = (a.a00 * x) + (a.a01 * v) + (a.b0 * q->w[k]);
    v = (a.a10 * x) + (a.a11 * v) + (a.b1 * q->w[k]);
    x = next;
  }
  q0 = R(0.0);
  q1 = R(0.0);
  for (k = last; k >= 0; k--) {
    const whirl_real e = q->gradient[k];
    const whirl_real next = (a.kp * e) + (a.a00 * q0) + (a.a10 * q1);
    q->gradient[k] = e + (a.b0 * q0) + (a.b1 * q1);
    q1 = (a.kd * e) + (a.a01 * q0) + (a.a11 * q1);
    q0 = next;
  }
}

/* Number of inputs on the wrong side: outside a limit, or held at one that the cost leads away from. q->next is the set with
   all of them exchanged. 0: the optimality conditions are fulfilled. */
static int32_t whirl_wrong_inputs(const whirl_axis *axis, int32_t n, whirl_program *q) {
  whirl_real slack = R(0.0);
  int32_t wrong = 0;
  int32_t k;
  for (k = 0; k < n; k++) {
    slack = M(fmax)(slack, M(fabs)(q->w[k]));
  }
  slack *= /*@slack@*/;
  for (k = 0; k < n; k++) {
    const int8_t now = axis->set[k];
    q->next[k] = now;
    if (now == 0) {
      if (q->w[k] < (q->low[k] - slack)) {
        q->next[k] = -1;
      } else if (q->w[k] > (q->high[k] + slack)) {
        q->next[k] = 1;
      } else {
        /* inside */
      }
    } else if (((now < 0) && (q->gradient[k] < -slack)) || ((now > 0) && (q->gradient[k] > slack))) {
      q->next[k] = 0;
    } else {
      /* held where it belongs */
    }
    if (q->next[k] != now) {
      wrong++;
    }
  }
  return wrong;
}

/* One step of the primal active-set method: from q->feasible towards q->w as far as the first limit, which joins the set; when
   there is none in the way, the limit with the steepest way off it leaves. The cost falls in every step. */
static void whirl_single_exchange(whirl_axis *axis, int32_t n, whirl_program *q) {
  whirl_real step = R(1.0);
  whirl_real slope = R(0.0);
  int32_t reached = -1;
  int32_t steepest = 0;
  int32_t k;
  for (k = 0; k < n; k++) {
    if (q->next[k] == axis->set[k]) {
      /* right */
    } else if (axis->set[k] == 0) {
      const whirl_real end = (q->next[k] < 0) ? q->low[k] : q->high[k];
      const whirl_real part = whirl_clamp((end - q->feasible[k]) / (q->w[k] - q->feasible[k]), R(0.0), R(1.0));
      if ((reached < 0) || (part < step)) {
        step = part;
        reached = k;
      }
    } else if (M(fabs)(q->gradient[k]) > slope) {
      slope = M(fabs)(q->gradient[k]);
      steepest = k;
    } else {
      /* less steep */
    }
  }
  for (k = 0; k < n; k++) {
    q->feasible[k] += step * (q->w[k] - q->feasible[k]);
  }
  k = (reached >= 0) ? reached : steepest;
  axis->set[k] = q->next[k];
  if (axis->set[k] != 0) {
    q->feasible[k] = (axis->set[k] < 0) ? q->low[k] : q->high[k];
  }
}

/* Minimises sum (w_k + kp x_k + kd v_k)^2 inside the limits: all wrong inputs are exchanged at once (Kunisch, Rendl 2003); after
   five exchanges without progress one at a time (Nocedal, Wright, Numerical Optimization, 16.5). False: 200 were not enough. */
static bool whirl_solve(whirl_axis *axis, int32_t n, whirl_real x, whirl_real v, whirl_program *q) {
  int32_t fewest = n + 1;
  int32_t patience = 5;
  bool single = false;
  bool solved = false;
  int32_t count;
  int32_t k;
  for (count = 0; (count < 200) && !solved; count++) {
    int32_t wrong;
    whirl_trajectory(axis, n, x, v, q);
    wrong = whirl_wrong_inputs(axis, n, q);
    if (wrong == 0) {
      solved = true;
    } else if (single) {
      whirl_single_exchange(axis, n, q);
    } else if ((wrong < fewest) || (patience > 0)) {
      patience = (wrong < fewest) ? 5 : (patience - 1);
      fewest = (wrong < fewest) ? wrong : fewest;
      for (k = 0; k < n; k++) {
        axis->set[k] = q->next[k];
      }
    } else {
      single = true;
      for (k = 0; k < n; k++) {
        q->feasible[k] = whirl_clamp(q->w[k], q->low[k], q->high[k]);
        axis->set[k] = 0;
        if (q->feasible[k] <= q->low[k]) {
          axis->set[k] = -1;
        } else if (q->feasible[k] >= q->high[k]) {
          axis->set[k] = 1;
        } else {
          /* free */
        }
      }
    }
  }
  return solved;
}

static void whirl_free_inputs(whirl_axis *axis) {
  int32_t k;
  for (k = 0; k < WHIRL_MAX_HORIZON; k++) {
    axis->set[k] = 0;
  }
}

/* Control acceleration a of one axis x' = v, v' = -k1 x - c v + a + d, m/s^2:
/*@law@*/
   x m, v m/s; d m/s^2 is /*@f@*/, `quarter` the same a quarter turn later: d turns with the rotor and
   with it the limits of w along the horizon. The inputs at their limits, moved up by one, are the next first guess. */
static whirl_real whirl_law(const whirl_params *p, whirl_axis *axis, whirl_real x, whirl_real v, whirl_real d,
                            whirl_real quarter, whirl_real omega) {
  const whirl_real limit = p->gain * p->force_limit;
  whirl_real a = ((-axis->kp * x) - (axis->kd * v)) - d;
  if (limit > R(0.0)) {
    const int32_t n = (int32_t)p->horizon;
    const whirl_complex turn = whirl_phasor(omega * p->sample_time);
    whirl_complex ahead = whirl_make(d, quarter);
    whirl_program q;
    int32_t k;
    for (k = 0; k < n; k++) {
      q.low[k] = ahead.re - limit;
      q.high[k] = ahead.re + limit;
      ahead = whirl_make((turn.re * ahead.re) + (turn.im * ahead.im), (turn.re * ahead.im) - (turn.im * ahead.re));
    }
    for (k = 1; k < n; k++) {
      axis->set[k - 1] = axis->set[k];
    }
    if (whirl_solve(axis, n, x, v, &q)) {
      a = q.w[0] - d;
    } else {
      whirl_free_inputs(axis);
    }
    a = whirl_clamp(a, -limit, limit);
  }
  return a;
}
