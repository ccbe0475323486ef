/*@banner@*/
#ifndef WHIRL_H
#define WHIRL_H

#include <stdbool.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef /*@real@*/ whirl_real;

/* Longest loop delay in samples that the force history holds. */
#define WHIRL_MAX_DELAY 16
#define WHIRL_HISTORY (WHIRL_MAX_DELAY + 3)
#define WHIRL_PARAMETERS /*@parameter_count@*/
/*@law_constants@*/

/* Numbers of the controller. Change them before whirl_init, or later through whirl_set_params. The number in front is what
   both return when that field is out of its range. */
typedef struct {
/*@parameters@*/
} whirl_params;

/* One sample. */
typedef struct {
  whirl_real x;         /* m, measured displacement of the disk centre */
  whirl_real y;         /* m */
  whirl_real beta;      /* rad, rotor angle at the tick/*@angle@*/ */
  whirl_real omega;     /* rad/s, rotor speed */
  whirl_real omega_dot; /* rad/s^2, rotor acceleration */
  bool valid;           /* false: the displacement sample is lost */
} whirl_input;

typedef struct {
  whirl_real ux;           /* N, force to apply, inside the limit; 0 unless the step returned WHIRL_OK */
  whirl_real uy;           /* N */
  whirl_real requested_ux; /* N, before the limit */
  whirl_real requested_uy; /* N */
  whirl_real s_x;          /* m/s, sliding variable; 0 for laws without one */
  whirl_real s_y;          /* m/s */
  whirl_real x;            /* m, estimate at the time of the sample */
  whirl_real y;            /* m */
  whirl_real vx;           /* m/s */
  whirl_real vy;           /* m/s */
  bool saturated;          /* the force is at its limit or changes as fast as it may */
  bool held;               /* the sample was lost or not plausible, the last good one held */
#if HAS_SUPERVISION
  uint32_t supervision;    /* status word: WHIRL_WATCH_ bits, 0 while nothing is wrong */
#endif
#if HAS_REIDENTIFY
  whirl_real differs[3];    /* shares by which stiffness, damping and gain of the actuators differ from the parameters */
  whirl_real differs_sd[3]; /* standard deviations */
  whirl_real corrected[3];  /* shares that the force is corrected for */
  uint32_t reidentified;    /* status word: WHIRL_REID_ bits */
#endif
} whirl_output;

#if HAS_SUPERVISION
/* Supervision: steps that are taken, then reasons. */
#define WHIRL_WATCH_ADAPTATION_FROZEN 1U
#define WHIRL_WATCH_FEEDFORWARD_REPLACED 2U /* the force follows the unbalance that is estimated, not the designed one */
#define WHIRL_WATCH_GAIN_LOWERED 4U
#define WHIRL_WATCH_FEEDBACK_OFF 8U
#define WHIRL_WATCH_FORCE_OFF 16U
#define WHIRL_WATCH_TRIP 32U
#define WHIRL_WATCH_GROWTH 256U            /* motion that does not turn with the rotor is large and does not decay */
#define WHIRL_WATCH_FEEDFORWARD_PHASE 512U /* the feedforward is more than 60 degrees off the unbalance that acts */
#define WHIRL_WATCH_UNBALANCE_CHANGED 1024U
#define WHIRL_WATCH_SATURATION 2048U
#define WHIRL_WATCH_SENSOR_LOST 4096U
#define WHIRL_WATCH_WORSE_THAN_OPEN 8192U
#define WHIRL_WATCH_FORCE_LOST 16384U      /* the rotor does not follow the force of an axis */
#define WHIRL_WATCH_FORCE_REVERSED 32768U  /* it moves against the force of an axis */
#define WHIRL_WATCH_FORCE_LATE 65536U      /* the force acts about 8 ms later than designed for */
#define WHIRL_WATCH_FORCE_TESTED 131072U   /* it was let go for 6 to 24 ms, to tell it from another unbalance */

#endif
#if HAS_REIDENTIFY
/* Re-identification: 1, 2, 4 stiffness, damping, gain are determined; 8, 16, 32 are at their bounds. */
#define WHIRL_REID_UNDETERMINED 64U   /* none of them is */
#define WHIRL_REID_OTHER_MACHINE 128U /* no such numbers explain the motion: the parameters act */
#define WHIRL_REID_FROZEN 256U        /* too slow or fast, force at its limit, reading lost, or supervision steps in */

