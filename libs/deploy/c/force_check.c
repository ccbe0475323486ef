#if HAS_SUPERVISION

static void whirl_check_reset(whirl_state *state) {
  whirl_force_check *const c = &state->check;
  const whirl_params *const p = &state->params;
  const whirl_complex none = whirl_make(R(0.0), R(0.0));
  const whirl_real samples = M(fmin)(M(floor)((R(1e-3) / p->sample_time) + R(0.5)), R(1e6));
  const whirl_real block = M(fmax)(R(1.0), samples);
  const whirl_real blocks = M(floor)((R(8e-3) / (block * p->sample_time)) + R(0.5));
  int32_t i;
  c->samples = (int32_t)block;
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
  for (i = 0; i < WHIRL_BLOCKS; i++) {
    c->ring[i] = none;
  }
  for (i = 0; i < 3; i++) {
    c->y[i] = none;
    c->u[i] = none;
    c->late[i] = none;
    c->unbalance[i] = none;
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
  c->time = R(0.0);
  c->loud = R(0.0);
  c->gain_time = R(0.0);
  c->late_time = R(0.0);
  c->test = R(0.0);
  c->tested = R(0.5);
  c->before = R(0.0);
  c->suspected = 0U;
  c->changed = false;
  c->usual = R(0.0);
  c->risen = false;
  c->proven = R(0.0);
  c->idle = R(0.0);
}

static whirl_real whirl_along(whirl_complex a, whirl_complex b) { return (a.re * b.re) + (a.im * b.im); }

/* Three poles of 600 1/s. */
static whirl_complex whirl_filtered(whirl_complex filter[3], whirl_complex in, whirl_real h) {
  const whirl_real ph = R(600.0) * h;
  const whirl_real share = ph / (R(1.0) + ph);
  int32_t i;
  for (i = 0; i < 3; i++) {
    filter[i] = whirl_add(filter[i], whirl_scale(share, whirl_sub((i == 0) ? in : filter[i - 1], filter[i])));
  }
  return filter[2];
}

/* u as it was about 8 ms ago, in blocks of about a millisecond. */
static whirl_complex whirl_delayed(whirl_force_check *c, whirl_complex u) {
  const whirl_complex old = c->ring[c->at];
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

/* Weighted means of products over the last 8 ms. */
static void whirl_collect(whirl_force_check *c, whirl_real h, whirl_complex y, whirl_complex u, whirl_complex late,
                          whirl_complex unbalance) {
  const whirl_real w = M(fmin)(h / ((c->test > R(0.0)) ? R(3e-3) : R(8e-3)), R(1.0));
  const whirl_complex d = whirl_sub(y, u);
  const whirl_complex back = whirl_conj(unbalance);
  const whirl_complex l = whirl_sub(late, u);
  c->now = whirl_mul(d, back);
  c->ff += w * (whirl_norm(unbalance) - c->ff);
  c->fd = whirl_mean(w, c->fd, c->now);
  c->fx = whirl_mean(w, c->fx, whirl_scale(-u.re, back));
  c->fy = whirl_mean(w, c->fy, whirl_mul(whirl_make(R(0.0), -u.im), back));
  c->fl = whirl_mean(w, c->fl, whirl_mul(l, back));
  c->dd += w * (whirl_norm(d) - c->dd);
  c->xx += w * ((u.re * u.re) - c->xx);
  c->yy += w * ((u.im * u.im) - c->yy);
  c->xd += w * ((-u.re * d.re) - c->xd);
  c->yd += w * ((-u.im * d.im) - c->yd);
  c->ll += w * (whirl_norm(l) - c->ll);
  c->ld += w * (whirl_along(l, d) - c->ld);
}

/* Without force, or nearly: soon a wrong force or another unbalance alone explains what is left. At the end, what is left
   is no fault of the force. 0 or the bit that was suspected. */
static uint32_t whirl_force_tested(whirl_force_check *c, whirl_real h, whirl_real rr, whirl_complex fr, whirl_real by_gain,
                                   whirl_real changed) {
  uint32_t found = 0U;
  bool told;
  c->test += h;
  told = (c->test > R(6e-3)) && (M(fmin)(by_gain, changed) < (R(0.3) * M(fmax)(by_gain, changed)));
  if (told || (c->test >= R(16e-3))) {
    const bool force = told ? (by_gain < changed) : (rr < (R(0.3) * c->before));
    c->test = R(0.0);
    c->tested = R(0.0);
    c->loud = R(0.0);
    c->gain_time = R(0.0);
    c->late_time = R(0.0);
    if (force) {
      found = c->suspected;
    } else {
      c->eps = whirl_add(c->eps, whirl_scale(R(1.0) / (c->ff + R(1e-9)), fr));
      c->changed = true;
    }
  }
  return found;
}

/* What explains y - u - e f best: a gain of each actuator, a later force or another unbalance. 0 or a WHIRL_WATCH_ bit. */
static uint32_t whirl_force_judge(whirl_force_check *c, whirl_real h, whirl_real threshold) {
  const whirl_real least = R(1e-9);
  const bool starting = c->time < R(0.15);
  const whirl_real ff = c->ff + least;
  const whirl_real per = starting ? (R(1.0) / ff) : R(0.0);
  const whirl_complex e = starting ? whirl_make(R(0.0), R(0.0)) : c->eps;
  const whirl_complex fr = whirl_sub(c->fd, whirl_scale(c->ff, e));
  const whirl_real rr = (c->dd - (R(2.0) * whirl_along(e, c->fd)) + (whirl_norm(e) * c->ff)) - (per * whirl_norm(fr));
  const whirl_real changed = rr - (starting ? R(0.0) : (whirl_norm(fr) / ff));
  const whirl_real xr = (c->xd - whirl_along(c->fx, e)) - (per * whirl_along(c->fx, fr));
  const whirl_real yr = (c->yd - whirl_along(c->fy, e)) - (per * whirl_along(c->fy, fr));
  const whirl_real lr = (c->ld - whirl_along(c->fl, e)) - (per * whirl_along(c->fl, fr));
  const whirl_real xx = (c->xx - (per * whirl_norm(c->fx))) + least;
  const whirl_real yy = (c->yy - (per * whirl_norm(c->fy))) + least;
  const whirl_real xy = -per * whirl_along(c->fx, c->fy);
  const whirl_real det = ((xx * yy) - (xy * xy)) + (least * least);
  const whirl_real px = ((xr * yy) - (yr * xy)) / det;
  const whirl_real py = ((yr * xx) - (xr * xy)) / det;
  const whirl_real share = lr / ((c->ll - (per * whirl_norm(c->fl))) + least);
  const whirl_real low = R(1.0) - M(fmax)(px, py);
  const whirl_real high = R(1.0) - M(fmin)(px, py);
  const whirl_real by_gain = rr - (px * xr) - (py * yr);
  const whirl_real by_delay = rr - (share * lr);
  const bool reversed = low < R(-0.4);
  const whirl_real better = reversed ? R(1.0) : R(0.7);
  const bool loud = rr > (threshold * threshold);
  const bool gain = loud && (by_gain < (R(0.2) * rr)) && (by_gain < (better * changed)) && (by_gain < by_delay) &&
                    (low < R(0.35)) && (low > R(-1.6)) && (high < R(1.4));
  const bool late = loud && (by_delay < (R(0.2) * rr)) && (by_delay < (R(0.7) * changed)) && (by_delay < by_gain) &&
                    (share > R(0.6)) && (share < R(1.6));
  const bool large = reversed && (rr > (R(4.0) * threshold * threshold));
  /* an unbalance that doubles under a force that cancels it looks like a lost actuator at first */
  const bool other = (changed < (R(0.25) * rr)) && (low > R(-0.4));
  const whirl_real confirm = starting ? R(10e-3) : (large ? R(2e-3) : (other ? R(17e-3) : R(8e-3)));
  uint32_t found = 0U;
  c->usual += M(fmin)(h / R(0.3), R(1.0)) * (rr - c->usual);
  c->risen = rr > (R(4.0) * c->usual);
  if (c->test > R(0.0)) {
    if (reversed) {
      c->suspected = WHIRL_WATCH_FORCE_REVERSED;
    }
    found = whirl_force_tested(c, h, rr, fr, by_gain, changed);
  } else {
    const bool fair = (c->tested + h) >= R(0.5); /* the last test is long ago */
    const bool open = !starting && fair && (changed < (R(0.5) * rr));
    const bool early = open && (rr > (R(4.0) * threshold * threshold)) && (by_gain < (R(0.3) * rr)) &&
                       (by_gain < changed) && (by_gain < by_delay) && (low < R(0.1)) && (low > R(-1.6)) &&
                       (high < R(1.4));
    const uint32_t force = reversed ? WHIRL_WATCH_FORCE_REVERSED : WHIRL_WATCH_FORCE_LOST;
    c->tested = M(fmin)(c->tested + h, R(0.5));
    c->loud = loud ? (c->loud + h) : R(0.0);
    c->gain_time = gain ? (c->gain_time + h) : R(0.0);
    c->late_time = late ? (c->late_time + h) : R(0.0);
    if (early || ((c->gain_time > confirm) && open && (by_gain >= (R(0.25) * changed)))) {
      c->suspected = force;
      c->before = rr;
      c->test = h;
    } else if (c->gain_time > confirm) {
      found = force;
    } else if (c->late_time > R(8e-3)) {
      found = WHIRL_WATCH_FORCE_LATE;
    } else {
      /* the rotor follows the force */
    }
  }
  return found;
}

/* Until the force has been seen to act: if the rotor moves as the unbalance designed with does without it, it is let go,
   to see whether anything changes. */
static void whirl_force_prove(whirl_force_check *c, const whirl_params *p, whirl_real threshold) {
  const whirl_real loud = threshold * threshold;
  const whirl_real asked = c->xx + c->yy;
  if ((c->time >= R(0.15)) && (c->test <= R(0.0)) && (c->proven <= R(1.0)) && (asked > loud)) {
    const whirl_complex e = whirl_make(p->eps_re, p->eps_im);
    const whirl_real rr = c->dd - (R(2.0) * whirl_along(e, c->fd)) + (whirl_norm(e) * c->ff);
    const whirl_real xr = c->xd - whirl_along(c->fx, e);
    const whirl_real yr = c->yd - whirl_along(c->fy, e);
    const whirl_real px = xr / (c->xx + R(1e-9));
    const whirl_real py = yr / (c->yy + R(1e-9));
    const bool explained = (rr - (px * xr) - (py * yr)) < (R(0.2) * rr);
    const bool idle = (rr > loud) && explained && (M(fabs)(R(1.0) - px) < R(0.25)) && (M(fabs)(R(1.0) - py) < R(0.25));
    if (rr < (R(0.5) * asked)) {
      c->proven += p->sample_time;
    }
    c->idle = idle ? (c->idle + p->sample_time) : R(0.0);
    if ((c->idle > R(8e-3)) && (c->tested >= R(0.5))) {
      c->eps = e;
      c->suspected = WHIRL_WATCH_FORCE_LOST;
      c->before = rr;
      c->test = p->sample_time;
    }
  }
}

/* The unbalance that acts, while nothing else is to be explained, or while what is left stands: not what has just risen
   out of it. */
static void whirl_force_follow(whirl_force_check *c, const whirl_params *p) {
  const whirl_real slow = R(0.02) * p->k1;
  const whirl_real size = whirl_norm(c->unbalance[2]);
  const bool starting = c->time < R(0.15);
  const bool stuck = (c->loud > R(0.15)) && !c->risen;
  if ((c->test <= R(0.0)) && (size > (slow * slow)) && ((c->loud <= R(0.0)) || starting || stuck)) {
    const whirl_real tau = starting ? R(0.02) : (stuck ? R(0.03) : R(0.1));
    c->eps = whirl_mean(M(fmin)(p->sample_time / tau, R(1.0)), c->eps, whirl_scale(R(1.0) / size, c->now));
  }
}

/* Does the rotor follow the force? One sample: displacement, control acceleration over the interval before it and unbalance
   per metre at it. 0 or a WHIRL_WATCH_ bit. */
static uint32_t whirl_force_check_step(whirl_state *state, whirl_complex z, bool fresh, whirl_complex a,
                                       whirl_complex forcing) {
  whirl_force_check *const c = &state->check;
  const whirl_params *const p = &state->params;
  const whirl_real h = p->sample_time;
  const whirl_complex u = whirl_scale(R(0.5), whirl_add(a, c->a1));
  const whirl_complex late = whirl_delayed(c, u);
  const whirl_complex before = c->forcing1;
  uint32_t found = 0U;
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
      const whirl_complex unbalance = whirl_filtered(c->unbalance, before, h);
      /* When the first force begins to act is known to some ms only: its edge is no evidence, what follows is. */
      if ((c->time > R(0.0)) || (whirl_norm(u) > R(0.0))) {
        c->time = M(fmin)(c->time + h, R(1.0));
      }
      if (c->time > R(20e-3)) {
        whirl_collect(c, h, ys, us, ls, unbalance);
        whirl_force_prove(c, p, R(0.7) * p->watch_level * p->k1);
        found = whirl_force_judge(c, h, R(0.7) * p->watch_level * p->k1);
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
