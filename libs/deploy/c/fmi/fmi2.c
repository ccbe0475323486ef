
/* FMI 2.0 */
#include "fmi2.h"

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

/*@common@*/

EXPORTED const char *fmi2GetTypesPlatform(void) { return "default"; }

EXPORTED const char *fmi2GetVersion(void) { return "2.0"; }

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

EXPORTED fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean tolerance_defined, fmi2Real tolerance, fmi2Real start,
                                        fmi2Boolean stop_defined, fmi2Real stop) {
  instance *const it = body_of(c);
  (void)tolerance_defined;
  (void)tolerance;
  if ((it == NULL) || (it->phase != INSTANTIATED)) {
    return refuse(c, "fmi2SetupExperiment belongs before the initialization");
  }
  if (!isfinite(start) || (stop_defined && !(stop >= start))) {
    return refuse(c, "the start time is not a finite number, or the stop time lies before it");
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

EXPORTED fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Real value[]) {
  instance *const it = body_of(c);
  size_t i;
  if ((it == NULL) || ((n > 0U) && ((vr == NULL) || (value == NULL)))) {
    return refuse(c, "no variables, or no place for their values");
  }
  if (!are_reals(it, vr, n)) {
    return refuse(c, "no such real variable");
  }
  if (it->changed) {
    update(it);
    it->changed = true; /* parameters are still to be checked by the next step */
  }
  for (i = 0; i < n; i++) {
    value[i] = *real_variable(it, vr[i]);
  }
  return overflown(it, vr, n) ? fmi2Discard : fmi2OK;
}

EXPORTED fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const fmi2Real value[]) {
  instance *const it = body_of(c);
  if ((it == NULL) || ((n > 0U) && ((vr == NULL) || (value == NULL))) || !set_reals(it, vr, n, value)) {
    return refuse(c, "this variable cannot be set now, or not to this value");
  }
  return fmi2OK;
}

EXPORTED fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[], size_t n, fmi2Integer value[]) {
  size_t i;
  for (i = 0; i < n; i++) {
#if HAS_CONTROLLER
    if ((c != NULL) && (vr != NULL) && (value != NULL) && (vr[i] >= FIRST_INTEGER) && (vr[i] < (FIRST_INTEGER + INTEGERS))) {
      value[i] = body_of(c)->integer[vr[i] - FIRST_INTEGER];
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
    if ((c != NULL) && (vr != NULL) && (value != NULL) && (vr[i] >= FIRST_BOOLEAN) && (vr[i] < (FIRST_BOOLEAN + BOOLEANS))) {
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
    if ((c != NULL) && (vr != NULL) && (value != NULL) && (vr[i] == FIRST_BOOLEAN) && (body_of(c)->phase != TERMINATED)) {
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

EXPORTED fmi2Status fmi2GetDirectionalDerivative(fmi2Component c, const fmi2ValueReference unknown[], size_t n,
                                                 const fmi2ValueReference known[], size_t m, const fmi2Real seed[],
                                                 fmi2Real value[]) {
#if HAS_PLANT
  instance *const it = body_of(c);
  const char *why;
  if ((it == NULL) || (it->phase == INSTANTIATED) || (unknown == NULL) || (known == NULL) || (seed == NULL) || (value == NULL)) {
    return refuse(c, "fmi2GetDirectionalDerivative before the initialization, or without variables");
  }
  why = directional(it, unknown, n, known, m, seed, value);
  return (why == NULL) ? fmi2OK : refuse(c, why);
#else
  (void)unknown;
  (void)n;
  (void)known;
  (void)m;
  (void)seed;
  (void)value;
  return refuse(c, "directional derivatives are not provided");
#endif
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
  why = advance(it, time, size);
  return (why == NULL) ? fmi2OK : refuse(c, why);
}

EXPORTED fmi2Status fmi2CancelStep(fmi2Component c) { return refuse(c, "no step is pending"); }

EXPORTED fmi2Status fmi2GetStatus(fmi2Component c, fmi2StatusKind kind, fmi2Status *value) {
  (void)kind;
  (void)value;
  return refuse(c, "steps are never pending");
}

EXPORTED fmi2Status fmi2GetRealStatus(fmi2Component c, fmi2StatusKind kind, fmi2Real *value) {
  if ((c == NULL) || (value == NULL) || (kind != fmi2LastSuccessfulTime)) {
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
  if ((c == NULL) || (value == NULL) || (kind != fmi2Terminated)) {
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

EXPORTED fmi2Status fmi2NewDiscreteStates(fmi2Component c, fmi2EventInfo *info) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != EVENT) || (info == NULL)) {
    return refuse(c, "fmi2NewDiscreteStates outside the event mode");
  }
  update(it);
  (void)memset(info, 0, sizeof *info);
  return fmi2OK;
}

#endif
