#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/records/check.hpp"

namespace whirl::records::detail {

using Mask = Eigen::ArrayX<bool>;

/// One channel while it is looked at.
struct ChannelCheck {
  std::string name;
  bool displacement = true;  ///< false: its size is not one in metres
  double dt = 0, t0 = 0;
  Eigen::VectorXd samples;  ///< masked samples bridged by straight lines
  Mask usable;
  double quantum = 0;  ///< smallest step between neighbours
  double spread = 0;   ///< rms about the mean of the usable samples
  double noise = 0;    ///< sd of the white noise, from sixth differences
  std::vector<Finding> findings;

  double time(Eigen::Index i) const { return t0 + dt * static_cast<double>(i); }
  /// Adds a finding about samples first to last and masks them where it says so.
  void report(Finding finding, Eigen::Index first, Eigen::Index last);
  void bridge();   ///< masked samples become a straight line between their neighbours
  void measure();  ///< quantum, spread and noise
};

void find_gaps(ChannelCheck& c);
/// Samples in a row that read one value far outside all others, as loggers write it where they have no reading.
void find_out_of_reach(ChannelCheck& c);
void find_flat(ChannelCheck& c);  ///< frozen stretches, dropouts, clipping
void find_spikes(ChannelCheck& c);
void find_lines(ChannelCheck& c, const std::vector<double>& mains, double lowest_turning, double highest_turning);

/// A channel that is held between rare changes (a command, a square wave, a coarse counter).
bool is_held(const Eigen::VectorXd& samples);

/// A channel of pulses once per turn (keyphasor, tacho): two levels, and periods that change evenly.
bool is_pulse_train(const Eigen::VectorXd& samples, double dt);

/// Checks of x, y and angle together, the channels after their own checks; one of the two may be null (one axis).
void check_rotor(const ChannelCheck* first, const ChannelCheck* second, const Eigen::VectorXd& angle,
                 std::string_view angle_name, RecordReport& report);
/// Angle readings that jump: a splice of the whole record.
void find_splice(const Eigen::VectorXd& angle, std::string_view name, double t0, double dt, RecordReport& report);
void find_drift(ChannelCheck& c, const Eigen::VectorXd& angle);
void find_jitter(ChannelCheck& c);

double median(std::vector<double> values);

}  // namespace whirl::records::detail
