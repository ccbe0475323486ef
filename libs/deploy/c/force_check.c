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

static whirl_real whirl_along(whirl_complex a, whirl_complex b) { return (a.re * b.re) + (a.im * b.im); }

/* Three poles. */
static whirl_complex whirl_filtered(whirl_complex filter[3], whirl_complex in, whirl_real h) {
  const whirl_real ph = /*@n_pole@*/ * h;
  const whirl_real share = ph / (R(1.0) + ph);
  int32_t i;
  for (i = 0; i < 3; i++) {
    filter[i] = whirl_add(filter[i], whirl_scale(share, whirl_sub((i == 0) ? in : filter[i - 1], filter[i])));
  }
  return filter[2];
}

/* u as it was about 8 ms and 12 ms (`later`) ago, in blocks of about a millisecond. */
static whirl_complex whirl_delayed(whirl_force_check *c, whirl_complex u, whirl_complex *later) {
  const whirl_complex old = c->ring[((c->at + c->blocks) - c->first) % c->blocks];
  *later = c->ring[c->at];
  c->sum = whirl_add(c->sum, u);
  c->summed++;
  if (c->summed >= c->samples) {
    c->ring[c->at] = whirl_scale(R(1.0) / (whirl_real)c->samples, c->sum);
    c->at = (c->at + 1) % c->blocks;
    c->sum = whirl_make(R(0.0), R(0.0));
    c->summed = 0;
  }
  return old;
}

static whirl_complex whirl_mean(whirl_real w, whirl_complex sum, whirl_complex value) {
  return whirl_add(sum, whirl_scale(w, whirl_sub(value, sum)));
}

/* (m/s^2)^2: of a residual that is seen, of hysteresis, the larger. */
static whirl_real whirl_force_seen(const whirl_params *p) {
  const whirl_real seen = /*@n_share@*/ * p->watch_level * p->k1;
  return seen * seen;
}
static whirl_real whirl_force_play(const whirl_params *p) {
  const whirl_real width = p->gain * ((p->hysteresis > R(0.0)) ? (R(0.5) * p->hysteresis) : (/*@n_play@*/ * p->force_limit));
  return width * width;
}
static whirl_real whirl_force_least(const whirl_params *p) { return M(fmax)(whirl_force_seen(p), whirl_force_play(p)); }

/* Weighted means of products over the last 8 ms. */
static void whirl_collect(whirl_force_check *c, whirl_real h, whirl_complex y, whirl_complex u, whirl_complex late,
                          whirl_complex later, whirl_complex unbalance, whirl_complex z) {
  const whirl_real w = M(fmin)(h / (((c->test > R(0.0)) && c->known) ? /*@n_known_window@*/ : /*@n_window@*/), R(1.0));
  const whirl_complex d = whirl_sub(y, u);
  const whirl_complex back = whirl_conj(unbalance);
  const whirl_complex other = whirl_conj(z);
  const whirl_complex l = whirl_sub(late, u);
  const whirl_complex m = whirl_sub(later, u);
  const whirl_complex uy = whirl_make(R(0.0), -u.im);
  c->now = whirl_mul(d, back);
  c->ff += w * (whirl_norm(unbalance) - c->ff);
  c->fd = whirl_mean(w, c->fd, c->now);
  c->fx = whirl_mean(w, c->fx, whirl_scale(-u.re, back));
  c->fy = whirl_mean(w, c->fy, whirl_mul(uy, back));
  c->fl = whirl_mean(w, c->fl, whirl_mul(l, back));
  c->fm = whirl_mean(w, c->fm, whirl_mul(m, back));
  c->fz = whirl_mean(w, c->fz, whirl_mul(z, back));
  c->dd += w * (whirl_norm(d) - c->dd);
  c->xx += w * ((u.re * u.re) - c->xx);
  c->yy += w * ((u.im * u.im) - c->yy);
  c->xd += w * ((-u.re * d.re) - c->xd);
  c->yd += w * ((-u.im * d.im) - c->yd);
  c->ll += w * (whirl_norm(l) - c->ll);
  c->mm += w * (whirl_norm(m) - c->mm);
  c->md += w * (whirl_along(m, d) - c->md);
  c->ld += w * (whirl_along(l, d) - c->ld);
  c->zz += w * (whirl_norm(z) - c->zz);
  c->zd = whirl_mean(w, c->zd, whirl_mul(d, other));
  c->zx = whirl_mean(w, c->zx, whirl_scale(-u.re, other));
  c->zy = whirl_mean(w, c->zy, whirl_mul(uy, other));
  c->zl = whirl_mean(w, c->zl, whirl_mul(l, other));
  c->zm = whirl_mean(w, c->zm, whirl_mul(m, other));
}

