#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/signal/angle.hpp"
#include "whirl/signal/tacho_pattern.hpp"

namespace whirl::signal {

/// The edges of a tacho signal.
struct PulseTrain {
  std::vector<double> times;   ///< s, sample 0 at t = 0, ascending
  Edge edge = Edge::rising;    ///< which one they are
  double quantum = 0;          ///< steps of the times, s: a sample where no edge has one on its way, a tenth of it else
  double bottom = 0, top = 0;  ///< levels of the signal, in its unit
};

/// Times at which the signal crosses the middle level, interpolated linearly. An edge counts only after the signal was
/// beyond `low` of its range (hysteresis); its range leaves out the three largest and smallest samples.
PulseTrain pulse_train(const Eigen::Ref<const Eigen::VectorXd>& signal, double dt, Edge edge = Edge::automatic,
                       double low = 0.3, double middle = 0.5);

/// Rising edges of `pulse_train`.
std::vector<double> pulse_times(const Eigen::Ref<const Eigen::VectorXd>& signal, double dt, double low = 0.3,
                                double middle = 0.5);

/// The channel of pulses by its name: key, keyphasor or tacho; null where there is none.
const Channel* pulse_channel(const Recording& record);
/// The channel of a measured speed, rpm or rad/s: speed, rpm or omega; null where there is none.
const Channel* speed_channel(const Recording& record);

/// Whether the samples rest at two levels: fewer than one in five lies between, where a sine has two in five.
bool has_two_levels(const Eigen::Ref<const Eigen::VectorXd>& signal);

/// Angle of a record from channel `name` (empty: found by its name): pulses, or a speed, which is integrated and has no
/// phase. `said`: how it was found and what was assumed. Even pulses, which do not tell their number a turn, are
/// compared with the vibration of the record: where the largest line is a whole fraction of their rate, or they come
/// more often than 2000 times a second, the number must be stated. Throws Error saying what was seen.
AngleFit angle_of_tacho(const Recording& record, const std::string& name, const TachoOptions& tacho,
                        std::vector<std::string>& said);

/// The record with a channel beta of `angle_of_tacho` in place of the pulses. A record with beta, or one without pulses
/// and speed, stays as it is unless `name` or `tacho` asks.
Recording with_tacho_angle(const Recording& record, const std::string& name, const TachoOptions& tacho,
                           std::vector<std::string>& said);

}  // namespace whirl::signal
