#if HAS_SUPERVISION

static whirl_real whirl_toward(whirl_real now, whirl_real target, whirl_real most) {
  return now + whirl_clamp(target - now, -most, most);
}

static void whirl_watch_reset(whirl_state *state) {
  whirl_watch *const w = &state->watch;
  const whirl_complex none = whirl_make(R(0.0), R(0.0));
  w->started = false;
  w->follow = false;
  w->returned = false;
  w->motion.z = none;
  w->motion.v = none;
  w->motion.d = none;
  w->synchronous = none;
  w->offset = none;
  w->given = none;
  w->estimated = whirl_make(state->params.eps_re, state->params.eps_im);
  w->quiet = w->estimated;
  w->used = w->estimated;
  w->acting = w->estimated;
  w->square = R(0.0);
  w->mark = R(0.0);
  w->time = R(0.0);
  w->above = R(0.0);
  w->wait = R(0.0);
  w->mismatch = R(0.0);
  w->worse = R(0.0);
  w->at_limit = R(0.0);
  w->own = R(0.0);
  w->sudden = R(0.0);
  w->settle = R(0.0);
  w->calm = R(0.0);
  w->held = R(1.0);
  w->feedback = R(1.0);
  w->force = R(1.0);
  w->sensor = R(1.0);
  w->blend = R(0.0);
  w->gain = R(1.0);
  w->late = R(0.0);
  w->steps = 0;
  w->reasons = 0U;
  w->word = 0U;
  w->adapt = true;
  whirl_check_reset(state);
}

/* Observer of the unbalance that acts, and the readings without their synchronous part. */
static void whirl_watch_observe(whirl_state *state, whirl_complex z, bool fresh, whirl_complex a, whirl_complex turn,
                                whirl_real omega) {
  whirl_watch *const w = &state->watch;
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_complex back = whirl_conj(turn);
  if (!w->started) {
    w->motion.z = z;
    w->motion.v = whirl_mul(whirl_make(R(0.0), omega), z);
    w->motion.d = w->given;
    w->synchronous = whirl_mul(z, back);
    w->started = true;
  } else {
    w->motion = whirl_predict(p, w->motion, a, omega, h);
    if (fresh) {
      const whirl_complex e = whirl_sub(z, w->motion.z);
      const whirl_complex rest = whirl_sub(whirl_sub(z, w->offset), whirl_mul(w->synchronous, turn));
      /* poles at -b, -b and, for the disturbance that turns, i omega - b */
      const whirl_real b = p->watch_bandwidth;
      const whirl_complex turning = whirl_make(b, omega);
      const whirl_complex speed = whirl_make((R(3.0) * b * b) - p->k1, b * omega);
      w->motion.z = whirl_add(w->motion.z, whirl_scale(R(3.0) * b * h, e));
      w->motion.v = whirl_add(w->motion.v, whirl_scale(h, whirl_mul(speed, e)));
      w->motion.d = whirl_add(w->motion.d, whirl_scale(b * h, whirl_mul(whirl_mul(turning, turning), e)));
      w->synchronous = whirl_add(w->synchronous, whirl_scale(h * R(25.0), whirl_mul(rest, back)));
      w->offset = whirl_add(w->offset, whirl_scale(h * R(5.0), rest));
      w->square += (h / R(0.025)) * (whirl_norm(rest) - w->square);
    }
  }
}

