/* Self-test of /*@prefix@*/: the right-hand side must reproduce the library's numbers. Returns 0 when it does. */
#include "/*@prefix@*/.h"

#include <math.h>
#include <stdio.h>

#define POINTS /*@points@*/
#define TOLERANCE /*@tolerance@*/ /* of the largest rate of each state */

typedef struct {
  whirl_real t;
  whirl_real x[WHIRL_STATES];
  whirl_real u[WHIRL_INPUT_SIZE];
  double dx[WHIRL_STATES];
} golden_vector;

static const golden_vector golden[POINTS] = {
/*@vectors@*/
};

int main(void) {
  whirl_params params;
  double worst = 0.0;
  int i;
  int k;
  whirl_default_params(&params);
  for (i = 0; i < WHIRL_STATES; i++) {
    double size = 0.0;
    double error = 0.0;
    for (k = 0; k < POINTS; k++) {
      whirl_real dx[WHIRL_STATES];
      double off;
      whirl_rates(&params, golden[k].t, golden[k].x, golden[k].u, dx);
      off = fabs((double)dx[i] - golden[k].dx[i]);
      error = (off > error) ? off : error;
      size = (fabs(golden[k].dx[i]) > size) ? fabs(golden[k].dx[i]) : size;
    }
    worst = ((size > 0.0) && ((error / size) > worst)) ? (error / size) : worst;
  }
  (void)printf("/*@prefix@*/: %d points, largest relative difference %.2g\n", POINTS, worst);
  return (worst <= TOLERANCE) ? 0 : 1;
}
