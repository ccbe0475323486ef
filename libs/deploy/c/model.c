/*@banner@*/
#include "/*@prefix@*/.h"

#include <math.h>

void whirl_default_params(whirl_params *params) {
/*@defaults@*/
}

#if HAS_EVENTS
void whirl_rates_between(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, const whirl_real *s,
                         whirl_real *dx) {
/*@frozen@*/
}

void whirl_events(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *z) {
/*@events@*/
}

#endif
void whirl_rates(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *dx) {
/*@rates@*/
}

void whirl_outputs(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *y) {
/*@outputs@*/
}

#if HAS_MAP
void whirl_step(const whirl_params *p, whirl_real t, whirl_real *x, const whirl_real *u, whirl_real h) {
  whirl_real next[WHIRL_STATES];
  int i;
  (void)h;
  whirl_rates(p, t, x, u, next);
  for (i = 0; i < WHIRL_STATES; i++) {
    x[i] = next[i];
  }
}
#else
/* Inputs at the time tau after those given. */
static void whirl_inputs_after(const whirl_real *u, whirl_real tau, whirl_real *later) {
/*@later@*/
}

void whirl_step(const whirl_params *p, whirl_real t, whirl_real *x, const whirl_real *u, whirl_real h) {
  whirl_real v[WHIRL_INPUT_SIZE];
  whirl_real k1[WHIRL_STATES];
  whirl_real k2[WHIRL_STATES];
  whirl_real k3[WHIRL_STATES];
  whirl_real k4[WHIRL_STATES];
  whirl_real at[WHIRL_STATES];
  int i;
  whirl_inputs_after(u, R(0.0), v);
  whirl_rates(p, t, x, v, k1);
  for (i = 0; i < WHIRL_STATES; i++) {
    at[i] = x[i] + (R(0.5) * h * k1[i]);
  }
  whirl_inputs_after(u, R(0.5) * h, v);
  whirl_rates(p, t + (R(0.5) * h), at, v, k2);
  for (i = 0; i < WHIRL_STATES; i++) {
    at[i] = x[i] + (R(0.5) * h * k2[i]);
  }
  whirl_rates(p, t + (R(0.5) * h), at, v, k3);
  for (i = 0; i < WHIRL_STATES; i++) {
    at[i] = x[i] + (h * k3[i]);
  }
  whirl_inputs_after(u, h, v);
  whirl_rates(p, t + h, at, v, k4);
  for (i = 0; i < WHIRL_STATES; i++) {
    x[i] += (h / R(6.0)) * (k1[i] + (R(2.0) * k2[i]) + (R(2.0) * k3[i]) + k4[i]);
  }
}
#endif