/* The unbalance that acts; a feedforward from a fixed one follows it from the first mismatch of 30 ms on. */
static void whirl_watch_feedforward(whirl_state *state, bool fresh, whirl_complex forcing) {
  whirl_watch *const w = &state->watch;
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_real size = whirl_norm(forcing);
  const whirl_real slow = R(0.02) * p->k1;
  whirl_complex now = w->estimated;
  if (size > (slow * slow)) {
    now = whirl_scale(R(1.0) / size, whirl_mul(w->motion.d, whirl_conj(forcing)));
  }
  w->estimated = whirl_add(w->estimated, whirl_scale(h / R(0.03), whirl_sub(now, w->estimated)));
  if (w->square < (R(0.25) * p->watch_level * p->watch_level)) {
    w->quiet = whirl_add(w->quiet, whirl_scale(h / R(0.3), whirl_sub(w->estimated, w->quiet)));
  }
#if HAS_FIXED
  {
    const whirl_real acts = whirl_norm(w->motion.d);
    const whirl_real given = whirl_norm(w->given);
    const whirl_real least = p->k1 * R(20e-6);
    const whirl_real limit = M(fmax)((R(0.35) * R(0.35)) * M(fmax)(acts, given), least * least);
    const bool apart = fresh && (whirl_norm(whirl_sub(w->motion.d, w->given)) > limit);
    w->mismatch = (apart && (w->time > R(0.05))) ? (w->mismatch + h) : R(0.0);
    if ((w->mismatch > R(0.03)) && !w->follow && (w->steps == 0)) {
      const whirl_real along = (w->motion.d.re * w->given.re) + (w->motion.d.im * w->given.im);
      const bool phase = (along < R(0.0)) || ((along * along) < (R(0.25) * acts * given));
      /* A force that is worse than none ends at once, another is moved from where it is. */
      w->used = (phase || (acts < (R(0.25) * given))) ? whirl_make(R(0.0), R(0.0)) : whirl_make(p->eps_re, p->eps_im);
      w->follow = true;
      w->wait = R(0.12);
      w->reasons |= phase ? WHIRL_WATCH_FEEDFORWARD_PHASE : WHIRL_WATCH_UNBALANCE_CHANGED;
    }
  }
#else
  (void)fresh;
#endif
  {
#if HAS_FIXED
    const int32_t least_steps = 1;
#else
    const int32_t least_steps = 4;
#endif
    const bool quiet = (w->late <= R(0.0)) && (w->steps >= least_steps) && (w->square < (p->watch_level * p->watch_level));
    if ((w->follow && (w->steps == 0)) || quiet) {
      w->used = whirl_add(w->used, whirl_scale(h / R(0.12), whirl_sub(now, w->used)));
    }
    if (w->follow || (w->steps > 0)) {
      w->blend = whirl_toward(w->blend, R(1.0), h / R(0.02));
    }
    /* The gain comes back once: a motion that the law feeds returns with it, and is answered for good. */
    w->calm = (quiet && (w->steps <= 3)) ? (w->calm + h) : R(0.0);
    if ((w->calm > R(1.0)) && !w->returned) {
      w->returned = true;
      w->follow = true;
      w->steps = 0;
      w->wait = R(0.12);
    }
  }
}

static void whirl_watch_step_down(whirl_watch *w, whirl_real limit, uint32_t reason) {
  int32_t next;
  /* An estimate made while motion grew is not trusted: the last quiet one. */
#if HAS_FIXED
  if (w->follow && (w->steps > 0)) {
    w->used = w->quiet;
  }
#else
  if (w->steps == 0) {
    w->used = w->quiet;
  }
#endif
  w->reasons |= reason;
  next = w->steps + ((w->square > (R(9.0) * limit * limit)) ? 2 : 1);
  if (w->steps < 4) {
#if HAS_FIXED
    /* no adaptation to freeze */
    next = (w->steps < 3) ? 3 : next;
#elif HAS_CARRIED
    next = (w->steps == 0) ? 1 : 4;
#endif
    /* the own damping is never left out */
    next = (next > 4) ? 4 : next;
  }
  w->steps = (next > 6) ? 6 : next;
  w->wait = (w->steps >= 5) ? R(0.6) : ((w->steps == 4) ? R(0.2) : R(0.06));
  w->above = R(0.0);
  w->worse = R(0.0);
}

