
/* FMI 3.0 */
#include "fmi3.h"

typedef struct {
  instance body;
  fmi3InstanceEnvironment environment;
  fmi3LogMessageCallback log;
} component;

static fmi3Status refuse(fmi3Instance c, const char *why) {
  const component *const it = (const component *)c;
  if ((it != NULL) && (it->log != NULL)) {
    it->log(it->environment, fmi3Error, "error", why);
  }
  return fmi3Error;
}

/*@common@*/

static fmi3Instance instantiate(fmi3String token, bool model_exchange, bool offered, fmi3InstanceEnvironment environment,
                                fmi3LogMessageCallback log) {
  component *it = NULL;
  if (offered && (token != NULL) && (strcmp(token, TOKEN) == 0)) {
    it = (component *)calloc(1, sizeof *it);
  }
  if (it != NULL) {
    it->environment = environment;
    it->log = log;
    restart(&it->body);
    it->body.model_exchange = model_exchange;
  }
  return it;
}

EXPORTED const char *fmi3GetVersion(void) { return "3.0"; }

EXPORTED fmi3Instance fmi3InstantiateModelExchange(fmi3String name, fmi3String token, fmi3String resources,
                                                   fmi3Boolean visible, fmi3Boolean logging,
                                                   fmi3InstanceEnvironment environment, fmi3LogMessageCallback log) {
  (void)name;
  (void)resources;
  (void)visible;
  (void)logging;
  return instantiate(token, true, /*@me@*/, environment, log);
}

EXPORTED fmi3Instance fmi3InstantiateCoSimulation(fmi3String name, fmi3String token, fmi3String resources,
                                                  fmi3Boolean visible, fmi3Boolean logging, fmi3Boolean event_mode,
                                                  fmi3Boolean early_return, const fmi3ValueReference intermediate[], size_t n,
                                                  fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                  fmi3IntermediateUpdateCallback update_callback) {
  (void)name;
  (void)resources;
  (void)visible;
  (void)logging;
  (void)early_return;
  (void)intermediate;
  (void)n;
  (void)update_callback;
  return instantiate(token, false, /*@cs@*/ && !event_mode, environment, log);
}

EXPORTED fmi3Instance fmi3InstantiateScheduledExecution(fmi3String name, fmi3String token, fmi3String resources,
                                                        fmi3Boolean visible, fmi3Boolean logging,
                                                        fmi3InstanceEnvironment environment, fmi3LogMessageCallback log,
                                                        fmi3ClockUpdateCallback clock, fmi3LockPreemptionCallback lock,
                                                        fmi3LockPreemptionCallback unlock) {
  (void)name;
  (void)token;
  (void)resources;
  (void)visible;
  (void)logging;
  (void)environment;
  (void)log;
  (void)clock;
  (void)lock;
  (void)unlock;
  return NULL;
}

EXPORTED fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean tolerance_defined, fmi3Float64 tolerance,
                                                fmi3Float64 start, fmi3Boolean stop_defined, fmi3Float64 stop) {
  instance *const it = body_of(c);
  (void)tolerance_defined;
  (void)tolerance;
  if ((it == NULL) || (it->phase != INSTANTIATED)) {
    return refuse(c, "fmi3EnterInitializationMode after the initialization");
  }
  if (!isfinite(start) || (stop_defined && !(stop >= start))) {
    return refuse(c, "the start time is not a finite number, or the stop time lies before it");
  }
  it->time = start;
  it->phase = INITIALISING;
  return fmi3OK;
}

EXPORTED fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 value[],
                                   size_t count) {
  instance *const it = body_of(c);
  size_t i;
  if ((it == NULL) || (count != n) || ((n > 0U) && ((vr == NULL) || (value == NULL)))) {
    return refuse(c, "one value for each variable: there are no arrays");
  }
  if (!are_reals(it, vr, n)) {
    return refuse(c, "no such Float64 variable");
  }
  if (it->changed) {
    update(it);
    it->changed = true; /* parameters are still to be checked by the next step */
  }
  for (i = 0; i < n; i++) {
    value[i] = *real_variable(it, vr[i]);
  }
  return overflown(it, vr, n) ? fmi3Discard : fmi3OK;
}

