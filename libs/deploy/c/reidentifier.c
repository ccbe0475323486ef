#if HAS_REIDENTIFY

static void whirl_reid_forget(whirl_state *state) {
  const whirl_params *const p = &state->params;
  whirl_reidentifier *const r = &state->reid;
  const whirl_real bounds[3] = {p->reidentify_stiffness, p->reidentify_damping, p->reidentify_gain};
  int32_t i;
  int32_t j;
  for (i = 0; i < WHIRL_UNKNOWNS; i++) {
    for (j = 0; j < WHIRL_UNKNOWNS; j++) {
      r->information[i][j] = R(0.0);
    }
    r->moment[i] = R(0.0);
  }
  for (i = 0; i < 3; i++) {
    r->target[i] = R(0.0);
    r->estimate[i] = R(0.0);
    r->sd[i] = /*@n_reid_prior@*/ * bounds[i];
  }
  r->theta = R(-1.0);
  r->square = R(1.0);
  r->word = WHIRL_REID_UNDETERMINED;
}

static void whirl_reid_reset(whirl_state *state) {
  int32_t i;
  whirl_reid_forget(state);
  for (i = 0; i < 3; i++) {
    state->reid.acting[i] = R(0.0);
  }
#if HAS_CORRECTED
  for (i = 0; i < WHIRL_HISTORY; i++) {
    state->sent[i] = whirl_make(R(0.0), R(0.0));
  }
  state->correction = whirl_make(R(0.0), R(0.0));
#endif
}

/* Control acceleration really sent `samples` ticks ago. */
static whirl_complex whirl_sent(const whirl_state *state, int32_t samples) {
#if HAS_CORRECTED
  return state->sent[((state->head - samples) + WHIRL_HISTORY) % WHIRL_HISTORY];
#else
  return whirl_past(state, samples);
#endif
}

/* The lower triangle becomes that of L, L L' = m. */
static void whirl_reid_factorise(whirl_real m[WHIRL_UNKNOWNS][WHIRL_UNKNOWNS]) {
  int32_t i;
  int32_t j;
  int32_t k;
  for (j = 0; j < WHIRL_UNKNOWNS; j++) {
    for (i = j; i < WHIRL_UNKNOWNS; i++) {
      whirl_real sum = m[i][j];
      for (k = 0; k < j; k++) {
        sum -= m[i][k] * m[j][k];
      }
      m[i][j] = (i == j) ? M(sqrt)(sum) : (sum / m[j][j]);
    }
  }
}

/* L x = b, in place, for a b that is zero before `first`. */
static void whirl_reid_solve(whirl_real l[WHIRL_UNKNOWNS][WHIRL_UNKNOWNS], whirl_real x[WHIRL_UNKNOWNS], int32_t first) {
  int32_t i;
  int32_t k;
  for (i = first; i < WHIRL_UNKNOWNS; i++) {
    whirl_real sum = x[i];
    for (k = first; k < i; k++) {
      sum -= l[i][k] * x[k];
    }
    x[i] = sum / l[i][i];
  }
}

static void whirl_reid_judge(whirl_state *state, whirl_real square, const whirl_real mean[WHIRL_UNKNOWNS],
                             const whirl_real variance[WHIRL_UNKNOWNS]) {
  const whirl_params *const p = &state->params;
  whirl_reidentifier *const r = &state->reid;
  const whirl_real bounds[3] = {p->reidentify_stiffness, p->reidentify_damping, p->reidentify_gain};
  uint32_t word;
  int32_t i;
  r->square += /*@n_reid_memory@*/ * (square - r->square);
  if (!isfinite(r->square)) {
    whirl_reid_forget(state);
    return;
  }
  word = 0U;
  if (r->square > /*@n_reid_unlike@*/) {
    word = WHIRL_REID_OTHER_MACHINE;
  }
  for (i = 0; i < 3; i++) {
    const whirl_real size = M(fabs)(mean[i]);
    r->sd[i] = M(sqrt)(variance[i] * M(fmax)(R(1.0), r->square));
    r->estimate[i] = whirl_clamp(mean[i], -bounds[i], bounds[i]);
    word |= (r->sd[i] < (/*@n_reid_known@*/ * bounds[i])) ? (1U << (uint32_t)i) : 0U;
    word |= (size > bounds[i]) ? (8U << (uint32_t)i) : 0U;
    word |= (size > ((/*@n_reid_beyond@*/ * bounds[i]) + (/*@n_reid_differs@*/ * r->sd[i]))) ? WHIRL_REID_OTHER_MACHINE : 0U;
  }
  word |= ((word & 7U) == 0U) ? WHIRL_REID_UNDETERMINED : 0U;
  for (i = 0; i < 3; i++) {
    const whirl_real known = (M(fabs)(r->target[i]) > R(0.0)) ? /*@n_reid_remains@*/ : /*@n_reid_differs@*/;
    const whirl_real differs = known * r->sd[i];
    if ((word & WHIRL_REID_OTHER_MACHINE) != 0U) {
      r->target[i] = R(0.0);
    } else if (((word & 4U) != 0U) && ((word & (1U << (uint32_t)i)) != 0U)) {
      r->target[i] = (M(fabs)(r->estimate[i]) > differs) ? r->estimate[i] : R(0.0);
    } else {
      /* held: not determined, or a force for it would not be */
    }
  }
  r->word = word;
}

