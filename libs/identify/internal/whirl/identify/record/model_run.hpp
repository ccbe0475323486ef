#pragma once
#include <complex>
#include <optional>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::identification {

/// A ramp of the rotor's speed, up or down, and the unbalance that it is run with.
struct SpeedRun {
  double from = 0, to = 0;                                ///< rad/s
  double seconds = 0;                                     ///< length of the ramp
  double dwell = 0;                                       ///< s at the last speed
  double rate = 1000;                                     ///< samples a second
  double unbalance = 1;                                   ///< times the identified eccentricity
  std::optional<std::complex<double>> eccentricity = {};  ///< m, instead of the identified one
};

struct SpeedRunMotion {
  Recording record;  ///< x, y (m) and beta (rad)
  double peak = 0;   ///< largest radius about the mean position, m
  double speed = 0;  ///< at which it is reached, rad/s
};

/// Motion of an identified rotor over the ramp, from its steady whirl at the first speed; also of one whose disc tilts.
/// Throws Error for a model without rotor parameters, numbers out of range, more than 50 million samples, another
/// unbalance of a disc that tilts, and a motion that diverges.
SpeedRunMotion run_over_speeds(const IdentifiedModel& model, const SpeedRun& run);

/// Motion of a model of any equations over the inputs in a record, from its first sample: the channels of the inputs
/// and of the states. Throws Error where an input is missing and where the motion diverges.
Recording run_over_record(const IdentifiedModel& model, const Recording& record);

}  // namespace whirl::identification