#endif
typedef enum {
  WHIRL_OK = 0,
  WHIRL_NOT_FINITE = 1,   /* angle, speed or result NaN or infinite */
  WHIRL_STALE_SENSOR = 2, /* more than stale_limit samples lost in a row */
  WHIRL_NOT_READY = 3,    /* whirl_init was not called or refused its parameters */
#if HAS_SUPERVISION
  WHIRL_SUPERVISION = 4,  /* the last step of the supervision; whirl_reset starts again */
#endif
  WHIRL_GAP = 5           /* more than max_gap sample times were left out; the next step starts anew */
} whirl_status;

typedef struct {
  whirl_real re;
  whirl_real im;
} whirl_complex;

/* Position, velocity and disturbance acceleration of the disk; complex = x + i y. */
typedef struct {
  whirl_complex z; /* m */
  whirl_complex v; /* m/s */
  whirl_complex d; /* m/s^2, turns with the rotor */
} whirl_motion;

#if HAS_SUPERVISION
/* What explains the residual of the check of the force: r^2 and what is left of it by another unbalance, gains, delay. */
typedef struct {
  whirl_real rr;
  whirl_real changed;
  whirl_real by_gain;
  whirl_real by_delay;
  whirl_real gain_x;
  whirl_real gain_y;
  whirl_real low;
  whirl_real high;
  whirl_real sure_x; /* r^2 for each squared difference of a gain */
  whirl_real sure_y;
  whirl_real share; /* of the probe that fits best */
  whirl_real delay; /* s */
  whirl_complex eps;
} whirl_force_fit;

/* Memory of the check that the rotor follows the force. */
#define WHIRL_BLOCKS 16
typedef struct {
  int32_t samples; /* a late force is looked for 8 ms and 12 ms ago: samples a block, blocks */
  int32_t first;
  int32_t blocks;
  int32_t readings;
  int32_t summed;
  int32_t at;
  whirl_complex z1;
  whirl_complex z2;
  whirl_complex a1;
  whirl_complex forcing1;
  whirl_complex sum;
  whirl_complex ring[WHIRL_BLOCKS];
  whirl_complex y[3];
  whirl_complex u[3];
  whirl_complex late[3];
  whirl_complex later[3];
  whirl_complex unbalance[3];
  whirl_complex z[3];
  whirl_complex eps;
  whirl_complex now;
  whirl_complex fd;
  whirl_complex fx;
  whirl_complex fy;
  whirl_complex fl;
  whirl_complex fm;
  whirl_complex fz;
  whirl_complex zd;
  whirl_complex zx;
  whirl_complex zy;
  whirl_complex zl;
  whirl_complex zm;
  whirl_real ff;
  whirl_real dd;
  whirl_real xx;
  whirl_real yy;
  whirl_real xd;
  whirl_real yd;
  whirl_real ll;
  whirl_real ld;
  whirl_real mm;
  whirl_real md;
  whirl_real zz;
  whirl_real time;
  whirl_real loud;
  whirl_real usual; /* r^2 of the last 0.3 s */
  bool risen;
  whirl_real gain_time;
  whirl_real late_time;
  whirl_real proof_time;
  whirl_real unsure; /* s in which what is delivered is not known */
  whirl_real test; /* s since the force was let go; 0: it acts */
  whirl_real tested;
  whirl_real before;
  whirl_real proven; /* s in which the force acted */
  whirl_real idle;   /* s in which it seemed to do nothing */
  whirl_real found;  /* s, by which the force seems late */
  uint32_t suspected;
  bool changed;
  bool known;
} whirl_force_check;

/* Memory of the supervision. */
typedef struct {
  bool started;
  bool follow;
  bool returned;
  bool adapt;
  uint32_t reasons;
  uint32_t word;
  whirl_real late; /* s, by which the force was found late; 0: it is not */
  int32_t steps; /* taken back: 1 adaptation; 2, 3 gain; 4 feedback; 5 force; 6 trip */
  whirl_motion motion;
  whirl_complex synchronous;
  whirl_complex offset;
  whirl_complex given;
  whirl_complex estimated;
  whirl_complex quiet;
  whirl_complex used;
  whirl_complex acting; /* the same, turned ahead by what the force is late */
  whirl_real square;
  whirl_real mark;
  whirl_real time;
  whirl_real above;
  whirl_real wait;
  whirl_real mismatch;
  whirl_real worse;
  whirl_real at_limit;
  whirl_real own;
  whirl_real sudden;
  whirl_real settle;
  whirl_real calm;
  whirl_real held;
  whirl_real feedback;
  whirl_real force;
  whirl_real sensor;
  whirl_real blend;
  whirl_real gain;
} whirl_watch;

