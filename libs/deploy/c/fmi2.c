
/* FMI 2.0 */
#include "fmi2.h"

#if defined _WIN32
#define EXPORTED __declspec(dllexport)
#elif defined __GNUC__
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif

typedef struct {
  instance body;
  char name[64];
  const fmi2CallbackFunctions *callbacks;
} component;

static fmi2Status refuse(fmi2Component c, const char *why) {
  const component *const it = (const component *)c;
  if ((it != NULL) && (it->callbacks != NULL) && (it->callbacks->logger != NULL)) {
    it->callbacks->logger(it->callbacks->componentEnvironment, it->name, fmi2Error, "error", "%s", why);
  }
  return fmi2Error;
}

static instance *body_of(fmi2Component c) { return (c == NULL) ? NULL : &((component *)c)->body; }

EXPORTED const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORTED const char *fmi2GetVersion(void) { return "2.0"; }

EXPORTED fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const fmi2String categories[]) {
  (void)on;
  (void)n;
  (void)categories;
  return (c == NULL) ? fmi2Error : fmi2OK;
}

EXPORTED fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type, fmi2String guid, fmi2String resources,
                                       const fmi2CallbackFunctions *callbacks, fmi2Boolean visible, fmi2Boolean logging) {
  component *it;
  (void)resources;
  (void)visible;
  (void)logging;
  if ((guid == NULL) || (strcmp(guid, TOKEN) != 0) || ((type == fmi2ModelExchange) ? !/*@me@*/ : !/*@cs@*/)) {
    return NULL;
  }
  it = (component *)calloc(1, sizeof *it);
  if (it != NULL) {
    it->callbacks = callbacks;
    if (name != NULL) {
      (void)strncpy(it->name, name, sizeof it->name - 1);
    }
    restart(&it->body);
    it->body.model_exchange = (type == fmi2ModelExchange);
  }
  return it;
}

EXPORTED void fmi2FreeInstance(fmi2Component c) { free(c); }

