/* MATLAB and Octave function around /*@prefix@*/.c. Build:  mex /*@prefix@*/_mex.c /*@prefix@*/.c -output /*@prefix@*/
   (Octave: mkoctfile --mex --output /*@prefix@*/.mex /*@prefix@*/_mex.c /*@prefix@*/.c).

     state = /*@prefix@*/();                       memory of a controller with its default parameters
     [out, state] = /*@prefix@*/(state, sample);   one sample; call every sample time
     state = /*@prefix@*/(state, 'surface_gain', 80);  a parameter (fields of /*@prefix@*/_params), checked; memory kept
     [names, values] = /*@prefix@*/(state, 'parameters');

   sample = [x y beta omega omega_dot valid], SI; out = [ux uy s_x s_y x y vx vy status]. */
#include "/*@prefix@*/.h"

#include <mex.h>
#include <string.h>

/*@step_values@*/

/* Number of the parameter that `name` names; 0: none. */
static int32_t number_of(const mxArray *name) {
  char text[64] = "";
  int32_t i;
  if (mxGetString(name, text, sizeof text) != 0) {
    return 0;
  }
  for (i = 1; i <= WHIRL_PARAMETERS; i++) {
    if (strcmp(text, whirl_parameter_name(i)) == 0) {
      return i;
    }
  }
  return 0;
}

static mxArray *packed(const whirl_state *state) {
  mxArray *const out = mxCreateNumericMatrix(1, (mwSize)sizeof *state, mxUINT8_CLASS, mxREAL);
  memcpy(mxGetData(out), state, sizeof *state);
  return out;
}

static void refuse(int32_t number) {
  mexErrMsgIdAndTxt("/*@prefix@*/:range", "parameter %s is out of its range", whirl_parameter_name(number));
}

void mexFunction(int n_out, mxArray *out[], int n_in, const mxArray *in[]) {
  whirl_state state;
  if (n_in == 0) {
    whirl_params params;
    int32_t wrong;
    memset(&state, 0, sizeof state);
    whirl_default_params(&params);
    wrong = whirl_init(&state, &params);
    if (wrong != 0) {
      refuse(wrong);
    }
    out[0] = packed(&state);
    return;
  }
  if ((n_in > 3) || (mxGetNumberOfElements(in[0]) != sizeof state) || (n_in < 2) ||
      ((n_in == 3) != (mxIsChar(in[1]) && (number_of(in[1]) != 0))) ||
      ((n_in == 3) && (mxGetNumberOfElements(in[2]) != 1)) ||
      ((n_in == 2) && !mxIsChar(in[1]) && (mxGetNumberOfElements(in[1]) != 6))) {
    mexErrMsgTxt("usage: [out, state] = /*@prefix@*/(state, [x y beta omega omega_dot valid]), or state = "
                 "/*@prefix@*/(state, 'parameter', value)");
  }
  memcpy(&state, mxGetData(in[0]), sizeof state);
  if (n_in == 3) {
    const int32_t wrong = whirl_set_parameter(&state, number_of(in[1]), (whirl_real)mxGetScalar(in[2]));
    if (wrong != 0) {
      refuse(wrong);
    }
    out[0] = packed(&state);
  } else if (mxIsChar(in[1])) {
    const whirl_real *const row = (const whirl_real *)&state.params;
    int32_t i;
    out[0] = mxCreateCellMatrix(1, WHIRL_PARAMETERS);
    for (i = 0; i < WHIRL_PARAMETERS; i++) {
      mxSetCell(out[0], (mwIndex)i, mxCreateString(whirl_parameter_name(i + 1)));
    }
    if (n_out > 1) {
      out[1] = mxCreateDoubleMatrix(1, WHIRL_PARAMETERS, mxREAL);
      for (i = 0; i < WHIRL_PARAMETERS; i++) {
        mxGetPr(out[1])[i] = (double)row[i];
      }
    }
  } else {
    out[0] = mxCreateDoubleMatrix(1, 9, mxREAL);
    step_values(&state, mxGetPr(in[1]), mxGetPr(out[0]));
    if (n_out > 1) {
      out[1] = packed(&state);
    }
  }
}
