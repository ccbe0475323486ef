#include "whirl/tuning/sliding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/times.hpp"

namespace whirl::tuning {
namespace {

/// Slope by a straight line through 5 samples to either side, as many as there are towards the ends.
std::vector<double> slopes(const Eigen::VectorXd& s, double h) {
  constexpr Eigen::Index kSide = 5;
  std::vector<double> out(static_cast<std::size_t>(s.size()), 0.0);
  for (Eigen::Index k = 0; k < s.size(); ++k) {
    const Eigen::Index from = std::max<Eigen::Index>(0, k - kSide), to = std::min(s.size() - 1, k + kSide);
    const double middle = 0.5 * static_cast<double>(from + to);
    double sum = 0, squares = 0;
    for (Eigen::Index i = from; i <= to; ++i) {
      const double away = static_cast<double>(i) - middle;
      sum += away * s[i];
      squares += away * away;
    }
    if (squares > 0) out[static_cast<std::size_t>(k)] = sum / (squares * h);
  }
  return out;
}

/// Whether dS/dt = Delta - rho tanh(S/eps): S linear in the velocity. Laws with a power of the velocity have an
/// exponent, and no singular term that a length would regularise.
bool has_reaching_term(const std::map<std::string, double>& values) {
  const bool power_of_velocity = values.contains("exponent") && !values.contains("delta");
  return values.contains("switching_gain") && values.contains("boundary_layer") && !power_of_velocity;
}

}  // namespace

bool SlidingStudy::reached_in_time() const {
  const double tick = time.size() > 1 ? time[1] - time[0] : 0;
  return reached <= reach_bound + tick;
}

std::optional<Finding> SlidingStudy::missed() const {
  if (largest_disturbance < switching_gain) return {};
  return Finding{FindingCode::sliding_bound_missed,
                 Consequence::unusable,
                 {{"switching gain", switching_gain, "m/s^2"},
                  {"disturbance", largest_disturbance, "m/s^2"},
                  {"share of the time", share_above, ""}},
                 fmt::format(" in {:.1f} % of the run", 100 * share_above)};
}

std::optional<SlidingStudy> sliding_study(const ControllerDesign& design, const Recording& log, double skip) {
  const std::map<std::string, double> values = control::resolve_parameters(design);
  if (!has_reaching_term(values)) return {};
  SlidingStudy out;
  out.skip = skip;
  out.switching_gain = values.at("switching_gain");
  const double rho = out.switching_gain, eps = values.at("boundary_layer");
  const auto n = static_cast<std::size_t>(log.size());
  const auto first = std::min(n, static_cast<std::size_t>(std::lround(skip / log.dt)));
  std::array<std::vector<double>, 2> rate;
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const Eigen::VectorXd& s = log[axis == 0 ? "s_x" : "s_y"];
    out.s[axis].assign(s.data(), s.data() + s.size());
    rate[axis] = slopes(s, log.dt);
    for (std::size_t k = 0; k < n; ++k)
      out.disturbance[axis].push_back(rate[axis][k] + rho * std::tanh(out.s[axis][k] / eps));
  }
  std::size_t above = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double sx = out.s[0][k], sy = out.s[1][k];
    out.time.push_back(log.t0 + static_cast<double>(k) * log.dt);
    out.v.push_back(0.5 * (sx * sx + sy * sy));
    out.v_rate.push_back(sx * rate[0][k] + sy * rate[1][k]);
    if (k < first) continue;
    const double most = std::max(std::abs(out.disturbance[0][k]), std::abs(out.disturbance[1][k]));
    out.largest_disturbance = std::max(out.largest_disturbance, most);
    above += most >= rho;
  }
  const double kappa = 0.5 * std::max(rho - out.largest_disturbance, 0.0);
  out.layer = control::layer_residual(eps, rho, out.largest_disturbance + kappa);
  std::size_t outside = 0;
  out.reached = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < n; ++k) {
    const double sx = std::abs(out.s[0][k]), sy = std::abs(out.s[1][k]);
    out.bound.push_back(-kappa * (sx + sy));
    const bool in_layer = std::max(sx, sy) <= out.layer;
    if (!in_layer) {
      out.reached = std::numeric_limits<double>::infinity();
    } else if (!std::isfinite(out.reached)) {
      out.reached = out.time[k] - log.t0;
    }
    outside += k >= first && !in_layer && out.v_rate[k] > out.bound[k];
  }
  const double judged = static_cast<double>(std::max<std::size_t>(n - first, 1));
  out.share_above = static_cast<double>(above) / judged;
  out.share_outside = static_cast<double>(outside) / judged;
  const double s0 = n > 0 ? std::max(std::abs(out.s[0][0]), std::abs(out.s[1][0])) : 0;
  out.reach_bound = control::reach_time(s0, rho, rho - kappa);
  return out;
}

}  // namespace whirl::tuning
