#if HAS_SUPERVISION

static void whirl_check_reset(whirl_state *state) {
  whirl_force_check *const c = &state->check;
  const whirl_params *const p = &state->params;
  const whirl_complex none = whirl_make(R(0.0), R(0.0));
  const whirl_real samples = M(fmin)(M(floor)((/*@n_block@*/ / p->sample_time) + R(0.5)), R(1e6));
  const whirl_real block = M(fmax)(R(1.0), samples);
  const whirl_real first = M(floor)((/*@n_late@*/ / (block * p->sample_time)) + R(0.5));
  const whirl_real blocks = M(floor)((/*@n_later@*/ / (block * p->sample_time)) + R(0.5));
  int32_t i;
  c->samples = (int32_t)block;
  c->first = (int32_t)whirl_clamp(first, R(1.0), (whirl_real)WHIRL_BLOCKS);
  c->blocks = (int32_t)whirl_clamp(blocks, R(1.0), (whirl_real)WHIRL_BLOCKS);
  c->readings = 0;
  c->summed = 0;
  c->at = 0;
  c->z1 = none;
  c->z2 = none;
  c->a1 = none;
  c->forcing1 = none;
  c->sum = none;
  c->now = none;
  c->fd = none;
  c->fx = none;
  c->fy = none;
  c->fl = none;
  c->fm = none;
  c->fz = none;
  c->zd = none;
  c->zx = none;
  c->zy = none;
  c->zl = none;
  c->zm = none;
  for (i = 0; i < WHIRL_BLOCKS; i++) {
    c->ring[i] = none;
  }
  for (i = 0; i < 3; i++) {
    c->y[i] = none;
    c->u[i] = none;
    c->late[i] = none;
    c->later[i] = none;
    c->unbalance[i] = none;
    c->z[i] = none;
  }
  c->eps = whirl_make(p->eps_re, p->eps_im);
  c->ff = R(0.0);
  c->dd = R(0.0);
  c->xx = R(0.0);
  c->yy = R(0.0);
  c->xd = R(0.0);
  c->yd = R(0.0);
  c->ll = R(0.0);
  c->ld = R(0.0);
  c->mm = R(0.0);
  c->md = R(0.0);
  c->zz = R(0.0);
  c->time = R(0.0);
  c->loud = R(0.0);
  c->gain_time = R(0.0);
  c->late_time = R(0.0);
  c->proof_time = R(0.0);
  c->unsure = R(0.0);
  c->test = R(0.0);
  c->tested = /*@n_again@*/;
  c->before = R(0.0);
  c->suspected = 0U;
  c->changed = false;
  c->usual = R(0.0);
  c->risen = false;
  c->known = false;
  c->proven = R(0.0);
  c->idle = R(0.0);
  c->found = R(0.0);
}

/* A gain of this size fits, and that of a sound actuator does not. */
static bool whirl_force_missing(const whirl_force_fit *f, const whirl_params *p, whirl_real proof) {
  const whirl_real bound = (proof * M(fmax)(f->by_gain, R(0.0))) + whirl_force_play(p);
  const whirl_real of_x = /*@n_sound@*/ - f->gain_x;
  const whirl_real of_y = /*@n_sound@*/ - f->gain_y;
  const bool x = (f->gain_x < /*@n_low@*/) && ((of_x * of_x * f->sure_x) > bound);
  const bool y = (f->gain_y < /*@n_low@*/) && ((of_y * of_y * f->sure_y) > bound);
  return (f->low > (/*@n_least@*/)) && (f->high < /*@n_high@*/) && (f->by_gain < f->by_delay) && (x || y);
}

/* The gain is negative, and none would fit worse. */
static bool whirl_force_turned(const whirl_force_fit *f, const whirl_params *p) {
  const whirl_real sure = (f->gain_x < f->gain_y) ? f->sure_x : f->sure_y;
  const whirl_real bound = (/*@n_proof@*/ * M(fmax)(f->by_gain, R(0.0))) + whirl_force_play(p);
  return (f->low < (/*@n_reverse@*/)) && ((f->low * f->low * sure) > bound);
}

