#pragma once
#include <vector>

#include "growth/rotor_growth.hpp"
#include "whirl/identify/weak_rotor.hpp"

/// The searches for the terms of one rotor, one after the other until one explains the records.
namespace whirl::identification::detail {

/// The model that the records ask for, from the weak equations `first` of `moving`, the records as displacements; where
/// they ask for springs of their own `active` has them.
GrownRotor grow_rotor(const std::vector<RotorRecord>& records, const std::vector<RotorRecord>& moving,
                      const WeakRotorOptions& weak, WeakRotorFit first, const RotorIdentifyOptions& options,
                      OutputErrorOptions& active);

/// The same parts as `like` has, found anew from records that are among its own.
GrownRotor fitted_as(const std::vector<RotorRecord>& records, const RotorIdentification& like,
                     const RotorIdentifyOptions& options);

}  // namespace whirl::identification::detail
