/* The same in FMI 2.0 and 3.0 but for names. */
#if defined _WIN32
#define EXPORTED __declspec(dllexport)
#elif defined __GNUC__
#define EXPORTED __attribute__((visibility("default")))
#else
#define EXPORTED
#endif

static instance *body_of(void *c) { return (c == NULL) ? NULL : &((component *)c)->body; }

EXPORTED /*@fmi@*/Status /*@fmi@*/SetDebugLogging(void *c, /*@fmi@*/Boolean on, size_t n, const /*@fmi@*/String categories[]) {
  (void)on;
  (void)n;
  (void)categories;
  return (c == NULL) ? /*@fmi@*/Error : /*@fmi@*/OK;
}

EXPORTED void /*@fmi@*/FreeInstance(void *c) { free(c); }

EXPORTED /*@fmi@*/Status /*@fmi@*/ExitInitializationMode(void *c) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != INITIALISING)) {
    return refuse(c, "/*@fmi@*/ExitInitializationMode outside the initialization");
  }
  if (!initialise(it)) {
    return refuse(c, "a parameter is out of its range");
  }
  it->phase = it->model_exchange ? EVENT : STEPPING;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Terminate(void *c) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase < EVENT) || (it->phase == TERMINATED)) {
    return refuse(c, "/*@fmi@*/Terminate outside the run");
  }
  it->phase = TERMINATED;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Reset(void *c) {
  if (c == NULL) {
    return /*@fmi@*/Error;
  }
  restart(body_of(c));
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Get/*@State@*/(void *c, /*@fmi@*//*@State@*/ *state) {
  if ((c == NULL) || (state == NULL)) {
    return /*@fmi@*/Error;
  }
  if (*state == NULL) {
    *state = malloc(sizeof(instance));
  }
  if (*state == NULL) {
    return refuse(c, "no memory for the state");
  }
  (void)memcpy(*state, body_of(c), sizeof(instance));
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Set/*@State@*/(void *c, /*@fmi@*//*@State@*/ state) {
  if ((c == NULL) || (state == NULL)) {
    return /*@fmi@*/Error;
  }
  (void)memcpy(body_of(c), state, sizeof(instance));
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Free/*@State@*/(void *c, /*@fmi@*//*@State@*/ *state) {
  if (c == NULL) {
    return /*@fmi@*/Error;
  }
  if (state != NULL) {
    free(*state);
    *state = NULL;
  }
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Serialized/*@State@*/Size(void *c, /*@fmi@*//*@State@*/ state, size_t *size) {
  if ((c == NULL) || (state == NULL) || (size == NULL)) {
    return refuse(c, "no state, or no place for its size");
  }
  *size = sizeof(instance) + sizeof(unsigned long long);
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/Serialize/*@State@*/(void *c, /*@fmi@*//*@State@*/ state, /*@fmi@*/Byte bytes[], size_t size) {
  unsigned long long sum;
  if ((c == NULL) || (state == NULL) || (bytes == NULL) || (size < sizeof(instance) + sizeof sum)) {
    return refuse(c, "the buffer is too small for the state");
  }
  sum = checksum((const unsigned char *)state, sizeof(instance));
  (void)memcpy(bytes, state, sizeof(instance));
  (void)memcpy(&bytes[sizeof(instance)], &sum, sizeof sum);
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*//*@Deserialize@*//*@State@*/(void *c, const /*@fmi@*/Byte bytes[], size_t size, /*@fmi@*//*@State@*/ *state) {
  unsigned long long sum;
  if ((c == NULL) || (bytes == NULL) || (size != sizeof(instance) + sizeof sum)) {
    return refuse(c, "these bytes are no state of this FMU");
  }
  (void)memcpy(&sum, &bytes[sizeof(instance)], sizeof sum);
  if ((checksum((const unsigned char *)bytes, sizeof(instance)) != sum) ||
      (/*@fmi@*/Get/*@State@*/(c, state) != /*@fmi@*/OK)) {
    return refuse(c, "these bytes are no state of this FMU");
  }
  (void)memcpy(*state, bytes, sizeof(instance));
  return /*@fmi@*/OK;
}
#if HAS_PLANT

/* Model exchange from the initialization on, up to the phase `last`; time and states change from the first event mode on. */
static bool between(void *c, phase last) {
  const instance *const it = body_of(c);
  const phase first = (last == CONTINUOUS) ? EVENT : INITIALISING;
  return it->model_exchange && (it->phase >= first) && (it->phase <= last);
}

EXPORTED /*@fmi@*/Status /*@fmi@*/EnterEventMode(void *c) {
  instance *const it = body_of(c);
  if ((it == NULL) || !between(c, CONTINUOUS)) {
    return refuse(c, "/*@fmi@*/EnterEventMode outside model exchange");
  }
  it->phase = EVENT;
  it->changed = true;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/EnterContinuousTimeMode(void *c) {
  instance *const it = body_of(c);
  if ((it == NULL) || (it->phase != EVENT)) {
    return refuse(c, "/*@fmi@*/EnterContinuousTimeMode outside the event mode");
  }
  update(it);
  it->phase = CONTINUOUS;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/CompletedIntegratorStep(void *c, /*@fmi@*/Boolean no_set_state_prior, /*@fmi@*/Boolean *enter_event,
                                                /*@fmi@*/Boolean *terminate) {
  (void)no_set_state_prior;
  if ((c == NULL) || (body_of(c)->phase != CONTINUOUS) || (enter_event == NULL) || (terminate == NULL)) {
    return refuse(c, "/*@fmi@*/CompletedIntegratorStep outside the continuous-time mode");
  }
  *enter_event = 0;
  *terminate = 0;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/SetTime(void *c, double time) {
  if ((c == NULL) || !between(c, CONTINUOUS)) {
    return refuse(c, "/*@fmi@*/SetTime outside model exchange");
  }
  if (!isfinite(time)) {
    return refuse(c, "the time is not a finite number");
  }
  body_of(c)->time = time;
  body_of(c)->changed = true;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/SetContinuousStates(void *c, const double x[], size_t n) {
  size_t i;
  if ((c == NULL) || !between(c, CONTINUOUS)) {
    return refuse(c, "/*@fmi@*/SetContinuousStates outside model exchange");
  }
  if ((n != STATES) || (x == NULL)) {
    return refuse(c, "wrong number of states");
  }
  for (i = 0; i < n; i++) {
    if (!isfinite(x[i])) {
      return refuse(c, "a state is not a finite number");
    }
  }
  (void)memcpy(body_of(c)->x, x, n * sizeof x[0]);
  body_of(c)->changed = true;
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/GetContinuousStates(void *c, double x[], size_t n) {
  if ((c == NULL) || !between(c, TERMINATED)) {
    return refuse(c, "/*@fmi@*/GetContinuousStates outside model exchange");
  }
  if ((n != STATES) || (x == NULL)) {
    return refuse(c, "wrong number of states");
  }
  (void)memcpy(x, body_of(c)->x, n * sizeof x[0]);
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*//*@Derivatives@*/(void *c, double rates[], size_t n) {
  size_t i;
  if ((c == NULL) || !between(c, TERMINATED)) {
    return refuse(c, "/*@fmi@*//*@Derivatives@*/ outside model exchange");
  }
  if ((n != STATES) || (rates == NULL)) {
    return refuse(c, "wrong number of states");
  }
  update(body_of(c));
  (void)memcpy(rates, body_of(c)->rate, n * sizeof rates[0]);
  for (i = 0; i < n; i++) {
    if (!isfinite(rates[i])) {
      return /*@fmi@*/Discard; /* a smaller step may do */
    }
  }
  return /*@fmi@*/OK;
}

EXPORTED /*@fmi@*/Status /*@fmi@*/GetEventIndicators(void *c, double indicators[], size_t n) {
  if ((c == NULL) || !between(c, TERMINATED)) {
    return refuse(c, "/*@fmi@*/GetEventIndicators outside model exchange");
  }
#if HAS_EVENTS
  if ((n != EVENTS) || (indicators == NULL)) {
    return refuse(c, "wrong number of event indicators");
  }
  update(body_of(c));
  (void)memcpy(indicators, body_of(c)->event, n * sizeof indicators[0]);
  return /*@fmi@*/OK;
#else
  (void)indicators;
  return (n == 0U) ? /*@fmi@*/OK : refuse(c, "there are no event indicators");
#endif
}

EXPORTED /*@fmi@*/Status /*@fmi@*/GetNominalsOfContinuousStates(void *c, double nominal[], size_t n) {
  static const double sizes[STATES] = {/*@nominals@*/};
  if ((c == NULL) || !between(c, TERMINATED)) {
    return refuse(c, "/*@fmi@*/GetNominalsOfContinuousStates outside model exchange");
  }
  if ((n != STATES) || (nominal == NULL)) {
    return refuse(c, "wrong number of states");
  }
  (void)memcpy(nominal, sizes, n * sizeof sizes[0]);
  return /*@fmi@*/OK;
}
#endif
