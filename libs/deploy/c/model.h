/*@banner@*/
#ifndef WHIRL_H
#define WHIRL_H

#ifdef __cplusplus
extern "C" {
#endif

typedef /*@real@*/ whirl_real;

/* Coefficients. */
typedef struct {
/*@parameters@*/
} whirl_params;

/*@sizes@*/

/* The identified numbers. */
void whirl_default_params(whirl_params *params);

#if HAS_MAP
/* Next states of the map. */
void whirl_rates(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *next);
#else
/* Derivatives of the states at time t (s). */
void whirl_rates(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *dx);
#endif

/* Outputs. */
void whirl_outputs(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *y);
#if HAS_EVENTS

/* Arguments of the sign functions: whirl_rates jumps where one of them crosses zero. */
void whirl_events(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, whirl_real *z);

/* whirl_rates with the signs s (-1, 0, 1) given: smooth between events. */
void whirl_rates_between(const whirl_params *p, whirl_real t, const whirl_real *x, const whirl_real *u, const whirl_real *s,
                         whirl_real *dx);
#endif

#if HAS_MAP
/* One application of the map. */
#else
/* One Runge-Kutta step of order 4 from t to t + h with the inputs u of time t/*@held@*/. */
#endif
void whirl_step(const whirl_params *p, whirl_real t, whirl_real *x, const whirl_real *u, whirl_real h);

#ifdef __cplusplus
}
#endif

#endif
