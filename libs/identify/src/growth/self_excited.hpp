#pragma once
#include <cmath>
#include <string>
#include <vector>

#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/weak_rotor.hpp"

/// Rotors that whirl by themselves: without the force that drives the whirl the weak equations give damping that no
/// trajectory follows.
namespace whirl::identification::detail {

/// A start with the force that drives the whirl.
struct WhirlStart {
  WeakRotorFit fit;
  double unstable = 0;           ///< rad/s, small motion grows from here on
  Eigen::Index parts = 0;        ///< of a record that one motion each follows, as few as were found; 0: none
  double chi_square = INFINITY;  ///< over these, or the least over any parts

  /// What is to be said where no motion over a whole record is found.
  std::string reason() const;
};

/// Starts with rotating damping or cross-coupled stiffness, where the weak equations find the rotor unstable by it
/// within the speeds of the records; the best first. `first`: the weak equations without such a force; one that has
/// positive damping must leave twice as much as those with it. Each is refined over ever longer parts of the records,
/// each with a start of its own: a whirl that goes its own way follows a trajectory over many turns only where the
/// parameters are near.
std::vector<WhirlStart> self_excited_starts(const std::vector<RotorRecord>& records, WeakRotorOptions weak,
                                            const WeakRotorFit& first);

}  // namespace whirl::identification::detail