/* Least squares of r with the unbalance e, or with any: then each product loses what lies along the unbalance. What an
   error of the stiffness explains is taken out first. */
static whirl_force_fit whirl_fit_force(const whirl_force_check *c, whirl_real k1, whirl_complex e, bool known) {
  const whirl_real least = R(1e-9);
  const whirl_real model = /*@n_model@*/ * k1;
  const whirl_real ff = c->ff + least;
  const whirl_real per = known ? R(0.0) : (R(1.0) / ff);
  const whirl_complex fr = whirl_sub(c->fd, whirl_scale(c->ff, e));
  const whirl_complex back = whirl_conj(c->fz);
  const whirl_complex zr = whirl_sub(whirl_sub(c->zd, whirl_mul(back, e)), whirl_scale(per, whirl_mul(back, fr)));
  const whirl_real zz = (c->zz - (per * whirl_norm(c->fz))) + R(1e-30);
  /* of squares: rounding may leave a zz below zero beside a zr of zero */
  const whirl_real square = whirl_norm(zr);
  const whirl_real most = model * zz;
  const whirl_complex q = whirl_scale((square > (most * most)) ? (model / M(sqrt)(square)) : (R(1.0) / zz), zr);
  const whirl_complex zx = whirl_sub(c->zx, whirl_scale(per, whirl_mul(back, c->fx)));
  const whirl_complex zy = whirl_sub(c->zy, whirl_scale(per, whirl_mul(back, c->fy)));
  const whirl_complex zl = whirl_sub(c->zl, whirl_scale(per, whirl_mul(back, c->fl)));
  const whirl_complex zm = whirl_sub(c->zm, whirl_scale(per, whirl_mul(back, c->fm)));
  const whirl_complex fq = whirl_sub(fr, whirl_mul(q, c->fz));
  const whirl_real xr = ((c->xd - whirl_along(c->fx, e)) - (per * whirl_along(c->fx, fr))) - whirl_along(zx, q);
  const whirl_real yr = ((c->yd - whirl_along(c->fy, e)) - (per * whirl_along(c->fy, fr))) - whirl_along(zy, q);
  const whirl_real lr = ((c->ld - whirl_along(c->fl, e)) - (per * whirl_along(c->fl, fr))) - whirl_along(zl, q);
  const whirl_real mr = ((c->md - whirl_along(c->fm, e)) - (per * whirl_along(c->fm, fr))) - whirl_along(zm, q);
  const whirl_real first = lr / ((c->ll - (per * whirl_norm(c->fl))) + least);
  const whirl_real second = mr / ((c->mm - (per * whirl_norm(c->fm))) + least);
  const bool later = known && ((second * mr) > (first * lr));
  const whirl_real xx = (c->xx - (per * whirl_norm(c->fx))) + least;
  const whirl_real yy = (c->yy - (per * whirl_norm(c->fy))) + least;
  const whirl_real xy = -per * whirl_along(c->fx, c->fy);
  const whirl_real det = ((xx * yy) - (xy * xy)) + (least * least);
  const whirl_real px = ((xr * yy) - (yr * xy)) / det;
  const whirl_real py = ((yr * xx) - (xr * xy)) / det;
  const whirl_real far_delay = second * /*@n_later@*/;
  const whirl_real near_delay = first * /*@n_late@*/;
  const whirl_real far_left = second * mr;
  const whirl_real near_left = first * lr;
  whirl_force_fit f;
  f.rr = ((((c->dd - (R(2.0) * whirl_along(e, c->fd))) + (whirl_norm(e) * c->ff)) - (per * whirl_norm(fr))) -
          (R(2.0) * whirl_along(q, zr))) +
         (whirl_norm(q) * zz);
  f.changed = f.rr - (known ? (whirl_norm(fq) / ff) : R(0.0));
  f.share = later ? second : first;
  f.delay = later ? far_delay : near_delay;
  f.gain_x = R(1.0) - px;
  f.gain_y = R(1.0) - py;
  f.low = M(fmin)(f.gain_x, f.gain_y);
  f.high = M(fmax)(f.gain_x, f.gain_y);
  f.sure_x = det / yy;
  f.sure_y = det / xx;
  f.by_gain = (f.rr - (px * xr)) - (py * yr);
  f.by_delay = f.rr - (later ? far_left : near_left);
  f.eps = whirl_add(e, whirl_scale(R(1.0) / ff, whirl_sub(whirl_sub(fq, whirl_scale(px, c->fx)),
                                                          whirl_scale(py, c->fy))));
  return f;
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
