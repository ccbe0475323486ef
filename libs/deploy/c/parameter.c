
/* The numbers as one row: every field of whirl_params is a whirl_real. */
typedef union {
  whirl_params named;
  whirl_real row[WHIRL_PARAMETERS];
} whirl_numbers;

int32_t whirl_set_parameter(whirl_state *state, int32_t number, whirl_real value) {
  int32_t wrong = number;
  if ((number >= 1) && (number <= WHIRL_PARAMETERS)) {
    whirl_numbers all;
    all.named = state->params;
    all.row[number - 1] = value;
    wrong = whirl_set_params(state, &all.named);
  }
  return wrong;
}

const char *whirl_parameter_name(int32_t number) {
  static const char *const names[WHIRL_PARAMETERS] = {
/*@parameter_names@*/
  };
  return ((number >= 1) && (number <= WHIRL_PARAMETERS)) ? names[number - 1] : "";
}