EXPORTED fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 value[],
                                   size_t count) {
  instance *const it = body_of(c);
  if ((it == NULL) || (count != n) || ((n > 0U) && ((vr == NULL) || (value == NULL))) || !set_reals(it, vr, n, value)) {
    return refuse(c, "this variable cannot be set now, or not to this value");
  }
  return fmi3OK;
}

EXPORTED fmi3Status fmi3GetInt32(fmi3Instance c, const fmi3ValueReference vr[], size_t n, int32_t value[], size_t count) {
  size_t i;
  if ((c == NULL) || (count != n) || ((n > 0U) && ((vr == NULL) || (value == NULL)))) {
    return refuse(c, "one value for each variable: there are no arrays");
  }
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((vr[i] >= FIRST_INTEGER) && (vr[i] < (FIRST_INTEGER + INTEGERS))) {
      value[i] = body_of(c)->integer[vr[i] - FIRST_INTEGER];
      continue;
    }
#endif
    (void)vr;
    (void)value;
    return refuse(c, "no such Int32 variable");
  }
  return fmi3OK;
}

EXPORTED fmi3Status fmi3GetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Boolean value[],
                                   size_t count) {
  size_t i;
  if ((c == NULL) || (count != n) || ((n > 0U) && ((vr == NULL) || (value == NULL)))) {
    return refuse(c, "one value for each variable: there are no arrays");
  }
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((vr[i] >= FIRST_BOOLEAN) && (vr[i] < (FIRST_BOOLEAN + BOOLEANS))) {
      value[i] = (body_of(c)->boolean[vr[i] - FIRST_BOOLEAN] != 0);
      continue;
    }
#endif
    (void)vr;
    (void)value;
    return refuse(c, "no such Boolean variable");
  }
  return fmi3OK;
}

EXPORTED fmi3Status fmi3SetBoolean(fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Boolean value[],
                                   size_t count) {
  size_t i;
  if ((c == NULL) || (count != n) || ((n > 0U) && ((vr == NULL) || (value == NULL)))) {
    return refuse(c, "one value for each variable: there are no arrays");
  }
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((vr[i] == FIRST_BOOLEAN) && (body_of(c)->phase != TERMINATED)) {
      body_of(c)->boolean[0] = value[i] ? 1 : 0;
      continue;
    }
#endif
    (void)vr;
    (void)value;
    return refuse(c, "this Boolean variable cannot be set");
  }
  return fmi3OK;
}

EXPORTED fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 time, fmi3Float64 size, fmi3Boolean no_set_state_prior,
                               fmi3Boolean *event_needed, fmi3Boolean *terminate, fmi3Boolean *early_return,
                               fmi3Float64 *last_time) {
  instance *const it = body_of(c);
  const char *why;
  (void)no_set_state_prior;
  if ((it == NULL) || (it->phase != STEPPING)) {
    return refuse(c, "fmi3DoStep outside the step mode");
  }
  why = advance(it, time, size);
  if ((event_needed != NULL) && (terminate != NULL) && (early_return != NULL) && (last_time != NULL)) {
    *event_needed = false;
    *terminate = false;
    *early_return = false;
    *last_time = it->time;
  }
  return (why == NULL) ? fmi3OK : refuse(c, why);
}

EXPORTED fmi3Status fmi3GetNumberOfContinuousStates(fmi3Instance c, size_t *n) {
  if ((c == NULL) || (n == NULL)) {
    return fmi3Error;
  }
  *n = /*@states@*/;
  return fmi3OK;
}

EXPORTED fmi3Status fmi3GetNumberOfEventIndicators(fmi3Instance c, size_t *n) {
  if ((c == NULL) || (n == NULL)) {
    return fmi3Error;
  }
  *n = /*@indicators@*/;
  return fmi3OK;
}
#if HAS_PLANT