/* The force ends while the unbalance turns on: soon one of them alone explains r. 0 or a WHIRL_WATCH_ bit. */
static uint32_t whirl_force_tested(whirl_force_check *c, const whirl_params *p, const whirl_force_fit *f) {
  uint32_t found = 0U;
  c->test += p->sample_time;
  if (f->low < (/*@n_reverse@*/)) {
    c->suspected = WHIRL_WATCH_FORCE_REVERSED;
  }
  if (c->test > /*@n_told@*/) {
    const whirl_force_fit any = whirl_fit_force(c, p->k1, whirl_make(R(0.0), R(0.0)), false);
    const whirl_real by_gain = M(fmax)(f->by_gain, R(0.0));
    const whirl_real changed = M(fmax)(any.rr, R(0.0));
    const whirl_real proof = (p->slew_limit > R(0.0)) ? /*@n_proof@*/ : /*@n_blind_proof@*/;
    const bool missing = !c->known && whirl_force_missing(&any, p, proof);
    const bool told = c->known && (M(fmin)(by_gain, changed) < (/*@n_told_by@*/ * M(fmax)(by_gain, changed)));
    if (missing || told || (c->test >= (c->known ? /*@n_known_test@*/ : /*@n_test@*/))) {
      const bool force = told ? (by_gain < changed) : (c->known && (f->rr < (/*@n_remains@*/ * c->before)));
      c->test = R(0.0);
      c->tested = R(0.0);
      c->loud = R(0.0);
      c->gain_time = R(0.0);
      c->late_time = R(0.0);
      c->proof_time = R(0.0);
      if (missing) {
        found = whirl_force_turned(&any, p) ? WHIRL_WATCH_FORCE_REVERSED : WHIRL_WATCH_FORCE_LOST;
      } else if (force) {
        found = c->suspected;
      } else {
        c->eps = any.eps;
        c->changed = true;
      }
    }
  }
  return found;
}

/* A delay of the force explains the residual, but for the share `left`. */
static bool whirl_force_delayed(const whirl_force_fit *f, whirl_real least, whirl_real left) {
  return (f->rr > least) && (f->by_delay < (left * f->rr)) && (f->by_delay < (/*@n_better@*/ * f->changed)) &&
         (f->by_delay < f->by_gain) && (f->share > /*@n_late_least@*/) && (f->share < /*@n_late_most@*/);
}

/* A residual is there: a suspicion, and what follows from it. 0 or a WHIRL_WATCH_ bit. */
static uint32_t whirl_force_suspect(whirl_force_check *c, const whirl_params *p, const whirl_force_fit *f, bool starting) {
  const whirl_real h = p->sample_time;
  const whirl_real least = whirl_force_least(p);
  const bool large = f->rr > ((/*@n_large@*/ * /*@n_large@*/) * least);
  const bool reversed = f->low < (/*@n_reverse@*/);
  const bool fault = (f->rr > least) && (f->low > (/*@n_least@*/)) && (f->high < /*@n_high@*/) && (f->by_gain < f->by_delay);
  /* what limits a force neither takes nearly all of it nor shifts nearly all of it in time */
  const bool known = c->unsure <= R(0.0);
  const bool plain = (/*@n_plain@*/ * f->rr) > M(fmin)(f->by_gain, f->by_delay);
  const whirl_real left = (starting && !known) ? /*@n_unlike@*/ : /*@n_left@*/;
  const whirl_real than_other = reversed ? R(1.0) : /*@n_better@*/;
  const bool gain = fault && (f->low < /*@n_low@*/) && (f->by_gain < (left * f->rr)) &&
                    (!known || (f->by_gain < (than_other * f->changed)));
  /* a delay that explains nearly all needs no error of the stiffness beside it */
  const whirl_force_fit stiff = whirl_fit_force(c, R(0.0), c->eps, true);
  const bool alone = !starting && whirl_force_delayed(&stiff, least, /*@n_alone@*/);
  const bool late = (known || plain) && (alone || whirl_force_delayed(f, least, /*@n_left@*/));
  /* an unbalance that doubles under a force that cancels it looks like a lost actuator at first */
  const bool other = (f->changed < (/*@n_other@*/ * f->rr)) && !reversed;
  const whirl_real usual = other ? /*@n_unclear@*/ : /*@n_confirm@*/;
  const whirl_real confirm = starting ? /*@n_early@*/ : ((large && reversed) ? /*@n_quick@*/ : usual);
  uint32_t found = 0U;
  bool proof = false;
  bool open;
  bool early;
  c->loud += h;
  c->tested = M(fmin)(c->tested + h, /*@n_again@*/);
  c->gain_time = gain ? (c->gain_time + h) : R(0.0);
  c->late_time = late ? (c->late_time + h) : R(0.0);
  if (late) {
    c->found = alone ? stiff.delay : f->delay;
  }
  if (reversed && fault) {
    /* nothing that limits a force turns its sign */
    const whirl_force_fit any = starting ? *f : whirl_fit_force(c, p->k1, whirl_make(R(0.0), R(0.0)), false);
    proof = whirl_force_missing(&any, p, /*@n_proof@*/);
  }
  c->proof_time = proof ? (c->proof_time + h) : R(0.0);
  open = (c->tested >= /*@n_again@*/) && (!starting || !known); /* a test may tell more */
  early = open && !starting && (f->changed < (/*@n_unlike@*/ * f->rr)) && large && fault &&
          (f->by_gain < (/*@n_early_left@*/ * f->rr)) && (f->by_gain < f->changed) && (f->low < /*@n_early_low@*/);
  if (c->proof_time > /*@n_confirm@*/) {
    found = WHIRL_WATCH_FORCE_REVERSED;
  } else if ((c->gain_time > confirm) || early) {
    const bool sure = starting ? ((known || plain) && whirl_force_missing(f, p, /*@n_proof@*/)) : known;
    const whirl_real most = (f->changed >= (/*@n_unlike@*/ * f->rr)) ? /*@n_better@*/ : /*@n_clear@*/;
    c->suspected = WHIRL_WATCH_FORCE_LOST;
    if (reversed) {
      c->suspected = WHIRL_WATCH_FORCE_REVERSED;
    }
    if (!early && sure && (f->by_gain < (most * f->changed))) {
      found = c->suspected;
    } else if (open) {
      c->known = sure;
      c->before = f->rr;
      c->test = h;
    } else {
      /* the last test is not long ago */
    }
  } else if (c->late_time > /*@n_confirm@*/) {
    found = WHIRL_WATCH_FORCE_LATE;
  } else {
    /* the rotor follows the force */
  }
  return found;
}

