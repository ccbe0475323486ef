/* Number of the first parameter out of range, 0 when none is. */
static int32_t whirl_check(const whirl_params *p) {
/*@checks@*/
  return 0;
}

int32_t whirl_set_params(whirl_state *state, const whirl_params *params) {
  const int32_t wrong = whirl_check(params);
  if (wrong == 0) {
    const whirl_real samples = params->delay / params->sample_time;
    state->params = *params;
    state->whole_delay = (int32_t)(samples + /*@whole@*/);
    state->fraction = samples - (whirl_real)state->whole_delay;
    if (state->fraction < /*@whole@*/) {
      state->fraction = R(0.0);
    }
    state->keep = M(exp)(R(-5.0) * params->sample_time);
    state->grow = M(exp)(R(2.0) * params->sample_time);
#if HAS_STRUCTURE
    whirl_structure_set(state);
#endif
/*@estimator_set_params@*/
/*@law_set_params@*/
  }
  return wrong;
}

void whirl_reset(whirl_state *state) {
  int32_t i;
  for (i = 0; i < WHIRL_HISTORY; i++) {
    state->history[i] = whirl_make(R(0.0), R(0.0));
  }
  state->head = 0;
  state->good = whirl_make(R(0.0), R(0.0));
  state->held = 0U;
  state->first = true;
  state->saturated = false;
  state->started = false;
  state->before.valid = false;
  state->bounded = 0;
  state->recent = R(0.0);
#if HAS_SUPERVISION
  whirl_watch_reset(state);
#endif
#if HAS_REIDENTIFY
  whirl_reid_reset(state);
#endif
#if HAS_STRUCTURE
  whirl_structure_reset(state);
#endif
/*@estimator_reset@*/
#if HAS_AXIS_MEMORY
  state->memory[0] = /*@memory_start@*/;
  state->memory[1] = /*@memory_start@*/;
#endif
/*@law_reset@*/
}

int32_t whirl_init(whirl_state *state, const whirl_params *params) {
  const int32_t wrong = whirl_set_params(state, params);
  state->ready = (wrong == 0);
  if (state->ready) {
    whirl_reset(state);
  }
  return wrong;
}

static void whirl_push(whirl_state *state, whirl_complex acceleration) {
#if HAS_CORRECTED
  state->sent[state->head] = acceleration;
  state->history[state->head] = whirl_seen(state, acceleration);
#else
  state->history[state->head] = acceleration;
#endif
  state->head = (state->head + 1) % WHIRL_HISTORY;
}

void whirl_applied(whirl_state *state, whirl_real ux, whirl_real uy) {
  if (state->ready) {
    state->head = ((state->head - 1) + WHIRL_HISTORY) % WHIRL_HISTORY;
    whirl_push(state, whirl_scale(state->params.gain, whirl_make(ux, uy)));
  }
}

/* Plausibility gate: true when the reading is used, false when the last good one is held. The allowed jump grows with every
   held sample, so that the gate re-acquires by itself. Written so that NaN fails. */
static bool whirl_accept(whirl_state *state, const whirl_input *in) {
  const whirl_params *const p = &state->params;
  const whirl_real change = M(hypot)(in->x - state->good.re, in->y - state->good.im);
  const bool inside = in->valid && (M(fabs)(in->x) < p->sensor_range) && (M(fabs)(in->y) < p->sensor_range);
  const bool ok = inside && (state->first || (change <= (p->jump_limit * (R(1.0) + (whirl_real)state->held))));
  if (ok) {
    state->good = whirl_make(in->x, in->y);
    state->held = 0U;
    state->first = false;
  } else if (state->held < UINT32_MAX) {
    state->held++;
  } else {
    /* counted as far as the counter goes */
  }
  return ok;
}
#if HAS_RUNOUT

/* Form error of the surface the sensors look at, harmonics 1 to 5 of the rotor angle. */
static whirl_complex whirl_runout(const whirl_params *p, whirl_real beta) {
  const whirl_real x_cos[5] = {p->runout_x_cos_1, p->runout_x_cos_2, p->runout_x_cos_3, p->runout_x_cos_4,
                               p->runout_x_cos_5};
  const whirl_real x_sin[5] = {p->runout_x_sin_1, p->runout_x_sin_2, p->runout_x_sin_3, p->runout_x_sin_4,
                               p->runout_x_sin_5};
  const whirl_real y_cos[5] = {p->runout_y_cos_1, p->runout_y_cos_2, p->runout_y_cos_3, p->runout_y_cos_4,
                               p->runout_y_cos_5};
  const whirl_real y_sin[5] = {p->runout_y_sin_1, p->runout_y_sin_2, p->runout_y_sin_3, p->runout_y_sin_4,
                               p->runout_y_sin_5};
  const whirl_complex turn = whirl_phasor(beta);
  whirl_complex e = turn;
  whirl_complex sum = whirl_make(R(0.0), R(0.0));
  int32_t k;
  for (k = 0; k < 5; k++) {
    sum.re += (x_cos[k] * e.re) + (x_sin[k] * e.im);
    sum.im += (y_cos[k] * e.re) + (y_sin[k] * e.im);
    e = whirl_mul(e, turn);
  }
  return sum;
}
#endif