EXPORTED fmi3Status fmi3UpdateDiscreteStates(fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate,
                                             fmi3Boolean *nominals_changed, fmi3Boolean *states_changed,
                                             fmi3Boolean *next_event_defined, fmi3Float64 *next_event) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != EVENT) || (again == NULL) || (terminate == NULL) || (nominals_changed == NULL) ||
      (states_changed == NULL) || (next_event_defined == NULL) || (next_event == NULL)) {
    return refuse(c, "fmi3UpdateDiscreteStates outside the event mode");
  }
  update(it);
  *again = false;
  *terminate = false;
  *nominals_changed = false;
  *states_changed = false;
  *next_event_defined = false;
  *next_event = 0.0;
  return fmi3OK;
}

EXPORTED fmi3Status fmi3GetDirectionalDerivative(fmi3Instance c, const fmi3ValueReference unknowns[], size_t n,
                                                 const fmi3ValueReference knowns[], size_t m, const fmi3Float64 seed[],
                                                 size_t seeds, fmi3Float64 sensitivity[], size_t sensitivities) {
  instance *const it = body_of(c);
  const char *why;
  if ((it == NULL) || (it->phase == INSTANTIATED) || (seeds != m) || (sensitivities != n) || (unknowns == NULL) ||
      (knowns == NULL) || (seed == NULL) || (sensitivity == NULL)) {
    return refuse(c, "fmi3GetDirectionalDerivative before the initialization, or without a value for each variable");
  }
  why = directional(it, unknowns, n, knowns, m, seed, sensitivity);
  return (why == NULL) ? fmi3OK : refuse(c, why);
}

#endif

/* What the standard asks for and this FMU has no use for: each answers that it is not provided. */
#define NOT_PROVIDED(name, parameters) \
  EXPORTED fmi3Status name parameters;  \
  EXPORTED fmi3Status name parameters { return refuse(c, #name " is not provided"); }
#if defined __GNUC__
#pragma GCC diagnostic ignored "-Wunused-parameter"
#endif

NOT_PROVIDED(fmi3GetFloat32, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, float value[], size_t count))
NOT_PROVIDED(fmi3SetFloat32, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const float value[], size_t count))
NOT_PROVIDED(fmi3GetInt8, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, int8_t value[], size_t count))
NOT_PROVIDED(fmi3SetInt8, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const int8_t value[], size_t count))
NOT_PROVIDED(fmi3GetUInt8, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, uint8_t value[], size_t count))
NOT_PROVIDED(fmi3SetUInt8, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const uint8_t value[], size_t count))
NOT_PROVIDED(fmi3GetInt16, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, int16_t value[], size_t count))
NOT_PROVIDED(fmi3SetInt16, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const int16_t value[], size_t count))
NOT_PROVIDED(fmi3GetUInt16, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, uint16_t value[], size_t count))
NOT_PROVIDED(fmi3SetUInt16, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const uint16_t value[], size_t count))
NOT_PROVIDED(fmi3GetUInt32, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, uint32_t value[], size_t count))
NOT_PROVIDED(fmi3SetUInt32, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const uint32_t value[], size_t count))
NOT_PROVIDED(fmi3GetInt64, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, int64_t value[], size_t count))
NOT_PROVIDED(fmi3SetInt64, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const int64_t value[], size_t count))
NOT_PROVIDED(fmi3GetUInt64, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, uint64_t value[], size_t count))
NOT_PROVIDED(fmi3SetUInt64, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const uint64_t value[], size_t count))
NOT_PROVIDED(fmi3GetString, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3String value[], size_t count))
NOT_PROVIDED(fmi3SetString, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3String value[], size_t count))
NOT_PROVIDED(fmi3SetInt32, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const int32_t value[], size_t count))
NOT_PROVIDED(fmi3GetBinary, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, size_t sizes[], fmi3Binary value[],
             size_t count))
NOT_PROVIDED(fmi3SetBinary, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const size_t sizes[], const fmi3Binary
             value[], size_t count))
NOT_PROVIDED(fmi3GetClock, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Clock value[]))
NOT_PROVIDED(fmi3SetClock, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Clock value[]))
NOT_PROVIDED(fmi3GetNumberOfVariableDependencies, (fmi3Instance c, fmi3ValueReference vr, size_t *n))
NOT_PROVIDED(fmi3GetVariableDependencies, (fmi3Instance c, fmi3ValueReference dependent, size_t indices[], fmi3ValueReference
             independents[], size_t independent_indices[], fmi3DependencyKind kinds[], size_t n))