/* The window's equation into the sums of least squares, and what follows from them. */
static void whirl_reid_close(whirl_state *state) {
  const whirl_params *const p = &state->params;
  whirl_reidentifier *const r = &state->reid;
  const whirl_real bounds[3] = {p->reidentify_stiffness, p->reidentify_damping, p->reidentify_gain};
  const whirl_real per = R(1.0) / r->weight;
  const whirl_real runout = p->k1 * /*@n_reid_runout@*/;
  const whirl_real floor = p->k1 * /*@n_reid_floor@*/;
  const whirl_complex y = whirl_scale(per, r->y);
  const whirl_complex a = whirl_scale(per, r->a);
  const whirl_complex f = whirl_scale(per * (M(hypot)(p->eps_re, p->eps_im) + /*@n_reid_eccentric@*/), r->f);
  const whirl_complex elastic = whirl_scale(-p->k1 * per, r->z);
  const whirl_real size = /*@n_reid_error@*/ * (M(hypot)(elastic.re, elastic.im) + M(hypot)(a.re, a.im));
  const whirl_real sure = R(1.0) / ((floor * floor) + (size * size));
  whirl_real l[WHIRL_UNKNOWNS][WHIRL_UNKNOWNS];
  whirl_real half[WHIRL_UNKNOWNS];
  whirl_real mean[WHIRL_UNKNOWNS];
  whirl_real variance[WHIRL_UNKNOWNS];
  whirl_complex x[WHIRL_UNKNOWNS];
  whirl_complex left = y;
  int32_t i;
  int32_t j;
  x[0] = elastic;
  x[1] = whirl_scale(p->c * per, r->v);
  x[2] = a;
  x[3] = f;
  x[4] = whirl_make(-f.im, f.re);
  x[5] = whirl_make(runout, R(0.0));
  x[6] = whirl_make(R(0.0), runout);
  x[7] = whirl_scale(/*@n_reid_across@*/, whirl_make(-a.im, a.re));
  for (i = 0; i < WHIRL_UNKNOWNS; i++) {
    const whirl_real prior = (i < 3) ? (/*@n_reid_prior@*/ * bounds[i]) : R(1.0);
    for (j = 0; j <= i; j++) {
      const whirl_real both = (x[i].re * x[j].re) + (x[i].im * x[j].im);
      r->information[i][j] = (/*@n_reid_keep@*/ * r->information[i][j]) + (sure * both);
      l[i][j] = r->information[i][j];
    }
    r->moment[i] = (/*@n_reid_keep@*/ * r->moment[i]) + (sure * ((x[i].re * y.re) + (x[i].im * y.im)));
    l[i][i] += R(1.0) / (prior * prior);
    half[i] = r->moment[i];
  }
  whirl_reid_factorise(l);
  whirl_reid_solve(l, half, 0);
  for (i = 0; i < WHIRL_UNKNOWNS; i++) {
    whirl_real column[WHIRL_UNKNOWNS];
    for (j = 0; j < WHIRL_UNKNOWNS; j++) {
      column[j] = (i == j) ? R(1.0) : R(0.0);
    }
    whirl_reid_solve(l, column, i);
    mean[i] = R(0.0);
    variance[i] = R(0.0);
    for (j = i; j < WHIRL_UNKNOWNS; j++) {
      mean[i] += column[j] * half[j];
      variance[i] += column[j] * column[j];
    }
    left = whirl_sub(left, whirl_scale(mean[i], x[i]));
  }
  whirl_reid_judge(state, R(0.5) * sure * whirl_norm(left), mean, variance);
}

static void whirl_reid_collect(whirl_state *state, whirl_complex z, whirl_complex forcing, whirl_complex turn,
                               const whirl_input *in) {
  const whirl_params *const p = &state->params;
  whirl_reidentifier *const r = &state->reid;
  const whirl_complex third = whirl_phasor(r->theta / R(3.0));
  const whirl_complex back = whirl_conj(turn);
  const whirl_complex none = whirl_make(R(0.0), R(0.0));
  const whirl_real omega = in->omega;
  const whirl_real rest = R(1.0) - third.re;
  const whirl_real w = R(0.25) * rest * rest;
  const whirl_real w1 = (rest * ((omega < R(0.0)) ? -third.im : third.im)) / R(6.0);
  const whirl_real w2 = ((third.re * rest) + (third.im * third.im)) / R(18.0);
  const whirl_complex phi = whirl_scale(w, back);
  const whirl_complex per_angle = whirl_mul(whirl_make(w1, -w), back);
  const whirl_complex phi1 = whirl_scale(omega, per_angle);
  const whirl_complex phi2 =
      whirl_add(whirl_scale(omega * omega, whirl_mul(whirl_make(w2 - w, R(-2.0) * w1), back)),
                whirl_scale(in->omega_dot, per_angle));
  const whirl_complex force = whirl_add(whirl_scale(state->fraction, whirl_sent(state, state->whole_delay + 2)),
                                        whirl_scale(R(1.0) - state->fraction, whirl_sent(state, state->whole_delay + 1)));
  const whirl_complex a = whirl_mul(force, whirl_mul(phi, whirl_phasor(R(0.5) * omega * p->sample_time)));
  const whirl_complex f = whirl_mul(forcing, phi);
  const whirl_complex model = whirl_sub(whirl_mul(whirl_acceleration(p, none, z, R(1.0)), phi1),
                                        whirl_mul(whirl_acceleration(p, z, none, R(1.0)), phi));
  const whirl_complex given = whirl_add(a, whirl_mul(whirl_make(p->eps_re, p->eps_im), f));
  r->y = whirl_add(r->y, whirl_add(whirl_mul(z, phi2), whirl_sub(model, given)));
  r->z = whirl_add(r->z, whirl_mul(z, phi));
  r->v = whirl_add(r->v, whirl_mul(z, phi1));
  r->a = whirl_add(r->a, a);
  r->f = whirl_add(r->f, f);
  r->weight += w;
}