EXPORTED fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                                        fmi2Boolean stop_defined, fmi2Real stop) {
  instance *const it = body_of(c);
  (void)tolerance_defined;
  (void)tolerance;
  (void)stop_defined;
  (void)stop;
  if ((it == NULL) || (it->phase != INSTANTIATED)) {
    return refuse(c, "fmi2SetupExperiment belongs before the initialization");
  }
  it->time = start;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2EnterInitializationMode(fmi2Component c) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != INSTANTIATED)) {
    return refuse(c, "fmi2EnterInitializationMode after the initialization");
  }
  it->phase = INITIALISING;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2ExitInitializationMode(fmi2Component c) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != INITIALISING)) {
    return refuse(c, "fmi2ExitInitializationMode outside the initialization");
  }
  if (!initialise(it)) {
    return refuse(c, "a parameter is out of its range");
  }
  it->phase = it->model_exchange ? EVENT : STEPPING;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2Terminate(fmi2Component c) {
  instance *const it = body_of(c);
  if (it == NULL) {
    return fmi2Error;
  }
  it->phase = TERMINATED;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2Reset(fmi2Component c) {
  if (c == NULL) {
    return fmi2Error;
  }
  restart(body_of(c));
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  instance *const it = body_of(c);
  size_t i;
  if (it == NULL) {
    return fmi2Error;
  }
  if (it->changed) {
    update(it);
    it->changed = true; /* parameters are still to be checked by the next step */
  }
  for (i = 0; i < n; i++) {
    const double *const at = real_variable(it, vr[i]);
    if (at == NULL) {
      return refuse(c, "no such real variable");
    }
    value[i] = *at;
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  instance *const it = body_of(c);
  size_t i;
  for (i = 0; i < n; i++) {
    if ((it == NULL) || !set_real(it, vr[i], value[i])) {
      return refuse(c, "this variable cannot be set now");
    }
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
  size_t i;
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((c != NULL) && (vr[i] == STATUS)) {
      value[i] = body_of(c)->status;
      continue;
    }
#endif
    (void)vr;
    (void)value;
    return refuse(c, "no such integer variable");
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Integer value[]) {
  (void)vr;
  (void)value;
  return (n == 0U) ? fmi2OK : refuse(c, "no integer variable can be set");
}

EXPORTED fmi2Status fmi2GetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Boolean value[]) {
  size_t i;
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((c != NULL) && (vr[i] >= FIRST_BOOLEAN) && (vr[i] < FIRST_BOOLEAN + BOOLEANS)) {
      value[i] = body_of(c)->boolean[vr[i] - FIRST_BOOLEAN];
      continue;
    }
#endif
    (void)vr;
    (void)value;
    return refuse(c, "no such Boolean variable");
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SetBoolean(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Boolean value[]) {
  size_t i;
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((c != NULL) && (vr[i] == FIRST_BOOLEAN)) {
      body_of(c)->boolean[0] = value[i];
      continue;
    }
#endif
    (void)vr;
    (void)value;
    return refuse(c, "this Boolean variable cannot be set");
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2String value[]) {
  (void)vr;
  (void)value;
  return (n == 0U) ? fmi2OK : refuse(c, "there are no string variables");
}

EXPORTED fmi2Status fmi2SetString(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2String value[]) {
  (void)vr;
  (void)value;
  return (n == 0U) ? fmi2OK : refuse(c, "there are no string variables");
}

EXPORTED fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state) {
  if ((c == NULL) || (state == NULL)) {
    return fmi2Error;
  }
  if (*state == NULL) {
    *state = malloc(sizeof(instance));
  }
  if (*state == NULL) {
    return refuse(c, "no memory for the state");
  }
  memcpy(*state, body_of(c), sizeof(instance));
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state) {
  if ((c == NULL) || (state == NULL)) {
    return fmi2Error;
  }
  memcpy(body_of(c), state, sizeof(instance));
  return fmi2OK;
}

EXPORTED fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state) {
  (void)c;
  if (state != NULL) {
    free(*state);
    *state = NULL;
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state, size_t *size) {
  (void)c;
  (void)state;
  *size = sizeof(instance);
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size) {
  if ((state == NULL) || (size < sizeof(instance))) {
    return refuse(c, "the buffer is too small for the state");
  }
  memcpy(bytes, state, sizeof(instance));
  return fmi2OK;
}

EXPORTED fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state) {
  if ((size != sizeof(instance)) || (fmi2GetFMUstate(c, state) != fmi2OK)) {
    return refuse(c, "these bytes are no state of this FMU");
  }
  memcpy(*state, bytes, sizeof(instance));
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                                 const fmi2ValueReference known[], size_t m, const fmi2Real seed[],
                                                 fmi2Real value[]) {
  (void)unknown;
  (void)n;
  (void)known;
  (void)m;
  (void)seed;
  (void)value;
  return refuse(c, "directional derivatives are not provided");
}

/* Co-simulation */

EXPORTED fmi2Status fmi2SetRealInputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                const fmi2Integer order[], const fmi2Real value[]) {
  (void)vr;
  (void)order;
  (void)value;
  return (n == 0U) ? fmi2OK : refuse(c, "inputs are not interpolated");
}

EXPORTED fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c, const fmi2ValueReference vr[], size_t n,
                                                 const fmi2Integer order[], fmi2Real value[]) {
  (void)vr;
  (void)order;
  (void)value;
  return (n == 0U) ? fmi2OK : refuse(c, "derivatives of outputs are not provided");
}

EXPORTED fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size, fmi2Boolean no_set_state_prior) {
  instance *const it = body_of(c);
  const char *why;
  (void)no_set_state_prior;
  if ((it == NULL) || (it->phase != STEPPING)) {
    return refuse(c, "fmi2DoStep outside the step mode");
  }
  it->time = time;
  why = advance(it, size);
  return (why == NULL) ? fmi2OK : refuse(c, why);
}

EXPORTED fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, "no step is pending"); }

EXPORTED fmi2Status fmi2GetStatus(fmi2Component c, fmi2StatusKind kind, fmi2Status *value) {
  (void)kind;
  (void)value;
  return refuse(c, "steps are never pending");
}

