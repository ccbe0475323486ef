#pragma once
#include <vector>

#include "whirl/core/estimate.hpp"

namespace whirl::modal {

/// One quantity seen in several set-ups.
struct PooledEstimate {
  Estimate mean;
  double between = 0;      ///< sd of the quantity from set-up to set-up beyond the errors
  double squares = 0;      ///< weighted sum of squares about the weighted mean; freedom: set-ups - 1
  double probability = 1;  ///< that equal quantities differ as much as this (Fisher's F, errors from `blocks` blocks)
};

/// Mean with random effects (DerSimonian and Laird, 1986): what the set-ups differ by beyond their errors is part of
/// the error of the mean, with Student's t of so few set-ups once they surely differ (Hartung and Knapp, 2001).
/// `between`: least sd from set-up to set-up, where other quantities showed it; above 0 it counts as sure.
PooledEstimate pool(const std::vector<Estimate>& seen, int blocks = 20, double between = 0);

/// Probability of Fisher's F that equal quantities differ as much as `squares` with so many degrees of freedom.
double chance_of(double squares, double freedom, int blocks = 20);

}  // namespace whirl::modal
