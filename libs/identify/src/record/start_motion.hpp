#pragma once
#include "whirl/identify/rotor_record.hpp"

/// Displacements from which a fit of velocities or accelerations begins. The fit itself reads the record as it is.
namespace whirl::identification::detail {

/// Samples `first` .. `first + count - 1` of a record; t0 follows.
RotorRecord segment_of(const RotorRecord& record, Eigen::Index first, Eigen::Index count);

/// The record as a displacement: integrated once or twice by leaky integrators whose corner follows the speed,
/// y' + w y = u, w a quarter of the speed, each divided by its gain at the speed, so that what turns with the rotor
/// keeps its size and phase. Its noise has the colour of such a sum. Speeds far below that of the largest motion, where
/// the noise of the integral is larger than the motion, are cut off at either end.
RotorRecord as_displacement(const RotorRecord& record);

}  // namespace whirl::identification::detail
