static void update(instance *c) { c->changed = false; }

/* The matrices hold for one sample time. */
static bool initialise(instance *c) {
  whirl_params built;
  whirl_default_params(&built);
  whirl_start(&c->state);
  return c->params.sample_time == built.sample_time;
}

/* One sample at `time`, whose forces hold for `size` seconds. Returns null, or why not, nothing changed. */
static const char *advance(instance *c, double time, double size) {
  const double h = c->params.sample_time;
  const whirl_state before = c->state;
  double forces[OUTPUTS];
  int k;
  if (!isfinite(size) || !isfinite(time)) {
    return "time or communication step is not a finite number";
  }
  for (k = 0; k < INPUTS; k++) {
    if (!isfinite(c->input[k])) {
      return "an input is not a finite number";
    }
  }
  if (fabs(size - h) > (1e-6 * h)) {
    return "the communication step must be the sample time of the controller";
  }
  if (fabs(time - c->time) > (0.5 * h)) {
    return "the step must begin where the last one ended";
  }
  whirl_step(&c->state, c->input, c->input[INPUTS - 2], c->input[INPUTS - 1], forces);
  for (k = 0; k < OUTPUTS; k++) {
    if (!isfinite(forces[k])) {
      c->state = before;
      return "the controller has no finite answer to these inputs";
    }
  }
  (void)memcpy(c->output, forces, sizeof forces);
  c->changed = false;
  c->time = time + size;
  return NULL;
}
