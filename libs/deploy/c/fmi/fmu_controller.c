
static void update(instance *c) { c->changed = false; }

static bool initialise(instance *c) {
  c->since = 0.0;
  c->usual = 0.0;
  return whirl_init(&c->state, &c->params) == 0;
}

static void take_answer(instance *c, const whirl_output *out, whirl_status status) {
  c->output[0] = out->ux;
  c->output[1] = out->uy;
  c->output[2] = out->requested_ux;
  c->output[3] = out->requested_uy;
  c->output[4] = out->s_x;
  c->output[5] = out->s_y;
  c->output[6] = out->x;
  c->output[7] = out->y;
  c->output[8] = out->vx;
  c->output[9] = out->vy;
  c->boolean[1] = out->saturated ? 1 : 0;
  c->boolean[2] = out->held ? 1 : 0;
  c->integer[0] = (int)status;
#if HAS_SUPERVISION
  c->integer[1] = (int)out->supervision;
#endif
}

/* One sample at `time`, whose outputs hold for `size` seconds. Sample times that were left out since the last sample, by a
   communication step of several of them or because time went on without a step, are filled with the motion in between; the
   force after more of them than usual is bounded. Returns null, or why not, nothing changed. */
static const char *advance(instance *c, double time, double size) {
  const double h = c->params.sample_time;
  const double periods = size / h;
  const double whole = floor(periods + 0.5);
  const double late = floor(((time - c->time) / h) + 0.5);
  const double missed = (c->since > 0.0) ? fmin((c->since + late) - 1.0, 1e6) : 0.0;
  const whirl_state before = c->state;
  whirl_input in;
  whirl_output out;
  whirl_status status;
  int k;
  if (!isfinite(size) || !isfinite(time)) {
    return "time or communication step is not a finite number";
  }
  for (k = 2; k < INPUTS; k++) {
    if (!isfinite(c->input[k])) {
      return "an input is not a finite number";
    }
  }
  if (!(whole >= 1.0) || (whole > 1e6) || (fabs(periods - whole) > 1e-6)) {
    return "the communication step must be a multiple of the sample time of the controller";
  }
  if (late < 0.0) {
    return "the time lies before the end of the last step";
  }
  if (c->changed && (whirl_set_params(&c->state, &c->params) != 0)) {
    return "a parameter is out of its range";
  }
  in.x = c->input[0];
  in.y = c->input[1];
  in.beta = c->input[2];
  in.omega = c->input[3];
  in.omega_dot = c->input[4];
  in.valid = (c->boolean[0] != 0);
  if (missed > c->usual) {
    status = whirl_step_after(&c->state, &in, (int32_t)missed, &out);
  } else {
    whirl_fill(&c->state, &in, (int32_t)missed);
    status = whirl_step(&c->state, &in, &out);
  }
  if (status == WHIRL_NOT_FINITE) {
    c->state = before;
    return "the controller has no finite answer to these inputs";
  }
  take_answer(c, &out, status);
  c->changed = false;
  c->usual = missed;
  c->since = whole;
  c->time = time + size;
  return NULL;
}
