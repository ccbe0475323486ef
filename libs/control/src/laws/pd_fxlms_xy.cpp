#include "whirl/control/laws/pd_fxlms_xy.hpp"

#include <cmath>

#include "parameters.hpp"

namespace whirl::control {

MultiChannelLms::Response MultiChannelLms::response(double omega) const noexcept {
  const double w2 = omega * omega;
  const Complex feedback = product({kp_, omega * kd_}, unit_phasor(-omega * delay_));
  const Complex mean = Complex(model_.k1 - w2, omega * model_.c) + feedback;
  const Complex apart(model_.k1_conj.real(), omega * model_.c_conj.real());
  const Complex across(model_.k1_conj.imag(), omega * model_.c_conj.imag());
  // The dynamic stiffness of both axes, symmetric, inverted.
  const Complex dx = mean + apart, dy = mean - apart;
  const Complex scale = w2 / (product(dx, dy) - product(across, across));
  Response g{product(dy, scale), product(-across, scale), product(dx, scale)};
  const double first = std::norm(g.xx) + std::norm(g.xy), second = std::norm(g.xy) + std::norm(g.yy);
  const Complex mixed = product(std::conj(g.xx), g.xy) + product(std::conj(g.xy), g.yy);
  const double half = 0.5 * (first - second);
  g.largest = 0.5 * (first + second) + std::sqrt(half * half + std::norm(mixed));
  return g;
}

MultiChannelLms::Complex MultiChannelLms::step(Complex z, double beta, double omega, Complex forcing,
                                               bool adapt) noexcept {
  if (adapt && std::abs(omega) >= omega_min_) {
    const Response g = response(omega);
    const Complex back = unit_phasor(-beta), ex = z.real() * back, ey = z.imag() * back;
    const double step = 2 * h_ * rate_ / g.largest;
    w_[0] -= step * (product(std::conj(g.xx), ex) + product(std::conj(g.xy), ey));
    w_[1] -= step * (product(std::conj(g.xy), ex) + product(std::conj(g.yy), ey));
  }
  return {product(w_[0], forcing).real(), product(w_[1], forcing).real()};
}

LawEntry pd_fxlms_xy_law() {
  ParameterInfo slow = kSlow;
  slow.low = 1e-3;  // at rest nothing answers to an unbalance
  return {.info = {"pd_fxlms_xy",
                   "PD with multi-channel filtered-x LMS at 1x",
                   "Elliott, Stothers, Nelson 1987; step size from the model",
                   {kKp, kKd, kPerTime, slow}},
          .equation = std::string(kPdText) +
                      ", and the canceller of the synchronous motion below: filtered-x LMS, a weight for each axis",
          .latex =
              equations({R"(a = -k_p z - k_d \dot z - d + \mathrm{Re}(w_x F) + i\,\mathrm{Re}(w_y F))",
                         R"(w \leftarrow w - h \mu G^{H} E / \lambda_{\max}(G^{H} G))", R"(E = 2 (x, y) e^{-i\beta})"}),
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyLaw {
            const double h = d.sample_time, delay = v.at("predict") > 0 ? 0 : d.delay + 0.5 * h;
            const Pd pd{v.at("kp"), v.at("kd")};
            return MultiChannelPd{pd, pd,
                                  MultiChannelLms(v.at("adaptation"), pd.kp, pd.kd, LateralModel::from(d.model), delay,
                                                  h, v.at("speed_min"))};
          },
          .code = [](const Parameters&) { return CodeFragment{"pd_fxlms_xy"}; },
          .model_free = true,
          .cancels_synchronous = true};
}

}  // namespace whirl::control
