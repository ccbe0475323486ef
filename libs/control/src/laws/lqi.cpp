#include "whirl/control/laws/lqi.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "parameters.hpp"
#include "whirl/control/laws/lqi_gains.hpp"
#include "whirl/control/laws/mpc.hpp"
#include "whirl/core/riccati.hpp"

namespace whirl::control {
namespace {

constexpr std::size_t kLqiNodes = TurningFeedback::kNodes;
constexpr std::array kGainParts{"position_re", "position_im", "velocity_re",
                                "velocity_im", "integral_re", "integral_im"};

std::vector<ParameterInfo> lqi_parameters() {
  std::vector<ParameterInfo> out = quadratic_weights();
  out.push_back(
      {"integral_scale", "m s", "turning integral of the displacement weighted as 1", 1e-4, 1e-12, 1e3, 1e-6, 1e-2});
  out.push_back({"speed_min", "rad/s", "no adaptation below this speed", 10, 1e-3, 1e6, 0, 0});
  out.push_back({"speed_top", "rad/s", "highest speed of the table of gains", 200, 1, 1e6, 0, 0});
  return out;
}

using GainTable = SpeedTable<kLqiNodes, kGainParts.size()>;

GainTable gain_table(const ControllerDesign& d, const Parameters& v) {
  const LqiScales scales{v.at("position_scale"), v.at("velocity_scale"), v.at("integral_scale"), v.at("control_scale")};
  GainTable out;
  for (std::size_t k = 0; k < kLqiNodes; ++k) {
    out.speed[k] = v.at("speed_top") * static_cast<double>(k) / static_cast<double>(kLqiNodes - 1);
    const LqiGains g = lqi_gains(d.model.k1, d.model.c, out.speed[k], d.sample_time, scales);
    out.value[k] = {g.z.real(), g.z.imag(), g.v.real(), g.v.imag(), g.integral.real(), g.integral.imag()};
  }
  return out;
}

AnyLaw make_lqi(const ControllerDesign& d, const Parameters& v) {
  const GainTable all = gain_table(d, v);
  TurningFeedback::Table feedback{all.speed, {}};
  TurningIntegral::Table integral{all.speed, {}};
  for (std::size_t k = 0; k < kLqiNodes; ++k) {
    const auto& g = all.value[k];
    feedback.value[k] = {g[0], g[1], g[2], g[3]};
    integral.value[k] = {g[4], g[5]};
  }
  return IntegralRegulator{
      {0, 0}, {0, 0}, TurningFeedback(feedback), TurningIntegral(integral, d.sample_time, v.at("speed_min"))};
}

/// In the exported C the gains themselves are parameters.
std::vector<std::pair<ParameterInfo, double>> lqi_code_parameters(const ControllerDesign& d, const Parameters& v) {
  std::vector<std::pair<ParameterInfo, double>> out;
  for (const ParameterInfo& info : lqi_parameters()) {
    if (info.name.starts_with("speed_")) out.emplace_back(info, v.at(info.name));
  }
  const GainTable all = gain_table(d, v);
  for (std::size_t k = 0; k < kLqiNodes; ++k) {
    for (std::size_t i = 0; i < kGainParts.size(); ++i) {
      const char* unit = i < 2 ? "1/s^2" : i < 4 ? "1/s" : "1/s^3";
      out.emplace_back(
          ParameterInfo{fmt::format("{}_{}", kGainParts[i], k), unit,
                        fmt::format("gain at {} of {} parts of speed_top", k, kLqiNodes - 1), 0, -1e15, 1e15},
          all.value[k][i]);
    }
  }
  return out;
}

CodeFragment lqi_code(const Parameters&) {
  CodeFragment out{"lqi"};
  std::string& lines = out.slots["gain_lines"];
  for (std::size_t k = 0; k < kLqiNodes; ++k) {
    for (std::size_t i = 0; i < kGainParts.size(); ++i) {
      lines +=
          fmt::format("{}    state->gains[{}][{}] = params->{}_{};", lines.empty() ? "" : "\n", k, i, kGainParts[i], k);
    }
  }
  return out;
}

/// A little above the run, so that slip of a drive stays inside the table.
Parameters lqi_measures(const ControllerDesign&, double top_speed) {
  constexpr double kAbove = 1.05;
  return top_speed > 0 ? Parameters{{"speed_top", kAbove * top_speed}} : Parameters{};
}

}  // namespace

LqiGains lqi_gains(double k1, double c, double omega, double h, const LqiScales& s) {
  const SampledAxis axis = sample_axis(k1, c, h);
  const std::complex<double> turn = unit_phasor(omega * h);
  Eigen::MatrixXcd a(3, 3), b(3, 1), q = Eigen::MatrixXcd::Zero(3, 3);
  a << axis.a00, axis.a01, 0, axis.a10, axis.a11, 0, h * turn, 0, turn;
  b << axis.b0, axis.b1, 0;
  q.diagonal() << std::pow(s.position, -2), std::pow(s.velocity, -2), std::pow(s.integral, -2);
  const Eigen::MatrixXcd r = Eigen::MatrixXcd::Constant(1, 1, std::pow(s.control, -2));
  const Riccati<Eigen::MatrixXcd> found = solve_riccati<Eigen::MatrixXcd>(a, b, q, r);
  const Eigen::MatrixXcd gain = riccati_gain<Eigen::MatrixXcd>(a, b, r, found.solution);
  LqiGains out{gain(0, 0), gain(0, 1), gain(0, 2), found.residual};
  out.spectral_radius = Eigen::MatrixXcd(a - b * gain).eigenvalues().cwiseAbs().maxCoeff();
  return out;
}

LawEntry lqi_law() {
  return {.info = {"lqi", "linear-quadratic control with an integral state at 1x",
                   "discrete Riccati equation at every speed of a table", lqi_parameters()},
          .equation =
              "     a = -K_z z - K_v v - K_i eta - d,  eta' = i omega eta + z in the complex coordinate; the complex\n"
              "   gains are straight lines between those of Riccati equations at 12 speeds",
          .latex = equations({R"(a = -K_z(\omega) z - K_v(\omega) \dot z - K_i(\omega) \eta - d)",
                              R"(\dot \eta = i \omega \eta + z)"}),
          .make = make_lqi,
          .code = lqi_code,
          .model_free = true,
          .cancels_synchronous = true,
          .code_parameters = lqi_code_parameters,
          .measures = lqi_measures};
}

}  // namespace whirl::control
