#pragma once
#include "algebra.hpp"
#include "whirl/lagrange/derive.hpp"

namespace whirl::lagrange::algebra {

/// Parameters that the symmetries of the problem leave no choice: parameter -> combination of others. Every function
/// keeps its value under the symmetry, which is linear in the parameters: rotation by its generator, mirror and
/// exchange by comparison with the image. Later declared parameters are given by earlier ones. Throws Error when a
/// condition is not linear in parameters or cannot hold.
GiNaC::exmap symmetry_ties(const std::vector<ex>& functions, const LagrangeProblem& problem, const Names& names,
                           std::vector<std::string>& notes);

}  // namespace whirl::lagrange::algebra
