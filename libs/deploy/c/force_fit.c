/* Gains and delay of the force by least squares over the last 8 ms: what force_check.c judges. */
#if HAS_SUPERVISION

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

#endif