/* What explains y - u - e f best: a gain of each actuator, a later force or another unbalance. 0 or a WHIRL_WATCH_ bit. */
static uint32_t whirl_force_judge(whirl_force_check *c, const whirl_params *p) {
  const bool starting = c->time < /*@n_start@*/;
  const whirl_complex e = starting ? whirl_make(R(0.0), R(0.0)) : c->eps;
  const whirl_force_fit f = whirl_fit_force(c, p->k1, e, !starting);
  uint32_t found = 0U;
  c->usual += M(fmin)(p->sample_time / /*@n_usual@*/, R(1.0)) * (f.rr - c->usual);
  c->risen = f.rr > (/*@n_risen@*/ * c->usual);
  if (c->test > R(0.0)) {
    found = whirl_force_tested(c, p, &f);
  } else if (f.rr > whirl_force_seen(p)) {
    found = whirl_force_suspect(c, p, &f, starting);
  } else {
    c->loud = R(0.0);
    c->gain_time = R(0.0);
    c->late_time = R(0.0);
    c->proof_time = R(0.0);
    c->tested = M(fmin)(c->tested + p->sample_time, /*@n_again@*/);
  }
  return found;
}

/* Until the force has been seen to act: if the rotor moves as the unbalance designed with does without it, it is let go,
   to see whether anything changes. */
static void whirl_force_prove(whirl_force_check *c, const whirl_params *p) {
  const whirl_real least = whirl_force_least(p);
  const whirl_real asked = c->xx + c->yy;
  if ((c->time >= /*@n_start@*/) && (c->test <= R(0.0)) && (c->proven <= /*@n_proof_time@*/) && (asked > least)) {
    const whirl_complex e = whirl_make(p->eps_re, p->eps_im);
    const whirl_force_fit f = whirl_fit_force(c, p->k1, e, true);
    const bool idle = (f.rr > least) && (f.by_gain < (/*@n_left@*/ * f.rr)) && (M(fabs)(f.gain_x) < /*@n_idle@*/) &&
                      (M(fabs)(f.gain_y) < /*@n_idle@*/);
    if (f.rr < (R(0.5) * asked)) {
      c->proven += p->sample_time;
    }
    c->idle = idle ? (c->idle + p->sample_time) : R(0.0);
    if ((c->idle > /*@n_confirm@*/) && (c->tested >= /*@n_again@*/)) {
      c->eps = e;
      c->suspected = WHIRL_WATCH_FORCE_LOST;
      c->known = true;
      c->before = f.rr;
      c->test = p->sample_time;
    }
  }
}

