#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "blow_agreement.hpp"
#include "whirl/modal/frf.hpp"

namespace whirl::modal {

/// Sums over blows, per line.
struct CrossSpectra {
  Eigen::VectorXd ff;
  std::vector<Eigen::VectorXd> aa;
  std::vector<Eigen::VectorXcd> af;
  std::vector<Eigen::VectorXd> noise;  ///< part of the blows' scatter that their size does not explain
};

/// Sums of `lines` lines of every blow; `noise` is left empty.
CrossSpectra sum(const std::vector<BlowSpectra>& spectra, Eigen::Index lines, std::size_t responses);

/// Line from which the force spectrum stays `drop_db` below its maximum (a notch of a double hit does not count).
Eigen::Index usable_lines(const Eigen::VectorXd& ff, double drop_db);

/// To first order a nonlinear stiffness changes the response by the square of the blow's size: what the blows differ by
/// then is no noise. Per line the part of their scatter about the mean response that a regression on the squared size
/// leaves, degrees of freedom counted; 1 where the lines around show no such dependence.
Eigen::VectorXd noise_part(const std::vector<BlowSpectra>& spectra, std::size_t channel, const Eigen::VectorXd& ff,
                           const Eigen::VectorXcd& af);

/// Estimate, coherence and variance of every channel from the sums over `result.averages` blows.
void estimate_channels(const CrossSpectra& sums, const FrfOptions& options, FrequencyResponse& result);

}  // namespace whirl::modal
