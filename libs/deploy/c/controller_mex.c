/* MATLAB and Octave function around /*@prefix@*/.c. Build:  mex /*@prefix@*/_mex.c /*@prefix@*/.c -output /*@prefix@*/
   (Octave: mkoctfile --mex --output /*@prefix@*/.mex /*@prefix@*/_mex.c /*@prefix@*/.c).

     state = /*@prefix@*/();                       memory of a controller with its default parameters
     [out, state] = /*@prefix@*/(state, sample);   one sample; call every sample time

   sample = [x y beta omega omega_dot valid], SI; out = [ux uy s_x s_y x y vx vy status]. */
#include "/*@prefix@*/.h"

#include <mex.h>
#include <string.h>

/*@step_values@*/

void mexFunction(int n_out, mxArray *out[], int n_in, const mxArray *in[]) {
  whirl_state state;
  if (n_in == 0) {
    whirl_params params;
    memset(&state, 0, sizeof state);
    whirl_default_params(&params);
    (void)whirl_init(&state, &params);
    out[0] = mxCreateNumericMatrix(1, (mwSize)sizeof state, mxUINT8_CLASS, mxREAL);
    memcpy(mxGetData(out[0]), &state, sizeof state);
  } else {
    if ((n_in != 2) || (mxGetNumberOfElements(in[0]) != sizeof state) || (mxGetNumberOfElements(in[1]) != 6)) {
      mexErrMsgTxt("usage: [out, state] = /*@prefix@*/(state, [x y beta omega omega_dot valid])");
    }
    memcpy(&state, mxGetData(in[0]), sizeof state);
    out[0] = mxCreateDoubleMatrix(1, 9, mxREAL);
    step_values(&state, mxGetPr(in[1]), mxGetPr(out[0]));
    if (n_out > 1) {
      out[1] = mxCreateNumericMatrix(1, (mwSize)sizeof state, mxUINT8_CLASS, mxREAL);
      memcpy(mxGetData(out[1]), &state, sizeof state);
    }
  }
}
