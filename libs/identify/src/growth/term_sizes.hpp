#pragma once
#include <string_view>
#include <vector>

#include "whirl/identify/output_error_rotor.hpp"

/// How large the terms of a model are beside what rotors that have them show (TermEntry::usual).
namespace whirl::identification::detail {

/// Sizes of the motion and of `rotor` that usual coefficients refer to.
TermScale scale_of(const RotorModel& rotor, const OutputErrorFit& fit);

struct TermSize {
  const TermEntry* entry;
  std::string_view parameter, unit;
  double value, usual;
  double ratio() const { return std::abs(value) / usual; }
};
/// Of all forces and errors of the probes in a fit that have a usual size.
std::vector<TermSize> sizes_of(const OutputErrorFit& fit);

/// What the sizes of a model's terms speak against it, in units of a likelihood ratio: twice the negative logarithm of
/// their priors, which fall with the square of the size beyond 3 times the usual one (Cauchy's tails). What the record
/// shows plainly then wins over any size, and is not trusted for it (judge_sizes).
double surprise(const OutputErrorFit& fit);

}  // namespace whirl::identification::detail
