#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/report/figure.hpp"

namespace whirl::report {

/// Phase in (-pi, pi] with a gap where it wraps, so that no vertical line is drawn there.
Eigen::VectorXd phase_with_gaps(const Eigen::VectorXcd& values);

struct PhaseCurve {
  Eigen::VectorXd x;
  Eigen::VectorXcd vector;
  Style style;
};
/// Phases without jumps, from the first value on: through resonance they fall by half a turn. Where one of them goes
/// through more than a turn and a half, as beside a free vibration or in noise, its whole turns mean nothing: all are
/// then drawn in -180 to 180 degrees.
void draw_phases(Panel& panel, const std::vector<PhaseCurve>& curves);

}  // namespace whirl::report
