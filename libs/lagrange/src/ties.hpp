#pragma once
#include "algebra.hpp"
#include "whirl/lagrange/derive.hpp"

namespace whirl::lagrange {

/// The name of a variable in the library: a derivative without an entry is its base with a prime.
std::string library_name(const LagrangeProblem& problem, const std::string& name);

namespace algebra {

/// Splits accelerations into unknowns and functions: the library of LagrangeEquations. `moving`: the names whose second
/// derivatives they are; `exact`: parameters with their values.
expr::CandidateLibrary tied_library(const std::vector<ex>& accelerations, const std::vector<std::string>& moving,
                                    const LagrangeProblem& problem, const GiNaC::exmap& exact, const Names& names,
                                    std::vector<std::string>& notes);

}  // namespace algebra
}  // namespace whirl::lagrange
