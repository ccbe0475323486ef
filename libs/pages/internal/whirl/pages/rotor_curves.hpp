#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor.hpp"
#include "whirl/shaft/system.hpp"

namespace whirl::pages {

/// Where the motion of a rotor is looked at: its probes; its discs where it has none.
struct RotorPlace {
  std::string name;
  Eigen::Index node = 0;
  std::optional<shaft::Probe> probe;  ///< none: of a disc
};
std::vector<RotorPlace> rotor_places(const shaft::Rotor& rotor, const shaft::System& system);

/// Amplitude (m, zero-to-peak) and phase (lag behind the shaft's angle zero, rad) over speed of each probe, or of the
/// major axis at each disc.
struct PlaceCurve {
  std::string name;
  double position = 0, angle = 0;  ///< m, rad
  Eigen::VectorXd amplitude, phase;
};
std::vector<PlaceCurve> place_curves(const shaft::Rotor& rotor, const shaft::System& system, const shaft::Response& r);

/// The unbalance response at `speeds` and, around every peak of a place, at speeds between them until the peak is known
/// to 0.2 %: a lightly damped resonance is narrower than any grid.
shaft::Response refined_response(const shaft::Rotor& rotor, const shaft::System& system, std::vector<double> speeds);

/// Warns where the rotor is unstable at a speed of [from, to], rad/s: what is printed there no rotor reaches.
std::optional<shaft::Threshold> warn_if_unstable(const shaft::System& system, double from, double to, Summary& summary);

}  // namespace whirl::pages