EXPORTED fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
  if ((c == NULL) || (kind != fmi2LastSuccessfulTime)) {
    return refuse(c, "only the last successful time is known");
  }
  *value = body_of(c)->time;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetIntegerStatus(fmi2Component c, fmi2StatusKind kind, fmi2Integer *value) {
  (void)kind;
  (void)value;
  return refuse(c, "there is no integer status");
}

EXPORTED fmi2Status fmi2GetBooleanStatus(fmi2Component c, fmi2StatusKind kind, fmi2Boolean *value) {
  if ((c == NULL) || (kind != fmi2Terminated)) {
    return refuse(c, "there is no such status");
  }
  *value = (body_of(c)->phase == TERMINATED) ? 1 : 0;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetStringStatus(fmi2Component c, fmi2StatusKind kind, fmi2String *value) {
  (void)kind;
  (void)value;
  return refuse(c, "there is no string status");
}
#if HAS_PLANT

/* Model exchange */

EXPORTED fmi2Status fmi2EnterEventMode(fmi2Component c) {
  instance *const it = body_of(c);
  if ((it == NULL) || !it->model_exchange || (it->phase < EVENT) || (it->phase == TERMINATED)) {
    return refuse(c, "fmi2EnterEventMode outside model exchange");
  }
  it->phase = EVENT;
  it->changed = true;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != EVENT) || (info == NULL)) {
    return refuse(c, "fmi2NewDiscreteStates outside the event mode");
  }
  update(it);
  memset(info, 0, sizeof *info);
  return fmi2OK;
}

EXPORTED fmi2Status fmi2EnterContinuousTimeMode(fmi2Component c) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != EVENT)) {
    return refuse(c, "fmi2EnterContinuousTimeMode outside the event mode");
  }
  update(it);
  it->phase = CONTINUOUS;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2CompletedIntegratorStep(fmi2Component c, fmi2Boolean no_set_state_prior, fmi2Boolean *enter_event,
                                                fmi2Boolean *terminate) {
  (void)no_set_state_prior;
  *enter_event = 0;
  *terminate = 0;
  return (c == NULL) ? fmi2Error : fmi2OK;
}

EXPORTED fmi2Status fmi2SetTime(fmi2Component c, fmi2Real time) {
  if (c == NULL) {
    return fmi2Error;
  }
  body_of(c)->time = time;
  body_of(c)->changed = true;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2SetContinuousStates(fmi2Component c, const fmi2Real x[], size_t n) {
  if ((c == NULL) || (n != STATES)) {
    return refuse(c, "wrong number of states");
  }
  memcpy(body_of(c)->x, x, n * sizeof x[0]);
  body_of(c)->changed = true;
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetContinuousStates(fmi2Component c, fmi2Real x[], size_t n) {
  if ((c == NULL) || (n != STATES)) {
    return refuse(c, "wrong number of states");
  }
  memcpy(x, body_of(c)->x, n * sizeof x[0]);
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetDerivatives(fmi2Component c, fmi2Real rates[], size_t n) {
  if ((c == NULL) || (n != STATES)) {
    return refuse(c, "wrong number of states");
  }
  update(body_of(c));
  memcpy(rates, body_of(c)->rate, n * sizeof rates[0]);
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetEventIndicators(fmi2Component c, fmi2Real indicators[], size_t n) {
#if HAS_EVENTS
  if ((c == NULL) || (n != EVENTS)) {
    return refuse(c, "wrong number of event indicators");
  }
  update(body_of(c));
  memcpy(indicators, body_of(c)->event, n * sizeof indicators[0]);
  return fmi2OK;
#else
  (void)indicators;
  return (n == 0U) ? fmi2OK : refuse(c, "there are no event indicators");
#endif
}

EXPORTED fmi2Status fmi2GetNominalsOfContinuousStates(fmi2Component c, fmi2Real nominal[], size_t n) {
  size_t i;
  if ((c == NULL) || (n != STATES)) {
    return refuse(c, "wrong number of states");
  }
  for (i = 0; i < n; i++) {
    nominal[i] = 1.0;
  }
  return fmi2OK;
}
#endif
