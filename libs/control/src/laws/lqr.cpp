#include "whirl/control/laws/lqr.hpp"

#include <algorithm>
#include <cmath>

#include "parameters.hpp"

namespace whirl::control {
namespace {

LqrGains gains(const ControllerDesign& d, const Parameters& v) {
  return lqr_gains(d.model.k1, d.model.c, d.sample_time, v.at("position_scale"), v.at("velocity_scale"),
                   v.at("control_scale"));
}

}  // namespace

LqrGains lqr_gains(double k1, double c, double h, double x_scale, double v_scale, double a_scale) {
  const SampledAxis axis = sample_axis(k1, c, h);
  const double a00 = axis.a00, a01 = axis.a01, a10 = axis.a10, a11 = axis.a11, b0 = axis.b0, b1 = axis.b1;
  const double q0 = 1 / (x_scale * x_scale), q1 = 1 / (v_scale * v_scale), r = 1 / (a_scale * a_scale);
  double p00 = q0, p01 = 0, p11 = q1;
  LqrGains out;
  const auto iterate = [&](double& n00, double& n01, double& n11) {
    const double pb0 = p00 * b0 + p01 * b1, pb1 = p01 * b0 + p11 * b1, s = r + b0 * pb0 + b1 * pb1;
    out.kp = (pb0 * a00 + pb1 * a10) / s;
    out.kd = (pb0 * a01 + pb1 * a11) / s;
    const double m00 = p00 * a00 + p01 * a10, m01 = p00 * a01 + p01 * a11;
    const double m10 = p01 * a00 + p11 * a10, m11 = p01 * a01 + p11 * a11;
    n00 = a00 * m00 + a10 * m10 - s * out.kp * out.kp + q0;
    n01 = a00 * m01 + a10 * m11 - s * out.kp * out.kd;
    n11 = a01 * m01 + a11 * m11 - s * out.kd * out.kd + q1;
  };
  for (int i = 0; i < 200000; ++i) {
    double n00, n01, n11;
    iterate(n00, n01, n11);
    const double change = std::abs(n00 - p00) / n00 + std::abs(n11 - p11) / n11;
    p00 = n00, p01 = n01, p11 = n11;
    if (change < 1e-14) break;
  }
  double n00, n01, n11;
  iterate(n00, n01, n11);
  out.residual = std::max({std::abs(n00 - p00) / p00, std::abs(n01 - p01) / p00, std::abs(n11 - p11) / p11});
  const double c00 = a00 - b0 * out.kp, c01 = a01 - b0 * out.kd, c10 = a10 - b1 * out.kp, c11 = a11 - b1 * out.kd;
  const double half = 0.5 * (c00 + c11), det = c00 * c11 - c01 * c10, disc = half * half - det;
  out.spectral_radius = disc >= 0 ? std::abs(half) + std::sqrt(disc) : std::sqrt(det);
  return out;
}

std::vector<ParameterInfo> quadratic_weights() {
  return {{"position_scale", "m", "displacement weighted as 1", 1e-3, 1e-9, 1e3, 1e-5, 1e-2},
          {"velocity_scale", "m/s", "velocity weighted as 1", 0.05, 1e-9, 1e3, 1e-3, 1},
          {"control_scale", "m/s^2", "control acceleration weighted as 1", 3, 1e-9, 1e6, 0, 0}};
}

LawEntry lqr_law() {
  return {
      .info = {"lqr", "linear-quadratic regulator", "discrete Riccati equation, predicted state", quadratic_weights()},
      .equation = std::string(kPdText) + ", gains of the discrete Riccati equation",
      .latex = kPdLatex,
      .make =
          [](const ControllerDesign& d, const Parameters& v) {
            const LqrGains g = gains(d, v);
            return both(Pd{g.kp, g.kd});
          },
      .code = [](const Parameters&) { return CodeFragment{"pd"}; },
      .model_free = true,
      .code_parameters =
          [](const ControllerDesign& d, const Parameters& v) {
            const LqrGains g = gains(d, v);
            return std::vector<std::pair<ParameterInfo, double>>{{kKp, g.kp}, {kKd, g.kd}};
          }};
}

}  // namespace whirl::control
