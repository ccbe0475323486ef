/* Self-test of /*@prefix@*/: the step must reproduce what the library's controller answered to the same samples.
   Returns 0 when it does. */
#include "/*@prefix@*/.h"

#include <math.h>
#include <stdio.h>

#define TICKS /*@ticks@*/
#define TOLERANCE /*@tolerance@*/ /* of the largest force and of the largest velocity */

typedef struct {
  whirl_real x, y, beta, omega, omega_dot;
  int valid;
  int status;
  double ux, uy, vx, vy;
} golden_vector;

static const golden_vector golden[TICKS] = {
/*@vectors@*/
};

static double largest(double a, double b) { return (fabs(b) > a) ? fabs(b) : a; }

int main(void) {
  whirl_params params;
  whirl_state state;
  whirl_state second;
  double force = 0.0;
  double velocity = 0.0;
  double force_error = 0.0;
  double velocity_error = 0.0;
  int wrong_status = 0;
  int k;

  whirl_default_params(&params);
  if ((whirl_init(&state, &params) != 0) || (whirl_init(&second, &params) != 0)) {
    (void)printf("/*@prefix@*/: default parameters refused\n");
    return 1;
  }
  for (k = 0; k < TICKS; k++) {
    const golden_vector *const g = &golden[k];
    whirl_input in;
    whirl_output out;
    whirl_output other;
    in.x = g->x;
    in.y = g->y;
    in.beta = g->beta;
    in.omega = g->omega;
    in.omega_dot = g->omega_dot;
    in.valid = (g->valid != 0);
    wrong_status += ((int)whirl_step(&state, &in, &out) != g->status) ? 1 : 0;
    /* a second instance in between, on other samples: nothing is shared */
    in.x = -in.x;
    (void)whirl_step(&second, &in, &other);
    force = largest(largest(force, g->ux), g->uy);
    velocity = largest(largest(velocity, g->vx), g->vy);
    force_error = largest(largest(force_error, (double)out.ux - g->ux), (double)out.uy - g->uy);
    velocity_error = largest(largest(velocity_error, (double)out.vx - g->vx), (double)out.vy - g->vy);
  }
  (void)printf("/*@prefix@*/: %d samples, largest force %.3g N off by %.2g, velocity %.3g m/s off by %.2g, state %u bytes\n",
               TICKS, force, force_error, velocity, velocity_error, (unsigned)sizeof state);
  return ((wrong_status == 0) && (force_error <= (TOLERANCE * force)) && (velocity_error <= (TOLERANCE * velocity))) ? 0 : 1;
}
