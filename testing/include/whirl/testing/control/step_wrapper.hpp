#pragma once
#include <string>

namespace whirl::testing {

/// C around a controller exported with the prefix `drive`: start(), and go(x y beta omega omega_dot, valid, out) with
/// ux, uy and, of a supervised one, the supervision's word in `out`; returns the status of the step.
inline std::string step_wrapper(bool supervised = true) {
  std::string text = R"(#include "drive.h"
static drive_state state;
int start(void);
int go(const double *in, int valid, double *out);
int start(void) {
  drive_params p;
  drive_default_params(&p);
  return (int)drive_init(&state, &p);
}
int go(const double *in, int valid, double *out) {
  drive_input i;
  drive_output o;
  int status;
  i.x = in[0];
  i.y = in[1];
  i.beta = in[2];
  i.omega = in[3];
  i.omega_dot = in[4];
  i.valid = (valid != 0);
  status = (int)drive_step(&state, &i, &o);
  out[0] = o.ux;
  out[1] = o.uy;
)";
  if (supervised) text += "  out[2] = (double)o.supervision;\n";
  return text + "  return status;\n}\n";
}

}  // namespace whirl::testing