static void whirl_watch_motion(whirl_state *state, whirl_complex forcing, whirl_real omega) {
  whirl_watch *const w = &state->watch;
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_real level = M(sqrt)(w->square);
#if HAS_FIXED
  const whirl_real start = R(0.05);
  const bool sudden = false;
#else
  bool sudden;
  const whirl_real start = R(0.09);
#endif
  w->settle = M(fmax)(R(0.0), w->settle - h);
  w->wait = M(fmax)(M(fmax)(R(0.0), w->wait - h), w->settle);
  /* At its limit the force damps nothing: the loop that feeds such a motion is opened before the disk gathers speed.
     Without a feedforward the feedback has to catch the rotor first; with one no start is at its limit again and again. */
  {
    const bool full = (w->at_limit > R(0.5)) && (level > (R(2.0) * p->watch_level)) && (w->time > start);
#if HAS_FIXED
    const bool starting = (w->steps == 0) && (w->time > R(0.09)) && (w->time < (R(0.12) + R(0.06))) &&
                          (w->wait <= R(0.0)) && (w->at_limit > R(0.15)) && (level > (R(1.4) * p->watch_level));
#else
    const bool starting = false;
#endif
    if ((full || starting) && (w->settle <= R(0.0)) && (w->steps <= 3)) {
      whirl_watch_step_down(w, p->watch_level, WHIRL_WATCH_GROWTH);
      w->steps = 4;
      w->wait = R(0.2);
    }
  }
  /* A gain that came back to a quiet rotor and brings the motion back. */
  if (w->returned && (w->steps == 0) && (w->wait > R(0.0)) && (w->settle <= R(0.0)) && (state->check.test <= R(0.0)) &&
      (level > p->watch_level)) {
    whirl_watch_step_down(w, p->watch_level, WHIRL_WATCH_GROWTH);
  }
#if HAS_FIXED
#else
  {
    const whirl_real largest = M(fmax)(whirl_norm(w->estimated), whirl_norm(w->quiet));
    sudden = (w->steps == 0) && (w->time > R(0.5)) &&
             (whirl_norm(whirl_sub(w->estimated, w->quiet)) > ((R(0.35) * R(0.35)) * largest));
    w->sudden = sudden ? (w->sudden + h) : R(0.0);
    sudden = sudden && (w->sudden < R(0.4));
    if (sudden) {
      w->above = R(0.0);
      w->worse = R(0.0);
    }
  }
#endif
  if ((w->time >= R(0.12)) && (w->wait <= R(0.0)) && !sudden) {
    const whirl_real k = p->k1 - (omega * omega);
    const whirl_real c = p->c * omega;
    const whirl_real most = M(fmax)(whirl_norm(w->estimated), whirl_norm(whirl_make(p->eps_re, p->eps_im)));
    const whirl_real open = M(sqrt)((most * whirl_norm(forcing)) / M(fmax)((k * k) + (c * c), R(1e-12)));
    if (level > p->watch_level) {
      if (w->above <= R(0.0)) {
        w->mark = level;
      }
      if (w->steps <= 3) {
        w->mark = M(fmax)(w->mark, level);
      }
      w->above += h;
    } else {
      w->above = R(0.0);
    }
    if (w->above > R(0.06)) {
      /* Without feedback the rotor decays as slowly as it is damped: only growth is the controller's then. */
      const whirl_real share = (w->steps == 0) ? R(0.8) : ((w->steps > 3) ? R(1.1) : R(0.95));
      if (level > (share * w->mark)) {
        whirl_watch_step_down(w, p->watch_level, WHIRL_WATCH_GROWTH);
      }
      w->above = R(0.0);
    }
    /* the steady whirl of the model without control, with the larger of the two unbalances */
    {
      const bool fast = (omega * omega) > (R(0.1) * p->k1);
      const bool large = M(sqrt)(whirl_norm(w->synchronous)) > ((R(1.1) * open) + (R(0.25) * p->watch_level));
      w->worse = (fast && large) ? (w->worse + h) : R(0.0);
    }
    if (w->worse > R(0.06)) {
      whirl_watch_step_down(w, p->watch_level, WHIRL_WATCH_WORSE_THAN_OPEN);
    }
  }
}

/* A late force still acts: ended at once it would leave the rotor ringing into its next critical speed. */
static void whirl_watch_let_go_late(whirl_state *state) {
  whirl_watch *const w = &state->watch;
  if (w->late <= R(0.0)) {
    if (w->steps < 4) {
#if HAS_FIXED
      w->used = w->follow ? w->quiet : whirl_make(state->params.eps_re, state->params.eps_im);
#else
      w->used = w->quiet;
#endif
    }
    w->late = state->check.found;
    if (w->steps < 5) {
      w->steps = 5;
    }
    w->wait = /*@n_late_fade@*/;
  }
}

