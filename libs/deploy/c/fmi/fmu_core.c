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

#if HAS_ROTOR
typedef struct {
  double sample_time;
} whirl_params;

static void whirl_default_params(whirl_params *params) { params->sample_time = /*@period@*/; }
#endif

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
  int integer[INTEGERS]; /* status, supervision */
  double since;          /* sample times since the last sample; 0: there was none */
  double usual;          /* the same at the sample before */
#elif HAS_ROTOR
  whirl_state state;
  double input[INPUTS]; /* readings, angle, speed */
  double output[OUTPUTS];
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
  if (reference < (FIRST_INPUT + INPUTS)) {
    return &c->input[reference - FIRST_INPUT];
  }
#if HAS_PLANT
  if ((reference >= FIRST_STATE) && (reference < (FIRST_STATE + STATES))) {
    return &c->x[reference - FIRST_STATE];
  }
  if ((reference >= FIRST_RATE) && (reference < (FIRST_RATE + STATES))) {
    return &c->rate[reference - FIRST_RATE];
  }
#endif
#if HAS_EVENTS
  if ((reference >= FIRST_EVENT) && (reference < (FIRST_EVENT + EVENTS))) {
    return &c->event[reference - FIRST_EVENT];
  }
#endif
  if ((reference >= FIRST_OUTPUT) && (reference < (FIRST_OUTPUT + OUTPUTS))) {
    return &c->output[reference - FIRST_OUTPUT];
  }
  return parameter(c, reference);
}

/* Which variables may be set until the end: inputs always, parameters where they are tunable (in model exchange at events),
   start values before the run. */
static bool settable(const instance *c, unsigned int reference) {
  const bool before = (c->phase == INSTANTIATED) || (c->phase == INITIALISING);
  if (c->phase == TERMINATED) {
    return false;
  }
  if ((reference >= FIRST_INPUT) && (reference < (FIRST_INPUT + INPUTS))) {
    return true;
  }
#if HAS_PLANT
  if ((reference >= FIRST_STATE) && (reference < (FIRST_STATE + STATES))) {
    return before;
  }
#endif
  if ((reference == /*@fixed@*/)) {
    return before;
  }
  return (c->phase != CONTINUOUS) && (reference >= FIRST_PARAMETER) && (reference < (FIRST_PARAMETER + PARAMETERS));
}

/* Inputs may be no number: the step refuses them, but a displacement of a controller, which is a lost sample. */
static bool is_input(unsigned int reference) {
  return (reference >= FIRST_INPUT) && (reference < (FIRST_INPUT + INPUTS));
}

/* Sets all of them, or none when one cannot be set. */
static bool set_reals(instance *c, const unsigned int *reference, size_t n, const double *value) {
  size_t i;
  for (i = 0; i < n; i++) {
    if ((!isfinite(value[i]) && !is_input(reference[i])) || !settable(c, reference[i])) {
      return false;
    }
  }
  for (i = 0; i < n; i++) {
    *real_variable(c, reference[i]) = value[i];
    c->changed = true;
  }
  return true;
}

static bool are_reals(instance *c, const unsigned int *reference, size_t n) {
  size_t i;
  for (i = 0; i < n; i++) {
    if (real_variable(c, reference[i]) == NULL) {
      return false;
    }
  }
  return true;
}

/* A rate, output or event indicator that is too large for a number: such a point is not to be used. */
static bool overflown(instance *c, const unsigned int *reference, size_t n) {
  size_t i;
  for (i = 0; i < n; i++) {
    if ((reference[i] >= (FIRST_INPUT + INPUTS)) && !isfinite(*real_variable(c, reference[i]))) {
      return true;
    }
  }
  return false;
}

static void restart(instance *c) {
  const bool model_exchange = c->model_exchange;
  (void)memset(c, 0, sizeof *c);
  c->model_exchange = model_exchange;
  c->changed = true;
  whirl_default_params(&c->params);
#if HAS_CONTROLLER
  c->boolean[0] = 1;
#elif HAS_PLANT
  c->inner_step = /*@inner@*/;
#endif
}

/* Sum over the bytes of a saved state, so that altered ones are refused. */
static unsigned long long checksum(const unsigned char *bytes, size_t size) {
  unsigned long long sum = 14695981039346656037ULL;
  size_t i;
  for (i = 0; i < size; i++) {
    sum = (sum ^ bytes[i]) * 1099511628211ULL;
  }
  return sum;
}
