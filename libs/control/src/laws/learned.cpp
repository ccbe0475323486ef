#include "whirl/control/laws/learned.hpp"

#include <fmt/format.h>

#include "parameters.hpp"
#include "whirl/control/lateral_model.hpp"

namespace whirl::control {
namespace {

constexpr double kMostWeight = 3;

/// A group of weights: name_first, name_first+1, ... Their fallbacks are where training starts: nearly PD, and an
/// adaptation whose gain turns from 1 + i far below the critical speed over i to -1 + i above it, as the response does.
void add_weights(std::vector<ParameterInfo>& out, const char* name, const char* meaning, int first,
                 std::initializer_list<double> fallback) {
  for (const double value : fallback) {
    out.push_back({fmt::format("{}_{}", name, first++), "1", meaning, value, -100, 100, -kMostWeight, kMostWeight});
  }
}

std::vector<ParameterInfo> weights() {
  std::vector<ParameterInfo> out;
  add_weights(out, "unit_x", "p: weight of the displacement in a unit of the feedback", 1, {1, 0, 0.5});
  add_weights(out, "unit_v", "q: weight of the velocity in a unit of the feedback", 1, {0, 1, 0.5});
  add_weights(out, "unit_a", "w: weight of a unit in the acceleration", 1, {0, 0.1, 0});
  add_weights(out, "speed_a", "a: weight of the speed in a unit of the adaptation", 1, {1, 2, 3});
  add_weights(out, "speed_b", "b: offset of a unit of the adaptation", 1, {-1, -2, -3});
  add_weights(out, "gain_re", "g: real part of the gain of the adaptation", 0, {0, 0, 0, -1});
  add_weights(out, "gain_im", "g: imaginary part of the gain of the adaptation", 0, {1, 0, 0, 0});
  return out;
}

std::vector<ParameterInfo> learned_parameters() {
  std::vector<ParameterInfo> out{kKp,
                                 kKd,
                                 kPerTime,
                                 kSlow,
                                 {"position_scale", "m", "L, displacement taken as 1", 1e-4, 1e-9, 1e3, 0, 0},
                                 {"velocity_scale", "m/s", "V, velocity taken as 1", 1e-2, 1e-9, 1e3, 0, 0},
                                 {"control_scale", "m/s^2", "A, acceleration taken as 1", 1, 1e-9, 1e6, 0, 0},
                                 {"speed_scale", "rad/s", "W, speed taken as 1", 75, 1e-3, 1e6, 0, 0}};
  for (const ParameterInfo& w : weights()) out.push_back(w);
  return out;
}

AnyLaw make_learned(const ControllerDesign& d, const Parameters& v) {
  LearnedFeedback axis{.kp = v.at("kp"),
                       .kd = v.at("kd"),
                       .position = v.at("position_scale"),
                       .velocity = v.at("velocity_scale"),
                       .acceleration = v.at("control_scale")};
  LearnedSynchronous::Weights s;
  const auto at = [&](const char* name, std::size_t i) { return v.at(fmt::format("{}_{}", name, i)); };
  for (std::size_t i = 0; i < LearnedFeedback::kUnits; ++i) {
    axis.from_position[i] = at("unit_x", i + 1);
    axis.from_velocity[i] = at("unit_v", i + 1);
    axis.to_force[i] = at("unit_a", i + 1);
    s.slope[i] = at("speed_a", i + 1);
    s.bias[i] = at("speed_b", i + 1);
  }
  for (std::size_t i = 0; i <= LearnedSynchronous::kUnits; ++i) s.gain[i] = {at("gain_re", i), at("gain_im", i)};
  s.rate = v.at("adaptation"), s.speed = v.at("speed_scale"), s.speed_min = v.at("speed_min");
  s.sample_time = d.sample_time;
  return LearnedPolicy{axis, axis, LearnedSynchronous(s)};
}

/// A tenth of the eccentricity, at the critical speed.
Parameters learned_measures(const ControllerDesign& d, double) {
  const double omega = d.model.natural_frequency(), length = std::max(0.1 * std::abs(d.model.eps), 5e-6);
  return {{"position_scale", length},
          {"velocity_scale", length * omega},
          {"control_scale", length * omega * omega},
          {"speed_scale", omega}};
}

}  // namespace

std::complex<double> LearnedSynchronous::step(std::complex<double> z, double beta, double omega,
                                              std::complex<double> forcing, bool adapt) noexcept {
  const double speed = std::abs(omega);
  if (adapt && speed >= w_.speed_min) {
    std::complex<double> m = w_.gain[0];
    for (std::size_t i = 0; i < kUnits; ++i)
      m += w_.gain[i + 1] * std::tanh(w_.slope[i] * (speed / w_.speed) + w_.bias[i]);
    q_ -= w_.sample_time * w_.rate * product(omega < 0 ? std::conj(m) : m, product(z, unit_phasor(-beta)));
  }
  return product(q_, forcing);
}

LawEntry learned_law() {
  std::vector<std::string> names;
  for (const ParameterInfo& w : weights()) names.push_back(w.name);
  return {
      .info = {"learned", "policy learned on random machines", "sep-CMA-ES: Ros, Hansen 2008", learned_parameters()},
      .equation =
          "     a = -kp x - kd v - A sum w tanh(p x/L + q v/V) - d, and the canceller of the synchronous motion "
          "below,\n   its gain a tanh layer of the speed; weights found by trial on random machines",
      .latex = equations({R"(a = -k_p x - k_d v - A \sum_i w_i \tanh(p_i x/L + q_i v/V) - d + q F)",
                          R"(\dot q = -\mu z e^{-i\beta} \left(g_0 + \sum_i g_i \tanh(a_i \omega/W + b_i)\right))"}),
      .make = make_learned,
      .code = [](const Parameters&) { return CodeFragment{"learned"}; },
      .model_free = true,
      .cancels_synchronous = true,
      .weights = names,
      .measures = learned_measures};
}

}  // namespace whirl::control