/* The supervisor beside the law: see whirl_output.word. */
static void whirl_watch_step(whirl_state *state, whirl_complex z, bool fresh, whirl_complex forcing, whirl_real beta,
                             whirl_complex d, whirl_real omega) {
  static const whirl_real gains[7] = {R(1.0), R(1.0), R(0.5), R(0.25), R(0.0), R(0.0), R(0.0)};
  whirl_watch *const w = &state->watch;
  const whirl_real h = state->params.sample_time;
  const whirl_complex a = whirl_add(whirl_scale(state->fraction, whirl_past(state, state->whole_delay + 2)),
                                    whirl_scale(R(1.0) - state->fraction, whirl_past(state, state->whole_delay + 1)));
  const bool lost = state->held >= 3U;
  uint32_t force;
  bool limit;
  w->given = whirl_add(whirl_scale(R(1.0) - w->blend, d), whirl_scale(w->blend, whirl_mul(w->acting, forcing)));
  whirl_watch_observe(state, z, fresh, a, whirl_phasor(beta), omega);
  w->time = M(fmin)(w->time + h, R(1.0));
  whirl_watch_feedforward(state, fresh, forcing);
  whirl_watch_motion(state, forcing, omega);
  force = whirl_force_check_step(state, z, fresh, a, forcing, state->saturated);
  if (state->check.test > R(0.0)) {
    w->reasons |= WHIRL_WATCH_FORCE_TESTED;
    w->wait = R(0.12);
  }
  if (state->check.changed) {
    w->reasons |= WHIRL_WATCH_UNBALANCE_CHANGED;
    w->settle = R(0.4);
    w->estimated = state->check.eps;
#if HAS_FIXED
    w->follow = true;
    w->used = w->estimated;
    w->blend = R(1.0);
#endif
  }
  w->reasons |= force;
  if (force == WHIRL_WATCH_FORCE_LATE) {
    whirl_watch_let_go_late(state);
  } else if (force != 0U) {
    w->steps = 6;
  } else {
    /* the rotor follows the force */
  }
  w->at_limit += (h / R(0.05)) * ((state->saturated ? R(1.0) : R(0.0)) - w->at_limit);
  limit = w->at_limit > R(0.5);
  w->sensor = whirl_toward(w->sensor, lost ? R(0.0) : R(1.0), h / R(0.01));
  w->feedback = whirl_toward(w->feedback, gains[w->steps], h / R(0.02));
  w->own = whirl_toward(w->own, (w->steps >= 4) ? R(1.0) : R(0.0), h / R(0.02));
  w->force = whirl_toward(w->force, (w->steps >= 5) ? R(0.0) : R(1.0), h / ((w->late > R(0.0)) ? /*@n_late_fade@*/ : R(0.3)));
  if ((w->late > R(0.0)) && (w->force <= R(0.0))) {
    w->steps = 6;
  }
  w->held = (state->check.test > R(0.0)) ? whirl_toward(w->held, R(0.0), h / R(2e-3))
                                         : whirl_toward(w->held, R(1.0), h / R(5e-3));
  w->acting = (w->late > R(0.0)) ? whirl_mul(w->used, whirl_phasor(omega * w->late)) : w->used;
  w->gain = w->feedback * w->sensor;
  w->adapt = (w->steps == 0) && !limit && !lost && (state->check.test <= R(0.0));
  w->word = w->reasons | (limit ? WHIRL_WATCH_SATURATION : 0U) | (lost ? WHIRL_WATCH_SENSOR_LOST : 0U);
  w->word |= (w->adapt ? 0U : WHIRL_WATCH_ADAPTATION_FROZEN) | (w->follow ? WHIRL_WATCH_FEEDFORWARD_REPLACED : 0U);
#if HAS_CARRIED
  w->word |= (w->steps > 0) ? WHIRL_WATCH_FEEDFORWARD_REPLACED : 0U;
#endif
  w->word |= ((w->steps == 2) || (w->steps == 3)) ? WHIRL_WATCH_GAIN_LOWERED : 0U;
  w->word |= ((w->steps >= 4) || lost) ? WHIRL_WATCH_FEEDBACK_OFF : 0U;
  w->word |= ((w->steps >= 5) ? WHIRL_WATCH_FORCE_OFF : 0U) | ((w->steps >= 6) ? WHIRL_WATCH_TRIP : 0U);
}

/* What the supervision leaves of an acceleration that the law asks for; v, d: velocity and disturbance of that axis. */
static whirl_real whirl_watch_left(const whirl_state *state, whirl_real asked, whirl_real forward, whirl_real v,
                                   whirl_real d) {
  const whirl_watch *const w = &state->watch;
  const whirl_real damper = ((-w->sensor * R(0.3)) * M(sqrt)(M(fmax)(state->params.k1, R(0.0)))) * v;
  return (w->force * w->held) * (((R(1.0) - w->own) * (forward + (w->gain * (asked - forward)))) + (w->own * (damper - d)));
}
#endif
