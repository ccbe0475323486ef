#include "phase.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "whirl/core/angles.hpp"

namespace whirl::report {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

VectorXd continuous_phase(const Eigen::VectorXcd& vector) {
  VectorXd lead = vector.array().arg();
  double last = NAN;
  for (double& phase : lead) {
    if (std::isfinite(last)) phase -= kTwoPi * std::round((phase - last) / kTwoPi);
    if (std::isfinite(phase)) last = phase;
  }
  return lead;
}

}  // namespace

VectorXd phase_with_gaps(const Eigen::VectorXcd& values, double centre) {
  VectorXd phase = (values * std::polar(1.0, -centre)).array().arg() + centre;
  for (Index i = phase.size() - 1; i > 0; --i) {
    if (std::abs(phase(i) - phase(i - 1)) > std::numbers::pi) phase(i) = NAN;
  }
  return phase;
}

std::string phase_name(Phase phase) { return phase == Phase::lag ? "phase lag" : "phase lead"; }

void draw_phases(Panel& panel, const std::vector<PhaseCurve>& curves, Phase convention) {
  const bool winds = std::ranges::any_of(curves, [](const PhaseCurve& c) {
    const VectorXd lead = continuous_phase(c.vector);
    return lead.size() > 0 &&
           lead.maxCoeff<Eigen::PropagateNumbers>() - lead.minCoeff<Eigen::PropagateNumbers>() > 1.5 * kTwoPi;
  });
  const double sign = convention == Phase::lag ? -1 : 1;
  double centre = 0;
  if (winds) {
    // The turn in which the curves leave it least often.
    Index fewest = std::numeric_limits<Index>::max();
    for (const double quarter : {0.0, 0.25, 0.5, -0.25}) {
      Index gaps = 0;
      for (const PhaseCurve& c : curves) gaps += phase_with_gaps(c.vector, quarter * kTwoPi).array().isNaN().count();
      if (gaps < fewest) fewest = gaps, centre = quarter * kTwoPi;
    }
    if (sign * centre < -2) centre = -centre;  // 0 to 360 degrees rather than -360 to 0
    panel.y.low = sign * centre - std::numbers::pi;
    panel.y.high = sign * centre + std::numbers::pi;
  }
  for (const PhaseCurve& c : curves) {
    VectorXd phase = winds ? phase_with_gaps(c.vector, centre) : continuous_phase(c.vector);
    for (Index i = 0; i < phase.size(); ++i) {
      if (std::abs(c.vector(i)) < c.least) phase(i) = NAN;
    }
    panel.line("", c.x, sign * phase, c.style);
  }
}

}  // namespace whirl::report
