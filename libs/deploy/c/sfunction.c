/* Simulink S-function around /*@prefix@*/.c. Build:  mex /*@prefix@*/_sfun.c /*@prefix@*/.c
#if HAS_CONTROLLER
   Input: x, y (m), beta (rad), omega (rad/s), omega_dot (rad/s^2), valid. Output: ux, uy (N), s_x, s_y (m/s),
   x, y (m), vx, vy (m/s) estimated, status. Sample time /*@sample_time@*/ s.
#else
   Input: /*@inputs@*/. Output: the states (/*@states@*/), then /*@outputs@*/. Continuous states start at 0.
#endif
   Parameter of the block, tunable: [] for the numbers of the export, or all fields of whirl_params in their order. */
#define S_FUNCTION_NAME /*@prefix@*/_sfun
#define S_FUNCTION_LEVEL 2

#include "/*@prefix@*/.h"

#include "simstruc.h"

#include <math.h>
#include <stdio.h>

/* A host without block parameters runs the numbers of the export. */
#ifdef ssSetErrorStatus
#define REFUSE(S, text) ssSetErrorStatus(S, text)
#else
#define REFUSE(S, text) ((void)(S))
#endif

#if HAS_CONTROLLER
#define INPUTS 6
#define OUTPUTS 9
#else
#define INPUTS WHIRL_INPUTS
#define OUTPUTS (WHIRL_STATES + WHIRL_OUTPUTS)
#endif

/* Numbers of the block. False: their count is wrong, or one is out of its range (`wrong` counts from 1). */
static int numbers_of(SimStruct *S, whirl_params *params, int *wrong) {
  whirl_default_params(params);
  *wrong = 0;
#ifdef ssGetSFcnParam
  {
    const mxArray *const given = ssGetSFcnParam(S, 0);
    whirl_real *const row = (whirl_real *)params;
    const size_t count = sizeof *params / sizeof row[0];
    size_t i;
    if (mxGetNumberOfElements(given) == 0) {
      return 1;
    }
    if (!mxIsDouble(given) || (mxGetNumberOfElements(given) != count)) {
      return 0;
    }
    for (i = 0; i < count; i++) {
      row[i] = (whirl_real)mxGetPr(given)[i];
#if HAS_CONTROLLER
#else
      if (!isfinite(row[i])) {
        *wrong = (int)i + 1;
      }
#endif
    }
  }
#else
  (void)S;
#endif
#if HAS_CONTROLLER
  {
    whirl_state trial;
    *wrong = (int)whirl_init(&trial, params);
    /* the sample time of the block is fixed */
    if (params->sample_time != (whirl_real)/*@sample_time@*/) {
      return 0;
    }
  }
#endif
  return *wrong == 0;
}

#ifdef ssGetSFcnParam
#define MDL_CHECK_PARAMETERS
static void mdlCheckParameters(SimStruct *S) {
  static char text[80];
  whirl_params params;
  int wrong;
  if (!numbers_of(S, &params, &wrong)) {
    (void)snprintf(text, sizeof text, "/*@prefix@*/: parameter %d is out of its range, or their number is wrong", wrong);
    ssSetErrorStatus(S, text);
  }
}
#endif

static void mdlInitializeSizes(SimStruct *S) {
#ifdef ssGetSFcnParam
  ssSetNumSFcnParams(S, 1);
  if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) {
    return;
  }
  mdlCheckParameters(S);
#else
  ssSetNumSFcnParams(S, 0);
#endif
#if HAS_CONTROLLER
  ssSetNumContStates(S, 0);
#else
  ssSetNumContStates(S, WHIRL_STATES);
#endif
  ssSetNumDiscStates(S, 0);
  if (!ssSetNumInputPorts(S, INPUTS > 0 ? 1 : 0)) {
    return;
  }
  if (INPUTS > 0) {
    ssSetInputPortWidth(S, 0, INPUTS);
    ssSetInputPortRequiredContiguous(S, 0, 1);
    ssSetInputPortDirectFeedThrough(S, 0, 1);
  }
  if (!ssSetNumOutputPorts(S, 1)) {
    return;
  }
  ssSetOutputPortWidth(S, 0, OUTPUTS);
  ssSetNumSampleTimes(S, 1);
#if HAS_CONTROLLER
  ssSetNumDWork(S, 1);
  ssSetDWorkWidth(S, 0, (int)sizeof(whirl_state));
  ssSetDWorkDataType(S, 0, SS_UINT8);
#endif
}

static void mdlInitializeSampleTimes(SimStruct *S) {
#if HAS_CONTROLLER
  ssSetSampleTime(S, 0, /*@sample_time@*/);
#else
  ssSetSampleTime(S, 0, CONTINUOUS_SAMPLE_TIME);
#endif
  ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_INITIALIZE_CONDITIONS
static void mdlInitializeConditions(SimStruct *S) {
#if HAS_CONTROLLER
  whirl_params params;
  int wrong;
  if (!numbers_of(S, &params, &wrong) || (whirl_init((whirl_state *)ssGetDWork(S, 0), &params) != 0)) {
    REFUSE(S, "/*@prefix@*/: a parameter is out of its range");
  }
#else
  real_T *const x = ssGetContStates(S);
  int i;
  for (i = 0; i < WHIRL_STATES; i++) {
    x[i] = 0.0;
  }
#endif
}
#if HAS_CONTROLLER

#ifdef ssGetSFcnParam
#define MDL_PROCESS_PARAMETERS
/* New numbers while running: memory kept. */
static void mdlProcessParameters(SimStruct *S) {
  whirl_params params;
  int wrong;
  if (!numbers_of(S, &params, &wrong) || (whirl_set_params((whirl_state *)ssGetDWork(S, 0), &params) != 0)) {
    REFUSE(S, "/*@prefix@*/: a parameter is out of its range");
  }
}
#endif

/*@step_values@*/

static void mdlOutputs(SimStruct *S, int_T tid) {
  (void)tid;
  step_values((whirl_state *)ssGetDWork(S, 0), ssGetInputPortRealSignal(S, 0), ssGetOutputPortRealSignal(S, 0));
}
#else

static const real_T *inputs_of(SimStruct *S) {
  static const real_T none[1] = {0.0};
  return (INPUTS > 0) ? ssGetInputPortRealSignal(S, 0) : none;
}

static void mdlOutputs(SimStruct *S, int_T tid) {
  const real_T *const x = ssGetContStates(S);
  real_T *const y = ssGetOutputPortRealSignal(S, 0);
  whirl_params params;
  int i;
  (void)tid;
  (void)numbers_of(S, &params, &i);
  for (i = 0; i < WHIRL_STATES; i++) {
    y[i] = x[i];
  }
  whirl_outputs(&params, ssGetT(S), x, inputs_of(S), &y[WHIRL_STATES]);
}

#define MDL_DERIVATIVES
static void mdlDerivatives(SimStruct *S) {
  whirl_params params;
  int wrong;
  (void)numbers_of(S, &params, &wrong);
  whirl_rates(&params, ssGetT(S), ssGetContStates(S), inputs_of(S), ssGetdX(S));
}
#endif

static void mdlTerminate(SimStruct *S) { (void)S; }

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
