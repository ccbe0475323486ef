#pragma once
#include <array>
#include <random>

#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::tuning {

/// Lower triangular L with L L^T = covariance of (k1, k2, c, Re eps, Im eps).
using Root = std::array<std::array<double, 5>, 5>;

struct DrawnRig {
  RotorModel rotor;
  rig::RigParameters rig;
  std::uint64_t noise_seed = 1;
};

/// Rig number i of a study, a function of (seed, i) alone.
class RigDraw {
 public:
  /// `removed`: the runout that the controller takes out of its readings, for MonteCarloOptions::other_machines.
  RigDraw(const RotorModel& centre, const IdentifiedModel& model, const Hardware& hardware,
          const MonteCarloOptions& options, const control::Runout& removed = {});
  DrawnRig operator()(int sample) const;

 private:
  RotorModel centre_;
  Hardware hardware_;
  MonteCarloOptions options_;
  control::Runout removed_;
  Root root_;
  rotor::FurtherForces<double> forces_sd_;  ///< standard deviations, each drawn by itself
};

}  // namespace whirl::tuning