/* The unbalance that acts, while nothing else is to be explained, or while what is left stands: not what has just risen
   out of it. */
static void whirl_force_follow(whirl_force_check *c, const whirl_params *p) {
  const whirl_real slow = /*@n_slow@*/ * p->k1;
  const whirl_real size = whirl_norm(c->unbalance[2]);
  const bool starting = c->time < /*@n_start@*/;
  const bool stuck = (c->loud > /*@n_stuck@*/) && !c->risen;
  if ((c->test <= R(0.0)) && (size > (slow * slow)) && ((c->loud <= R(0.0)) || starting || stuck)) {
    const whirl_real tau = starting ? /*@n_settled@*/ : (stuck ? /*@n_relearn@*/ : /*@n_learn@*/);
    c->eps = whirl_mean(M(fmin)(p->sample_time / tau, R(1.0)), c->eps, whirl_scale(R(1.0) / size, c->now));
  }
}

/* Time left in which nothing is judged: what is delivered is not what is asked for. */
static void whirl_force_unsure(whirl_force_check *c, const whirl_params *p, whirl_complex a, bool limited) {
  const whirl_real slew = (p->slew_limit > R(0.0)) ? (p->gain * p->slew_limit) : ((p->gain * p->force_limit) / /*@n_full@*/);
  const whirl_real most = slew * p->sample_time;
  const bool slewing = (most > R(0.0)) && ((M(fabs)(a.re - c->a1.re) > most) || (M(fabs)(a.im - c->a1.im) > most));
  c->unsure = (limited || slewing) ? (/*@n_unsure@*/ + p->delay) : M(fmax)(c->unsure - p->sample_time, R(0.0));
}

/* Does the rotor follow the force? One sample: displacement, control acceleration over the interval before it and unbalance
   per metre at it; `limited`: the force asked for is at its limit. 0 or a WHIRL_WATCH_ bit. */
static uint32_t whirl_force_check_step(whirl_state *state, whirl_complex z, bool fresh, whirl_complex a,
                                       whirl_complex forcing, bool limited) {
  whirl_force_check *const c = &state->check;
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_complex u = whirl_scale(R(0.5), whirl_add(a, c->a1));
  whirl_complex later;
  const whirl_complex late = whirl_delayed(c, u, &later);
  const whirl_complex before = c->forcing1;
  uint32_t found = 0U;
  whirl_force_unsure(c, p, a, limited);
  c->changed = false;
  c->a1 = a;
  c->forcing1 = forcing;
  if (!fresh) {
    c->readings = 0;
  } else {
    if (c->readings >= 2) {
      /* Exact for a force that is held: the mean of both intervals is the second difference. */
      const whirl_complex change = whirl_add(whirl_sub(z, whirl_scale(R(2.0), c->z1)), c->z2);
      const whirl_complex second = whirl_scale(R(1.0) / (h * h), change);
      const whirl_complex v = whirl_scale(R(0.5) / h, whirl_sub(z, c->z2));
      const whirl_complex y = whirl_sub(second, whirl_acceleration(p, c->z1, v, R(1.0)));
      const whirl_complex ys = whirl_filtered(c->y, y, h);
      const whirl_complex us = whirl_filtered(c->u, u, h);
      const whirl_complex ls = whirl_filtered(c->late, late, h);
      const whirl_complex ms = whirl_filtered(c->later, later, h);
      const whirl_complex unbalance = whirl_filtered(c->unbalance, before, h);
      const whirl_complex zs = whirl_filtered(c->z, c->z1, h);
      /* When the first force begins to act is known to some ms only: its edge is no evidence, what follows is. */
      if ((c->time > R(0.0)) || (whirl_norm(u) > R(0.0))) {
        c->time = M(fmin)(c->time + h, R(1.0));
      }
      if (c->time > /*@n_edge@*/) {
        whirl_collect(c, h, ys, us, ls, ms, unbalance, zs);
        whirl_force_prove(c, p);
        found = whirl_force_judge(c, p);
        whirl_force_follow(c, p);
      }
    }
    c->z2 = c->z1;
    c->z1 = z;
    if (c->readings < 2) {
      c->readings++;
    }
  }
  return found;
}

#endif
