/* One instance: the exported C with its variables. Value references are the positions below. */
#include "/*@prefix@*/.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define TOKEN "/*@token@*/"

enum {
  TIME = 0,
/*@layout@*/
};
#define SMALL 1e-9 /* a sign argument below this is zero at an event */

typedef enum { INSTANTIATED, INITIALISING, EVENT, CONTINUOUS, STEPPING, TERMINATED } phase;

typedef struct {
  phase phase;
  bool model_exchange;
  double time;
  bool changed; /* parameters or inputs set since the last update */
  whirl_params params;
#if HAS_CONTROLLER
  whirl_state state;
  double input[INPUTS];
  double output[OUTPUTS];
  int boolean[BOOLEANS]; /* valid, saturated, held */
  int status;
#else
  double inner_step;
  double input[INPUTS + 1];
  double x[STATES];
  double rate[STATES];
  double output[OUTPUTS];
#if HAS_EVENTS
  double sign[EVENTS];
  double event[EVENTS];
#endif
#endif
} instance;

/* Address of a parameter; null when there is none such. */
static double *parameter(instance *c, unsigned int reference) {
  switch (reference) {
/*@pointers@*/
    default:
      return NULL;
  }
}

/* Address of a real variable; null when there is none such. */
static double *real_variable(instance *c, unsigned int reference) {
  if (reference == TIME) {
    return &c->time;
  }
  if (reference < FIRST_INPUT + INPUTS) {
    return &c->input[reference - FIRST_INPUT];
  }
#if HAS_PLANT
  if ((reference >= FIRST_STATE) && (reference < FIRST_STATE + STATES)) {
    return &c->x[reference - FIRST_STATE];
  }
  if ((reference >= FIRST_RATE) && (reference < FIRST_RATE + STATES)) {
    return &c->rate[reference - FIRST_RATE];
  }
#endif
#if HAS_EVENTS
  if ((reference >= FIRST_EVENT) && (reference < FIRST_EVENT + EVENTS)) {
    return &c->event[reference - FIRST_EVENT];
  }
#endif
  if ((reference >= FIRST_OUTPUT) && (reference < FIRST_OUTPUT + OUTPUTS)) {
    return &c->output[reference - FIRST_OUTPUT];
  }
  return parameter(c, reference);
}

/* Which variables may be set: inputs always, parameters too where they are tunable, start values before the run. */
static bool settable(const instance *c, unsigned int reference) {
  const bool before = (c->phase == INSTANTIATED) || (c->phase == INITIALISING);
  if ((reference >= FIRST_INPUT) && (reference < FIRST_INPUT + INPUTS)) {
    return true;
  }
#if HAS_PLANT
  if ((reference >= FIRST_STATE) && (reference < FIRST_STATE + STATES)) {
    return before;
  }
#endif
  if ((reference == /*@fixed@*/)) {
    return before;
  }
  return (reference >= FIRST_PARAMETER) && (reference < FIRST_PARAMETER + PARAMETERS);
}

/* Inputs may be no number: the step refuses them, but a displacement of a controller, which is a lost sample. */
static bool is_input(unsigned int reference) {
  return (reference >= FIRST_INPUT) && (reference < FIRST_INPUT + INPUTS);
}

static bool set_real(instance *c, unsigned int reference, double value) {
  const bool good = isfinite(value) || is_input(reference);
  double *const at = (good && settable(c, reference)) ? real_variable(c, reference) : NULL;
  if (at != NULL) {
    *at = value;
    c->changed = true;
  }
  return at != NULL;
}

static void restart(instance *c) {
  const bool model_exchange = c->model_exchange;
  memset(c, 0, sizeof *c);
  c->model_exchange = model_exchange;
  c->changed = true;
  whirl_default_params(&c->params);
#if HAS_CONTROLLER
  c->boolean[0] = 1;
#else
  c->inner_step = /*@inner@*/;
#endif
}
#if HAS_PLANT
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
#else

static void update(instance *c) { c->changed = false; }
#endif

static bool initialise(instance *c) {
#if HAS_CONTROLLER
  return whirl_init(&c->state, &c->params) == 0;
#else
  update(c);
  return c->inner_step > 0.0;
#endif
}

/* Advances by `size` seconds. Returns null, or why not. */
static const char *advance(instance *c, double size) {
#if HAS_CONTROLLER
  const double periods = size / c->params.sample_time;
  const double whole = floor(periods + 0.5);
  whirl_input in;
  const whirl_state before = c->state;
  whirl_output out = {0};
  int k;
  if (!isfinite(size) || !isfinite(c->time)) {
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
  if (c->changed && (whirl_set_params(&c->state, &c->params) != 0)) {
    return "a parameter is out of its range";
  }
  c->changed = false;
  for (k = 0; k < (int)whole; k++) {
    const double age = (double)k * c->params.sample_time; /* the angle goes on with the speed */
    in.x = c->input[0];
    in.y = c->input[1];
    in.beta = c->input[2] + (age * (c->input[3] + (0.5 * age * c->input[4])));
    in.omega = c->input[3] + (age * c->input[4]);
    in.omega_dot = c->input[4];
    in.valid = (c->boolean[0] != 0);
    c->status = (int)whirl_step(&c->state, &in, &out);
  }
  if (c->status == (int)WHIRL_NOT_FINITE) {
    c->state = before;
    return "the controller has no finite answer to these inputs";
  }
  c->output[0] = out.ux;
  c->output[1] = out.uy;
  c->output[2] = out.requested_ux;
  c->output[3] = out.requested_uy;
  c->output[4] = out.s_x;
  c->output[5] = out.s_y;
  c->output[6] = out.x;
  c->output[7] = out.y;
  c->output[8] = out.vx;
  c->output[9] = out.vy;
  c->boolean[1] = out.saturated ? 1 : 0;
  c->boolean[2] = out.held ? 1 : 0;
#else
  const double steps = ceil((size / c->inner_step) - 1e-9);
  double u[INPUTS + 1] = {0.0};
  int i;
  int k;
  if (!isfinite(size) || !isfinite(c->time)) {
    return "time or communication step is not a finite number";
  }
  if (!(size >= 0.0) || !(steps <= 1e7)) {
    return "the communication step must be positive and at most 1e7 inner steps";
  }
  for (i = 0; i < INPUTS; i++) {
    if (!isfinite(c->input[i])) {
      return "an input is not a finite number";
    }
  }
  for (k = 0; k < (int)steps; k++) {
    const double h = size / steps;
    const double age = (double)k * h;
    memcpy(u, c->input, sizeof u);
/*@aged@*/
    whirl_step(&c->params, c->time + age, c->x, u, h);
  }
#endif
  c->time += size;
#if HAS_PLANT
  {
    /* outputs belong to the end of the step: the angle there */
    const double age = size;
    double held[INPUTS + 1];
    memcpy(held, c->input, sizeof held);
    memcpy(u, c->input, sizeof u);
/*@aged@*/
    memcpy(c->input, u, sizeof u);
    update(c);
    memcpy(c->input, held, sizeof held);
    c->changed = false;
  }
#endif
  return NULL;
}
