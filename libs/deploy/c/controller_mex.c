/* MATLAB and Octave function around /*@prefix@*/.c. Build:  mex /*@prefix@*/_mex.c /*@prefix@*/.c -output /*@prefix@*/
   (Octave: mkoctfile --mex --output /*@prefix@*/.mex /*@prefix@*/_mex.c /*@prefix@*/.c).

     state = /*@prefix@*/();                       memory of a controller with its default parameters
     [out, state] = /*@prefix@*/(state, sample);   one sample; call every sample time

   sample = [x y beta omega omega_dot valid], SI; out = [ux uy s_x s_y x y vx vy status]. */
#include "/*@prefix@*/.h"

#include <mex.h>
#include <string.h>

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
    const double *sample;
    double *result;
    whirl_input input;
    whirl_output output;
    whirl_status status;
    if ((n_in != 2) || (mxGetNumberOfElements(in[0]) != sizeof state) || (mxGetNumberOfElements(in[1]) != 6)) {
      mexErrMsgTxt("usage: [out, state] = /*@prefix@*/(state, [x y beta omega omega_dot valid])");
    }
    memcpy(&state, mxGetData(in[0]), sizeof state);
    sample = mxGetPr(in[1]);
    input.x = (whirl_real)sample[0];
    input.y = (whirl_real)sample[1];
    input.beta = (whirl_real)sample[2];
    input.omega = (whirl_real)sample[3];
    input.omega_dot = (whirl_real)sample[4];
    input.valid = (sample[5] != 0.0);
    status = whirl_step(&state, &input, &output);
    out[0] = mxCreateDoubleMatrix(1, 9, mxREAL);
    result = mxGetPr(out[0]);
    result[0] = (double)output.ux;
    result[1] = (double)output.uy;
    result[2] = (double)output.s_x;
    result[3] = (double)output.s_y;
    result[4] = (double)output.x;
    result[5] = (double)output.y;
    result[6] = (double)output.vx;
    result[7] = (double)output.vy;
    result[8] = (double)status;
    if (n_out > 1) {
      out[1] = mxCreateNumericMatrix(1, (mwSize)sizeof state, mxUINT8_CLASS, mxREAL);
      memcpy(mxGetData(out[1]), &state, sizeof state);
    }
  }
}