/* Stiffness, damping and gain of the actuators from z, force and angle, in weak form over windows of three turns, beside an
   unbalance that is not known: least squares with forgetting and a prior at the parameters. */
static void whirl_reid_step(whirl_state *state, whirl_complex z, bool fresh, whirl_complex forcing, whirl_complex turn,
                            const whirl_input *in) {
  const whirl_params *const p = &state->params;
  whirl_reidentifier *const r = &state->reid;
#if HAS_CORRECTED
  const whirl_real bounds[3] = {p->reidentify_stiffness, p->reidentify_damping, p->reidentify_gain};
  int32_t i;
#endif
  const whirl_real speed = M(fabs)(in->omega);
  const whirl_real turned = speed * p->sample_time;
  const uint32_t word = state->watch.word;
  const bool taken = ((word & (WHIRL_WATCH_GAIN_LOWERED | WHIRL_WATCH_FORCE_OFF)) != 0U) ||
                     ((word & (WHIRL_WATCH_FEEDBACK_OFF | WHIRL_WATCH_SENSOR_LOST)) == WHIRL_WATCH_FEEDBACK_OFF);
  const bool frozen = taken || !fresh || state->saturated || ((word & WHIRL_WATCH_ADAPTATION_FROZEN) != 0U) ||
                      (speed < (/*@n_reid_slow@*/ * M(sqrt)(M(fmax)(p->k1, R(0.0))))) || (turned > /*@n_reid_fast@*/);
  if (taken) {
    whirl_reid_forget(state);
  }
#if HAS_CORRECTED
  for (i = 0; i < 3; i++) {
    const whirl_real most = /*@n_reid_rate_rad@*/ * turned * bounds[i];
    r->acting[i] += whirl_clamp(r->target[i] - r->acting[i], -most, most);
  }
#endif
  if (frozen) {
    r->word |= WHIRL_REID_FROZEN;
    r->theta = R(-1.0);
  } else {
    const whirl_real window = R(18.849555921538759);
    r->word &= ~WHIRL_REID_FROZEN;
    r->theta += turned;
    if (r->theta >= window) {
      whirl_reid_close(state);
    }
    if ((r->theta < turned) || (r->theta >= window)) {
      r->theta = R(0.0);
      r->weight = R(0.0);
      r->y = whirl_make(R(0.0), R(0.0));
      r->z = r->y;
      r->v = r->y;
      r->a = r->y;
      r->f = r->y;
    }
    whirl_reid_collect(state, z, forcing, turn, in);
  }
}

static void whirl_reid_output(const whirl_reidentifier *r, whirl_output *out) {
  int32_t i;
  for (i = 0; i < 3; i++) {
    out->differs[i] = r->estimate[i];
    out->differs_sd[i] = r->sd[i];
    out->corrected[i] = r->acting[i];
  }
  out->reidentified = r->word;
}
#if HAS_CORRECTED

/* What the designed machine would have got. */
static whirl_complex whirl_seen(const whirl_state *state, whirl_complex sent) {
  return whirl_sub(whirl_scale(R(1.0) + state->reid.acting[2], sent), state->correction);
}

/* What to ask the machine for so that it moves as the designed one would. */
static whirl_complex whirl_corrected(whirl_state *state, whirl_motion e, whirl_complex asked) {
  const whirl_params *const p = &state->params;
  const whirl_real *const acting = state->reid.acting;
  const whirl_real left = state->watch.gain * (state->watch.force * state->watch.held);
#if HAS_PREDICT
  const whirl_complex z = e.z;
#else
  const whirl_complex z = whirl_add(e.z, whirl_scale(p->delay + (R(0.5) * p->sample_time), e.v));
#endif
  state->correction = whirl_add(whirl_scale(left * acting[0] * p->k1, z), whirl_scale(left * acting[1] * p->c, e.v));
  return whirl_scale(R(1.0) / (R(1.0) + acting[2]), whirl_add(asked, state->correction));
}
#endif
#endif
