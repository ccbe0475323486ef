#include "phase.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kTurn = 2 * std::numbers::pi;

VectorXd continuous_phase(const Eigen::VectorXcd& vector) {
  VectorXd lead = vector.array().arg();
  for (Index i = 1; i < lead.size(); ++i) lead(i) -= kTurn * std::round((lead(i) - lead(i - 1)) / kTurn);
  return lead;
}

}  // namespace

VectorXd phase_with_gaps(const Eigen::VectorXcd& values) {
  VectorXd phase = values.array().arg();
  for (Index i = phase.size() - 1; i > 0; --i) {
    if (std::abs(phase(i) - phase(i - 1)) > std::numbers::pi) phase(i) = NAN;
  }
  return phase;
}

void draw_phases(Panel& panel, const std::vector<PhaseCurve>& curves) {
  const bool winds = std::ranges::any_of(curves, [](const PhaseCurve& c) {
    const VectorXd lead = continuous_phase(c.vector);
    return lead.size() > 0 && lead.maxCoeff() - lead.minCoeff() > 1.5 * kTurn;
  });
  if (winds) panel.y.low = -std::numbers::pi, panel.y.high = std::numbers::pi;
  for (const PhaseCurve& c : curves)
    panel.line("", c.x, winds ? phase_with_gaps(c.vector) : continuous_phase(c.vector), c.style);
}

}  // namespace whirl::report
