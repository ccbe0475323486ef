#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/report/rotor_figures.hpp"

namespace whirl::report {

/// Phase within half a turn of `centre` (rad) with a gap where it wraps, so that no vertical line is drawn there.
Eigen::VectorXd phase_with_gaps(const Eigen::VectorXcd& values, double centre = 0);

struct PhaseCurve {
  Eigen::VectorXd x;
  Eigen::VectorXcd vector;
  Style style;
  double least = 0;  ///< amplitude below which a phase means nothing and is not drawn
};
/// Phases without jumps, from the first value on: through resonance they fall by half a turn. Where one of them goes
/// through more than a turn and a half, as beside a free vibration or in noise, its whole turns mean nothing: all are
/// then drawn within one turn, the one with the fewest gaps.
void draw_phases(Panel& panel, const std::vector<PhaseCurve>& curves, Phase phase);

/// "phase lag" or "phase lead".
std::string phase_name(Phase phase);

}  // namespace whirl::report
