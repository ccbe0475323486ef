#if HAS_EVENTS

/* Signs at an event: frozen until the next. */
static void take_signs(instance *c) {
  int i;
  whirl_events(&c->params, c->time, c->x, c->input, c->event);
  for (i = 0; i < EVENTS; i++) {
    c->sign[i] = (fabs(c->event[i]) < SMALL) ? 0.0 : ((c->event[i] > 0.0) ? 1.0 : -1.0);
  }
}
#endif

/* Rates, outputs and event indicators at the present time, states and inputs. */
static void update(instance *c) {
#if HAS_EVENTS
  int i;
  if (c->phase != CONTINUOUS) {
    take_signs(c);
  }
  whirl_events(&c->params, c->time, c->x, c->input, c->event);
  for (i = 0; i < EVENTS; i++) {
    if (c->sign[i] == 0.0) {
      c->event[i] = (2.0 * SMALL) - fabs(c->event[i]); /* at rest: an event when it leaves to either side */
    }
  }
  whirl_rates_between(&c->params, c->time, c->x, c->input, c->sign, c->rate);
#else
  whirl_rates(&c->params, c->time, c->x, c->input, c->rate);
#endif
  whirl_outputs(&c->params, c->time, c->x, c->input, c->output);
  c->changed = false;
}

static bool initialise(instance *c) {
  update(c);
  return (c->inner_step >= 1e-7) && (c->inner_step <= 1.0);
}

/* Change of the rates and of the outputs along changes dx of the states and du of the inputs. */
static void along(const instance *c, const double *dx, const double *du, double *rate, double *output) {
  const whirl_params *const p = &c->params;
  const double *const x = c->x;
  const double *const u = c->input;
  const double t = c->time;
#if HAS_EVENTS
  const double *const s = c->sign;
#endif
/*@along@*/
}

/* Directional derivative of rates and outputs (`unknown`) along `seed` of states and inputs (`known`). Null, or why not. */
static const char *directional(instance *c, const unsigned int *unknown, size_t n, const unsigned int *known, size_t m,
                               const double *seed, double *value) {
  double dx[STATES] = {0};
  double du[INPUTS + 1] = {0};
  double rate[STATES];
  double output[OUTPUTS];
  size_t i;
  for (i = 0; i < m; i++) {
    if ((known[i] >= FIRST_STATE) && (known[i] < (FIRST_STATE + STATES))) {
      dx[known[i] - FIRST_STATE] += seed[i];
    } else if (is_input(known[i])) {
      du[known[i] - FIRST_INPUT] += seed[i];
    } else {
      return "a directional derivative is along states and inputs";
    }
  }
  if (c->changed && (c->phase != CONTINUOUS)) {
    update(c);
    c->changed = true;
  }
  along(c, dx, du, rate, output);
  for (i = 0; i < n; i++) {
    if ((unknown[i] >= FIRST_RATE) && (unknown[i] < (FIRST_RATE + STATES))) {
      value[i] = rate[unknown[i] - FIRST_RATE];
    } else if ((unknown[i] >= FIRST_OUTPUT) && (unknown[i] < (FIRST_OUTPUT + OUTPUTS))) {
      value[i] = output[unknown[i] - FIRST_OUTPUT];
    } else {
      return "a directional derivative is that of rates and outputs";
    }
  }
  return NULL;
}

/* Advances from `time` by `size` seconds. Returns null, or why not, nothing changed. */
static const char *advance(instance *c, double time, double size) {
  const double steps = ceil((size / c->inner_step) - 1e-9);
  double u[INPUTS + 1] = {0};
  double start[STATES];
  double held[INPUTS + 1];
  double age;
  int i;
  int k;
  if (!isfinite(size) || !isfinite(time)) {
    return "time or communication step is not a finite number";
  }
  if (!(size >= 0.0) || !(steps <= 1e7)) {
    return "the communication step must be positive and at most 1e7 inner steps";
  }
  if (fabs(time - c->time) > ((1e-6 * size) + (1e-9 * fabs(time)))) {
    return "the time is not the end of the last step";
  }
  for (i = 0; i < INPUTS; i++) {
    if (!isfinite(c->input[i])) {
      return "an input is not a finite number";
    }
  }
  (void)memcpy(start, c->x, sizeof start);
  (void)memcpy(held, c->input, sizeof held);
  for (k = 0; k < (int)steps; k++) {
    const double h = size / steps;
    age = (double)k * h;
    (void)memcpy(u, c->input, sizeof u);
/*@aged@*/
    whirl_step(&c->params, time + age, c->x, u, h);
  }
  for (i = 0; i < STATES; i++) {
    if (!isfinite(c->x[i])) {
      (void)memcpy(c->x, start, sizeof start);
      return "the motion grows beyond every number";
    }
  }
  c->time = time + size;
  /* outputs belong to the end of the step: the angle there */
  age = size;
  (void)memcpy(u, c->input, sizeof u);
/*@aged@*/
  (void)memcpy(c->input, u, sizeof u);
  update(c);
  (void)memcpy(c->input, held, sizeof held);
  c->changed = false;
  return NULL;
}
