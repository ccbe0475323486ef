/* One step with plain numbers: in = x, y, beta, omega, omega_dot, valid; out = ux, uy, s_x, s_y, x, y, vx, vy, status. */
static void step_values(whirl_state *state, const double *in, double *out) {
  whirl_input input;
  whirl_output output;
  whirl_status status;
  input.x = (whirl_real)in[0];
  input.y = (whirl_real)in[1];
  input.beta = (whirl_real)in[2];
  input.omega = (whirl_real)in[3];
  input.omega_dot = (whirl_real)in[4];
  input.valid = (in[5] != 0.0);
  status = whirl_step(state, &input, &output);
  out[0] = (double)output.ux;
  out[1] = (double)output.uy;
  out[2] = (double)output.s_x;
  out[3] = (double)output.s_y;
  out[4] = (double)output.x;
  out[5] = (double)output.y;
  out[6] = (double)output.vx;
  out[7] = (double)output.vy;
  out[8] = (double)status;
}
