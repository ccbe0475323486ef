
int32_t whirl_set_parameter(whirl_state *state, int32_t number, whirl_real value) {
  whirl_params next = state->params;
  int32_t wrong = 0;
  switch (number) {
/*@parameter_cases@*/
    default:
      wrong = number;
      break;
  }
  if ((number >= 1) && (number <= WHIRL_PARAMETERS)) {
    wrong = whirl_set_params(state, &next);
  }
  return wrong;
}

const char *whirl_parameter_name(int32_t number) {
  static const char *const names[WHIRL_PARAMETERS] = {
/*@parameter_names@*/
  };
  return ((number >= 1) && (number <= WHIRL_PARAMETERS)) ? names[number - 1] : "";
}
