#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::records {

/// What can be wrong with a record.
enum class FindingKind {
  gap,           ///< samples that are not finite
  dropout,       ///< a moving signal reads exactly 0 for a stretch
  frozen,        ///< a moving signal holds one value for a stretch
  clipping,      ///< the signal is cut off at its largest or smallest value
  spikes,        ///< single samples far from the curve through their neighbours
  splice,        ///< the record jumps: parts of two runs, or samples lost
  hum,           ///< a line of the mains, 50 or 60 Hz or a multiple
  drift,         ///< the mean moves slowly
  whirl_sense,   ///< the motion turns against the angle: axes swapped, one reversed, or the rotation reversed
  angle_unit,    ///< the angle advances in degrees or turns, not radians
  size,          ///< a displacement or a time that no rotor has: a wrong unit
  jitter,        ///< sampling instants scatter: the noise grows with the velocity
  undersampled,  ///< so few samples a turn that 1X is hardly seen, or not
};
std::string_view to_string(FindingKind kind);

/// What follows from a finding.
enum class Severity {
  note,    ///< said; the record may be used
  mask,    ///< the samples concerned carry no information and are left out
  model,   ///< is estimated beside the motion (hum, drift)
  refuse,  ///< the record cannot be used as it is
};
std::string_view to_string(Severity severity);

struct Finding {
  FindingKind kind = FindingKind::gap;
  Severity severity = Severity::note;
  std::string channel = {};   ///< empty: the record as a whole
  double begin = 0, end = 0;  ///< s, first and last sample concerned
  Eigen::Index samples = 0;   ///< how many samples are concerned
  double size = 0;            ///< in the SI unit of the channel; of hum the amplitude (peak), of drift the change
  double frequency = 0;       ///< Hz, of hum
  std::string advice = {};    ///< what to do about it, one sentence without a full stop

  /// One line: kind, channel, time, extent, advice.
  std::string text() const;
};

/// Samples of one channel; 1: usable.
struct ChannelMask {
  std::string channel;
  Eigen::ArrayX<bool> usable;
};

struct RecordReport {
  std::vector<Finding> findings;   ///< in the order of the channels, whole-record findings last
  std::vector<ChannelMask> masks;  ///< of the channels with masked samples

  bool refused() const;
  const ChannelMask* mask(std::string_view channel) const;
  /// First finding of a kind; nullptr when there is none.
  const Finding* find(FindingKind kind, std::string_view channel = {}) const;
};

struct CheckOptions {
  /// Displacement channels and angle of a rotor record; its checks (whirl sense, angle unit, sizes) are made when the
  /// angle and both, or one of them, are there. One axis does not show the sense of the whirl.
  std::string x = "x", y = "y", angle = "beta";
  /// Mains frequencies looked for, Hz, with their first three multiples.
  std::vector<double> mains = {50, 60};
};

/// Looks at a record before anything is fitted to it. Channels of angle, speed, force, torque, current and pressure are
/// searched for gaps only (they may be held or switched); the motion and whatever has no unit for all of it.
/// Samples that are not finite are findings, not errors. Throws Error unless dt > 0 and all channels are equally long.
RecordReport check(const Recording& recording, const CheckOptions& options = {});

}  // namespace whirl::records