/* The estimate at the time at which the force will act. */
static whirl_motion whirl_at_effect(const whirl_state *state, whirl_motion now, whirl_real omega) {
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  whirl_motion s = now;
#if HAS_PREDICT
  whirl_complex held;
  int32_t i;
  if (state->fraction > R(0.0)) {
    s = whirl_predict(p, s, whirl_past(state, state->whole_delay + 1), omega, state->fraction * h);
  }
  for (i = state->whole_delay; i >= 1; i--) {
    s = whirl_predict(p, s, whirl_past(state, i), omega, h);
  }
  /* The force of this step is not known yet: over half the hold the last one stands for it, turned with the rotor. */
  held = whirl_mul(whirl_past(state, 1), whirl_phasor(omega * h));
  return whirl_predict(p, s, held, omega, R(0.5) * h);
#elif HAS_ADVANCE
  s.d = whirl_mul(now.d, whirl_phasor(omega * (p->delay + (R(0.5) * h))));
  return s;
#else
  (void)h;
  s.d = whirl_mul(now.d, whirl_phasor(omega * p->sensor_delay));
  return s;
#endif
}

static whirl_status whirl_fault(whirl_state *state, whirl_status reason) {
#if HAS_CORRECTED
  state->correction = whirl_make(R(0.0), R(0.0));
#endif
  whirl_push(state, whirl_make(R(0.0), R(0.0)));
  return reason;
}

static whirl_output whirl_no_output(void) {
  whirl_output out;
  out.ux = R(0.0);
  out.uy = R(0.0);
  out.requested_ux = R(0.0);
  out.requested_uy = R(0.0);
  out.s_x = R(0.0);
  out.s_y = R(0.0);
  out.x = R(0.0);
  out.y = R(0.0);
  out.vx = R(0.0);
  out.vy = R(0.0);
  out.saturated = false;
  out.held = false;
#if HAS_SUPERVISION
  out.supervision = 0U;
#endif
#if HAS_REIDENTIFY
  out.differs[0] = R(0.0);
  out.differs[1] = R(0.0);
  out.differs[2] = R(0.0);
  out.differs_sd[0] = R(0.0);
  out.differs_sd[1] = R(0.0);
  out.differs_sd[2] = R(0.0);
  out.corrected[0] = R(0.0);
  out.corrected[1] = R(0.0);
  out.corrected[2] = R(0.0);
  out.reidentified = WHIRL_REID_UNDETERMINED;
#endif
  return out;
}

/* What amplifier and actuator can do. */
static void whirl_limit_force(const whirl_state *state, whirl_output *out) {
  const whirl_params *const p = &state->params;
  out->ux = out->requested_ux;
  out->uy = out->requested_uy;
  if (p->force_limit > R(0.0)) {
    out->ux = whirl_clamp(out->ux, -p->force_limit, p->force_limit);
    out->uy = whirl_clamp(out->uy, -p->force_limit, p->force_limit);
    /* A law that knows the limit asks for it up to rounding. */
    out->saturated = M(fmax)(M(fabs)(out->ux), M(fabs)(out->uy)) >= (/*@reached@*/ * p->force_limit);
  }
  if (p->slew_limit > R(0.0)) {
    const whirl_real most = p->slew_limit * p->sample_time;
#if HAS_CORRECTED
    const whirl_complex last = whirl_sent(state, 1);
#else
    const whirl_complex last = whirl_past(state, 1);
#endif
    const whirl_real ux = whirl_clamp(out->ux, (last.re / p->gain) - most, (last.re / p->gain) + most);
    const whirl_real uy = whirl_clamp(out->uy, (last.im / p->gain) - most, (last.im / p->gain) + most);
    const bool slower = (M(fabs)(ux - out->ux) > R(0.0)) || (M(fabs)(uy - out->uy) > R(0.0));
    out->saturated = out->saturated || slower;
    out->ux = ux;
    out->uy = uy;
  }
}

