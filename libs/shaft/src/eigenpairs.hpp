#pragma once
#include <complex>
#include <vector>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

struct Eigenpair {
  std::complex<double> pole;
  Eigen::VectorXcd shape;  ///< coordinates of the equations
};
/// The `count` eigenpairs with the smallest |pole| that oscillate: of real equations one of each conjugate pair, of
/// complex ones those of either sign.
template <class Matrix>
std::vector<Eigenpair> lowest_pairs(const Equations<Matrix>& equations, int count);

}  // namespace whirl::shaft
