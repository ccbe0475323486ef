#if HAS_STRUCTURE

/* Free decay of a mode over a time, and where a constant acceleration leads from rest. */
typedef struct {
  whirl_real f00;
  whirl_real f01;
  whirl_real f10;
  whirl_real f11;
  whirl_real q;
} whirl_transition;

static whirl_transition whirl_mode_over(whirl_real omega, whirl_real damping, whirl_real time) {
  const whirl_real decay = damping * omega;
  const whirl_real ringing = omega * M(sqrt)(R(1.0) - (damping * damping));
  const whirl_real e = M(exp)(-decay * time);
  const whirl_real c = M(cos)(ringing * time);
  const whirl_real s = M(sin)(ringing * time) / ringing;
  whirl_transition t;
  t.f00 = e * (c + (decay * s));
  t.f01 = e * s;
  t.f10 = -omega * omega * t.f01;
  t.f11 = e * (c - (decay * s));
  t.q = (R(1.0) - t.f00) / (omega * omega);
  return t;
}

static void whirl_mode_set(whirl_mode *mode, whirl_real omega, whirl_real damping, whirl_real share, whirl_real h,
                           whirl_real split) {
  const bool some = (omega > R(0.0)) && (share != R(0.0));
  const whirl_real w = some ? omega : R(1.0);
  const whirl_real k = some ? share : R(0.0);
  const whirl_transition whole = whirl_mode_over(w, damping, h);
  const whirl_transition first = whirl_mode_over(w, damping, split * h);
  const whirl_transition second = whirl_mode_over(w, damping, (R(1.0) - split) * h);
  mode->f00 = whole.f00;
  mode->f01 = whole.f01;
  mode->f10 = whole.f10;
  mode->f11 = whole.f11;
  mode->first_q = k * ((second.f00 * first.q) + (second.f01 * first.f01));
  mode->first_v = k * ((second.f10 * first.q) + (second.f11 * first.f01));
  mode->second_q = k * second.q;
  mode->second_v = k * second.f01;
}

static void whirl_structure_set(whirl_state *state) {
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_real split = state->fraction;
/*@mode_lines@*/
}

static void whirl_structure_reset(whirl_state *state) {
  int32_t i;
  for (i = 0; i < WHIRL_MODES; i++) {
    state->modes[i].q = whirl_make(R(0.0), R(0.0));
    state->modes[i].v = state->modes[i].q;
  }
}

/* What the actuators make the structure show in the readings, one sample further. */
static whirl_complex whirl_structure_step(whirl_state *state) {
  const whirl_complex first = whirl_past(state, state->whole_delay + 2);
  const whirl_complex second = whirl_past(state, state->whole_delay + 1);
  whirl_complex sum = whirl_make(R(0.0), R(0.0));
  int32_t i;
  for (i = 0; i < WHIRL_MODES; i++) {
    whirl_mode *const m = &state->modes[i];
    const whirl_complex q = whirl_add(whirl_add(whirl_scale(m->f00, m->q), whirl_scale(m->f01, m->v)),
                                      whirl_add(whirl_scale(m->first_q, first), whirl_scale(m->second_q, second)));
    m->v = whirl_add(whirl_add(whirl_scale(m->f10, m->q), whirl_scale(m->f11, m->v)),
                     whirl_add(whirl_scale(m->first_v, first), whirl_scale(m->second_v, second)));
    m->q = q;
    sum = whirl_add(sum, q);
  }
  return sum;
}
#endif
