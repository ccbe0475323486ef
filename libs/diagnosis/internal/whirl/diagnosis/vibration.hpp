#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/diagnosis/standards.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::diagnosis {

/// The synchronous part of a channel.
struct SynchronousPart {
  double amplitude = 0;  ///< peak, SI
  double speed = 0;      ///< rad/s
  bool steady = false;   ///< the mean vector of a run at one speed; else the largest vector of a run
};

/// What one channel says of the vibration of a machine, in its own quantity (SI).
struct ChannelVibration {
  std::string channel;
  Quantity quantity = Quantity::displacement;
  double mean = 0;       ///< of the samples: the gap of a displacement probe, the offset of another sensor
  double largest = 0;    ///< largest |x - mean|, peak
  double rms = 0;        ///< about the mean
  double frequency = 0;  ///< Hz, of the largest line of the spectrum; 0: none
  double line = 0;       ///< its amplitude, peak
  bool struck = false;   ///< the record has the blows of a hammer: its spectrum is of transients and has no lines
  std::optional<SynchronousPart> synchronous;  ///< 1X; nothing without a rotor angle
  std::optional<signal::BandLevel> housing;    ///< velocity from 10 Hz to 1 kHz (ISO 20816-1): sensors of a housing
};

/// A velocity or an acceleration of a record without a force, but for the rate "dx" of a displacement "x" of the same
/// record. A record with a force is a test or a loop, a rate is a state of the rotor: no sensors of a housing.
bool of_a_housing(const Channel& channel, const Recording& record);

/// The channels of displacement, velocity and acceleration. `rotation` of the record, where there is one; 1X with the
/// slow-roll vector below `slow_roll` (rad/s) taken off. Missing samples (NaN) are left out of mean, largest and rms;
/// such a channel has neither lines nor 1X.
std::vector<ChannelVibration> vibration_of(const Recording& record, const std::optional<Rotation>& rotation,
                                           double slow_roll = 0);

/// Zone of the level of a housing sensor.
struct HousingZone {
  char zone = 'A';
  /// A part of what the standard counts is not in the level: the record ends below 1 kHz, or 1X lies below 10 Hz. The
  /// machine is in this zone or a worse one. Never with 'D'.
  bool at_least = false;
};
/// `channel` with a level (`housing`).
HousingZone housing_zone(const ChannelVibration& channel, const MachineClass& machine);

/// The run stays within 3 % of its mean speed.
bool at_one_speed(const Rotation& rotation);

/// `order_curve` for figures and zones. At one speed every vector is the mean of the 32 turns about it (fewer in a
/// short run) under a Hann window: what does not repeat from turn to turn, a whirl below the speed, is no part of 1X.
signal::SynchronousCurve shown_curve(const Recording& record, const Rotation& rotation, const std::string& channel,
                                     double order = 1, int turns = 1, double slow_roll = 0);

}  // namespace whirl::diagnosis
