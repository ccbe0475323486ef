
static whirl_complex whirl_turned(const whirl_input *in, whirl_real angle) {
  return whirl_mul(whirl_make(in->x, in->y), whirl_phasor(angle));
}

/* What the sensors would have shown the share `part` of the way from one valid sample to the next, `duration` apart: angle and
   speed as a cubic through both ends, the displacement linear in the frame that turns with the rotor. */
static whirl_input whirl_bridge(const whirl_input *from, const whirl_input *to, whirl_real duration, whirl_real part) {
  const whirl_real rest = R(1.0) - part;
  /* The last angle may have been wrapped: it is taken within half a turn of where the speed leads. */
  const whirl_real led = from->beta + (R(0.5) * (from->omega + to->omega) * duration);
  const whirl_real end = led + M(remainder)(to->beta - led, R(6.283185307179586));
  whirl_input m = *to;
  whirl_complex a;
  whirl_complex b;
  m.beta = (rest * rest * (((R(1.0) + (R(2.0) * part)) * from->beta) + (part * duration * from->omega))) +
           (part * part * (((R(1.0) + (R(2.0) * rest)) * end) - (rest * duration * to->omega)));
  m.omega = (rest * from->omega) + (part * to->omega);
  m.omega_dot = (rest * from->omega_dot) + (part * to->omega_dot);
  a = whirl_turned(from, m.beta - from->beta);
  b = whirl_turned(to, m.beta - end);
  m.x = (rest * a.re) + (part * b.re);
  m.y = (rest * a.im) + (part * b.im);
  return m;
}

void whirl_fill(whirl_state *state, const whirl_input *in, int32_t missed) {
  const whirl_real h = state->params.sample_time;
  const whirl_real all = (whirl_real)missed + R(1.0);
  const bool known = isfinite(in->beta) && isfinite(in->omega) && isfinite(in->omega_dot);
  int32_t back = (((whirl_real)missed > state->params.max_fill) ? (int32_t)state->params.max_fill : missed);
  if (!state->ready || !known) {
    back = 0;
  }
  for (; back > 0; back--) {
    const whirl_complex sent = whirl_past(state, 1);
    whirl_input m = *in;
    whirl_output out;
    if (in->valid && state->before.valid) {
      m = whirl_bridge(&state->before, in, all * h, R(1.0) - ((whirl_real)back / all));
    } else {
      const whirl_real ago = (whirl_real)back * h;
      m.valid = false;
      m.beta -= (in->omega - (R(0.5) * in->omega_dot * ago)) * ago;
      m.omega -= in->omega_dot * ago;
    }
    (void)whirl_one(state, &m, &out);
    /* what was sent stayed on */
    whirl_applied(state, sent.re / state->params.gain, sent.im / state->params.gain);
  }
}

whirl_status whirl_step_after(whirl_state *state, const whirl_input *in, int32_t missed, whirl_output *out) {
  const whirl_params *const p = &state->params;
  whirl_status status;
  *out = whirl_no_output();
  if (!state->ready) {
    status = WHIRL_NOT_READY;
  } else if ((p->max_gap > R(0.0)) && ((whirl_real)missed > p->max_gap)) {
    /* too long ago: the next sample is taken as the first */
    state->started = false;
    state->first = true;
    state->held = 0U;
    state->before.valid = false;
#if HAS_SUPERVISION
    state->watch.started = false;
    state->check.readings = 0;
#endif
    status = whirl_fault(state, WHIRL_GAP);
  } else {
    whirl_fill(state, in, missed);
#if HAS_SUPERVISION
    if ((whirl_real)missed > state->params.max_fill) {
      state->check.readings = 0; /* no acceleration across a gap */
    }
#endif
    status = whirl_one(state, in, out);
    state->before = *in;
    if (missed > 0) {
      const int32_t least = (missed > 5) ? missed : 5;
      state->bounded = (state->bounded > least) ? state->bounded : least;
    }
    if (status == WHIRL_OK) {
      if (state->bounded > 0) {
        const whirl_real most = M(fmax)(R(1.15) * state->recent, R(0.1) * p->force_limit);
        const whirl_real ux = whirl_clamp(out->ux, -most, most);
        const whirl_real uy = whirl_clamp(out->uy, -most, most);
        state->bounded--;
        if ((most > R(0.0)) && ((M(fabs)(out->ux) > most) || (M(fabs)(out->uy) > most))) {
          out->ux = ux;
          out->uy = uy;
          whirl_applied(state, ux, uy);
          /* where gaps never end the force must still follow a growing motion */
          state->recent *= state->grow;
        }
      } else {
        state->recent = M(fmax)(state->keep * state->recent, M(fmax)(M(fabs)(out->ux), M(fabs)(out->uy)));
      }
    }
  }
  return status;
}

whirl_status whirl_step(whirl_state *state, const whirl_input *in, whirl_output *out) {
  return whirl_step_after(state, in, 0, out);
}