#endif
#if HAS_REIDENTIFY
/* Memory of the re-identification. */
#define WHIRL_UNKNOWNS 8
typedef struct {
  whirl_real theta; /* rad, of the window; negative: none is open */
  whirl_real weight;
  whirl_complex y;
  whirl_complex z;
  whirl_complex v;
  whirl_complex a;
  whirl_complex f;
  whirl_real information[WHIRL_UNKNOWNS][WHIRL_UNKNOWNS];
  whirl_real moment[WHIRL_UNKNOWNS];
  whirl_real square;
  whirl_real estimate[3];
  whirl_real sd[3];
  whirl_real target[3];
  whirl_real acting[3];
  uint32_t word;
} whirl_reidentifier;

#endif
#if HAS_STRUCTURE
/* A mode of the structure, driven by the control acceleration: its step and its motion at the sensor. */
#define WHIRL_MODES /*@modes@*/
typedef struct {
  whirl_real f00;
  whirl_real f01;
  whirl_real f10;
  whirl_real f11;
  whirl_real first_q;
  whirl_real first_v;
  whirl_real second_q;
  whirl_real second_v;
  whirl_complex q;
  whirl_complex v;
} whirl_mode;

#endif
/*@law_types@*/
/* Memory of the controller; nothing in it is meant to be read or written from outside. */
typedef struct {
  whirl_params params;
  bool ready;
  /* derived from the parameters */
  int32_t whole_delay; /* delay = (whole_delay + fraction) sample_time */
  whirl_real fraction;
#if HAS_STRUCTURE
  whirl_mode modes[WHIRL_MODES];
#endif
/*@estimator_derived@*/
  /* force history as accelerations, m/s^2 */
  whirl_complex history[WHIRL_HISTORY];
#if HAS_CORRECTED
  whirl_complex sent[WHIRL_HISTORY]; /* what was sent; the history is what the designed machine would have got */
  whirl_complex correction;
#endif
  int32_t head;
  /* gate */
  whirl_complex good;
  uint32_t held;
  bool first;
  bool saturated;
  /* gaps */
  whirl_input before; /* last sample */
  int32_t bounded;    /* steps whose force is still bounded after a gap */
  whirl_real recent;  /* N, largest force of the last fifth of a second */
  whirl_real keep;
  whirl_real grow;
  /* estimator */
  bool started;
/*@estimator_state@*/
#if HAS_SUPERVISION
  whirl_watch watch;
  whirl_force_check check;
#endif
#if HAS_REIDENTIFY
  whirl_reidentifier reid;
#endif
  /* law, one value per axis */
#if HAS_AXIS_MEMORY
  whirl_real memory[2]; /* /*@memory@*/ */
#endif
/*@law_state@*/
} whirl_state;

/* The designed numbers. */
void whirl_default_params(whirl_params *params);

/* Checks and stores the parameters and resets the memory. Returns 0, or the number of the first field out of range; the
   step then answers WHIRL_NOT_READY. */
int32_t whirl_init(whirl_state *state, const whirl_params *params);

/* New parameters while running: memory kept. Returns 0, or the number of the first field out of range, nothing changed. */
int32_t whirl_set_params(whirl_state *state, const whirl_params *params);

/* One parameter while running, by the number in front of its field: memory kept. Returns 0, or the number of the first field
   that would be out of range, nothing changed; `number` itself when there is no such field. */
int32_t whirl_set_parameter(whirl_state *state, int32_t number, whirl_real value);

/* Name of a parameter by its number, from 1; an empty string when there is none. */
const char *whirl_parameter_name(int32_t number);

/* Memory as after whirl_init. */
void whirl_reset(whirl_state *state);

/* One sample period: call every sample_time seconds. */
whirl_status whirl_step(whirl_state *state, const whirl_input *in, whirl_output *out);

/* The step after `missed` sample times in which none was called. The controller's own time stays true: it takes one step for
   each of them, max_fill at most, with the motion between the last sample and this one (so the call takes missed + 1 times as
   long), and the first forces after it are bounded by those before. More than max_gap: WHIRL_GAP, zero force. */
whirl_status whirl_step_after(whirl_state *state, const whirl_input *in, int32_t missed, whirl_output *out);

/* Only the steps for the sample times that were left out, for a host that calls at a fixed multiple of sample_time. */
void whirl_fill(whirl_state *state, const whirl_input *in, int32_t missed);

/* The force that was really sent, N, when the host limited the command further. */
void whirl_applied(whirl_state *state, whirl_real ux, whirl_real uy);

#ifdef __cplusplus
}
#endif

#endif