NOT_PROVIDED(fmi3GetAdjointDerivative, (fmi3Instance c, const fmi3ValueReference unknowns[], size_t n, const
             fmi3ValueReference knowns[], size_t m, const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t
             sensitivities))
NOT_PROVIDED(fmi3EnterConfigurationMode, (fmi3Instance c))
NOT_PROVIDED(fmi3ExitConfigurationMode, (fmi3Instance c))
NOT_PROVIDED(fmi3EnterStepMode, (fmi3Instance c))
NOT_PROVIDED(fmi3EvaluateDiscreteStates, (fmi3Instance c))
NOT_PROVIDED(fmi3GetIntervalDecimal, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 intervals[],
             fmi3IntervalQualifier qualifiers[]))
NOT_PROVIDED(fmi3GetIntervalFraction, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, uint64_t counters[], uint64_t
             resolutions[], fmi3IntervalQualifier qualifiers[]))
NOT_PROVIDED(fmi3GetShiftDecimal, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, fmi3Float64 shifts[]))
NOT_PROVIDED(fmi3GetShiftFraction, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, uint64_t counters[], uint64_t
             resolutions[]))
NOT_PROVIDED(fmi3SetIntervalDecimal, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 intervals[]))
NOT_PROVIDED(fmi3SetIntervalFraction, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const uint64_t counters[],
             const uint64_t resolutions[]))
NOT_PROVIDED(fmi3SetShiftDecimal, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const fmi3Float64 shifts[]))
NOT_PROVIDED(fmi3SetShiftFraction, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const uint64_t counters[], const
             uint64_t resolutions[]))
NOT_PROVIDED(fmi3GetOutputDerivatives, (fmi3Instance c, const fmi3ValueReference vr[], size_t n, const int32_t orders[],
             fmi3Float64 value[], size_t count))
NOT_PROVIDED(fmi3ActivateModelPartition, (fmi3Instance c, fmi3ValueReference clock, fmi3Float64 time))
#if HAS_CONTROLLER || HAS_ROTOR
NOT_PROVIDED(fmi3EnterEventMode, (fmi3Instance c))
NOT_PROVIDED(fmi3UpdateDiscreteStates, (fmi3Instance c, fmi3Boolean *again, fmi3Boolean *terminate, fmi3Boolean
             *nominals_changed, fmi3Boolean *states_changed, fmi3Boolean *next_event_defined, fmi3Float64 *next_event))
NOT_PROVIDED(fmi3EnterContinuousTimeMode, (fmi3Instance c))
NOT_PROVIDED(fmi3CompletedIntegratorStep, (fmi3Instance c, fmi3Boolean no_set_state_prior, fmi3Boolean *enter_event,
             fmi3Boolean *terminate))
NOT_PROVIDED(fmi3SetTime, (fmi3Instance c, fmi3Float64 time))
NOT_PROVIDED(fmi3SetContinuousStates, (fmi3Instance c, const fmi3Float64 x[], size_t n))
NOT_PROVIDED(fmi3GetContinuousStates, (fmi3Instance c, fmi3Float64 x[], size_t n))
NOT_PROVIDED(fmi3GetContinuousStateDerivatives, (fmi3Instance c, fmi3Float64 rates[], size_t n))
NOT_PROVIDED(fmi3GetEventIndicators, (fmi3Instance c, fmi3Float64 indicators[], size_t n))
NOT_PROVIDED(fmi3GetNominalsOfContinuousStates, (fmi3Instance c, fmi3Float64 nominal[], size_t n))
NOT_PROVIDED(fmi3GetDirectionalDerivative, (fmi3Instance c, const fmi3ValueReference unknowns[], size_t n, const
             fmi3ValueReference knowns[], size_t m, const fmi3Float64 seed[], size_t seeds, fmi3Float64 sensitivity[], size_t
             sensitivities))
#endif
