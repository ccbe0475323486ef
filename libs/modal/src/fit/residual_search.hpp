#pragma once
#include <complex>
#include <vector>

#include "band.hpp"

namespace whirl::modal {

/// A mode a little outside the band bends the FRFs inside in a way that the residuals cannot: poles may lie this factor
/// out.
constexpr double kReach = 1.3;

/// Poles that stand out in what a model leaves: energy along b = W s^d / (s - q), normalised, over the channels, above
/// `least_gain` times the median energy of a line. Strongest first; only those within a tenth of the strongest, since
/// weaker ones are often its echoes.
std::vector<std::complex<double>> search_residual(const Band& band, const Eigen::MatrixXcd& residual,
                                                  double least_gain);

}  // namespace whirl::modal
