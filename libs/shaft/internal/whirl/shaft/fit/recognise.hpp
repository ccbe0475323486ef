#pragma once
#include <string>
#include <vector>

#include "whirl/io/json.hpp"
#include "whirl/shaft/fit/fit.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {

/// A rotor that may be on the machine: its file, and its run as the probes of that file see it.
struct RotorCandidate {
  std::string name;
  RotorJob job;
  OrderRun run;
};

/// Torque of the drive beyond its losses while the record was made.
struct DriveTorque {
  double value = 0;         ///< N m, constant; 0: not known
  double tolerance = 0.05;  ///< half width, relative
};

struct CandidateFit {
  std::string name;
  FitMisfit misfit;          ///< with what [fit] and its tolerances leave open
  double inertia = 0;        ///< polar, of the file, kg m^2
  bool explains = false;     ///< the vectors
  bool inertia_fits = true;  ///< true where the torque is not known
  bool possible() const { return explains && inertia_fits; }
};

/// Which rotor is on it? Those whose drawing explains the vectors of a run, and whose inertia explains its
/// acceleration.
struct RotorRecognition {
  std::vector<CandidateFit> candidates;  ///< in the order given
  Estimate inertia;                      ///< torque over acceleration, with the tolerance of the torque; NaN: not known
  Summary summary;                       ///< not usable where none is possible; a warning where several are
};

/// Throws Error for fewer than two candidates, and as `fit_rotor`.
RotorRecognition recognise_rotor(const std::vector<RotorCandidate>& candidates, const DriveTorque& torque,
                                 const FitOptions& options = {});

/// `whirl.rotor_which/1`.
io::Json to_json(const RotorRecognition& found);

}  // namespace whirl::shaft