/* One sample time of the controller. */
static whirl_status whirl_one(whirl_state *state, const whirl_input *in, whirl_output *out) {
  const whirl_params *const p = &state->params;
  whirl_real beta;
  whirl_real ax;
  whirl_real ay;
  whirl_complex z;
  whirl_complex forcing;
  whirl_complex d;
  whirl_complex f;
  whirl_motion e;
  bool fresh;

  *out = whirl_no_output();
  if (!isfinite(in->beta) || !isfinite(in->omega) || !isfinite(in->omega_dot)) {
    return whirl_fault(state, WHIRL_NOT_FINITE);
  }
  fresh = whirl_accept(state, in);
  out->held = !fresh;
  if ((whirl_real)state->held > p->stale_limit) {
    return whirl_fault(state, WHIRL_STALE_SENSOR);
  }

  /* rotor quantities at the instant the displacement was taken */
  beta = in->beta - (in->omega * p->sensor_delay);
  z = whirl_sub(state->good, whirl_make(p->offset_x, p->offset_y));
#if HAS_RUNOUT
  z = whirl_sub(z, whirl_runout(p, beta));
#endif
#if HAS_STRUCTURE
  z = whirl_sub(z, whirl_structure_step(state));
#endif
  /* unbalance acceleration per metre of eccentricity, e^(i beta)(omega^2 - i omega_dot) */
  forcing = whirl_mul(whirl_phasor(beta), whirl_make(in->omega * in->omega, -in->omega_dot));
#if HAS_FEEDFORWARD
  d = whirl_make(p->eps_re, p->eps_im);
#if HAS_SUPERVISION
  d = whirl_add(d, whirl_scale(state->watch.blend, whirl_sub(state->watch.acting, d)));
#endif
  d = whirl_mul(d, forcing);
#else
  d = whirl_make(R(0.0), R(0.0));
#endif
  e = whirl_estimate(state, z, fresh, forcing, d, in->omega);
  out->x = e.z.re;
  out->y = e.z.im;
  out->vx = e.v.re;
  out->vy = e.v.im;
#if HAS_SUPERVISION
  whirl_watch_step(state, z, fresh, forcing, beta, e.d, in->omega);
  out->supervision = state->watch.word;
#if HAS_REIDENTIFY
  whirl_reid_step(state, z, fresh, forcing, whirl_phasor(beta), in);
  whirl_reid_output(&state->reid, out);
#endif
  if ((state->watch.word & WHIRL_WATCH_TRIP) != 0U) {
    return whirl_fault(state, WHIRL_SUPERVISION);
  }
  if (state->watch.blend > R(0.0)) {
    const whirl_complex acts = whirl_mul(state->watch.acting, forcing);
    e.d = whirl_add(e.d, whirl_scale(state->watch.blend, whirl_sub(acts, e.d)));
  }
#endif
  e = whirl_at_effect(state, e, in->omega);
#if HAS_FEEDFORWARD
  d = e.d;
#elif HAS_CARRIED
  d = whirl_scale(state->watch.blend, e.d);
#endif
#if HAS_MODEL_FREE
  f = d;
#else
  f = whirl_add(whirl_acceleration(p, e.z, e.v, p->cancel), d);
#endif
#if HAS_OWN_CALL
/*@law_call@*/
#elif HAS_AXIS_MEMORY
  ax = whirl_law(p, &state->memory[0], e.z.re, e.v.re, f.re, &out->s_x);
  ay = whirl_law(p, &state->memory[1], e.z.im, e.v.im, f.im, &out->s_y);
#else
  ax = whirl_law(p, e.z.re, e.v.re, f.re, &out->s_x);
  ay = whirl_law(p, e.z.im, e.v.im, f.im, &out->s_y);
#endif
#if HAS_SUPERVISION
  /* the synchronous part of the force is not feedback */
  d = whirl_scale(R(-1.0), d);
#endif
#if HAS_SYNCHRONOUS
  {
    const whirl_real ahead = in->omega * (p->delay + (R(0.5) * p->sample_time));
    const whirl_complex a = whirl_synchronous(state, z, beta, in->omega, whirl_mul(forcing, whirl_phasor(ahead)),
#if HAS_SUPERVISION
                                              fresh && !state->saturated && state->watch.adapt);
    d = whirl_add(d, a);
#else
                                              fresh && !state->saturated);
#endif
    ax += a.re;
    ay += a.im;
  }
#endif
/*@law_add@*/
#if HAS_SUPERVISION
  if ((state->watch.gain < R(1.0)) || (state->watch.force < R(1.0)) || (state->watch.held < R(1.0)) ||
      (state->watch.own > R(0.0))) {
    ax = whirl_watch_left(state, ax, d.re, state->watch.motion.v.re, e.d.re);
    ay = whirl_watch_left(state, ay, d.im, state->watch.motion.v.im, e.d.im);
  }
#endif
#if HAS_CORRECTED
  {
    const whirl_complex asked = whirl_corrected(state, e, whirl_make(ax, ay));
    ax = asked.re;
    ay = asked.im;
  }
#endif
  if (!isfinite(ax / p->gain) || !isfinite(ay / p->gain)) {
    return whirl_fault(state, WHIRL_NOT_FINITE);
  }
  out->requested_ux = ax / p->gain;
  out->requested_uy = ay / p->gain;
  whirl_limit_force(state, out);
  state->saturated = out->saturated;
  whirl_push(state, whirl_scale(p->gain, whirl_make(out->ux, out->uy)));
  return WHIRL_OK;
}
