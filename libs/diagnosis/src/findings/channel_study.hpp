#pragma once
#include <vector>

#include "findings/line_block.hpp"
#include "whirl/diagnosis/vibration_findings.hpp"

namespace whirl::diagnosis::detail {

inline constexpr double kLeastLine = 2e-3;      // of the largest line: below it transducers are not linear
inline constexpr double kRemarkableLine = 0.1;  // of the largest line
inline constexpr double kMainsTolerance =
    4e-3;  // of the frequency: 0.2 Hz of 50 Hz, the limit of large grids in operation
inline constexpr Eigen::Index kLongBlock = 1024;  // turns
inline constexpr double kSteadyBlock = 0.02;      // change of the speed over a long block
inline constexpr double kSteadyRecord = 0.05;     // of the speed over a record, above it it is a run

/// Orders that are fitted together.
std::vector<Line> order_lines(bool with_half = true);

/// One channel while it is judged.
struct ChannelStudy {
  const AngularChannel& channel;
  const VibrationOptions& options;
  bool phase = true;                   ///< the angle was measured
  double tests = 1;                    ///< of this record: channels times kinds of findings
  std::vector<Line> electric = {};     ///< found
  std::vector<LineBlock> blocks = {};  ///< long ones, with all orders and the electric lines
  double largest = 0;                  ///< amplitude of the largest line
  bool whirl = false;                  ///< a line below 0.5X was found
  double scatter = 0;                  ///< rad rms, of the phase of 1X, where it is significant
  VibrationFindings& result;

  bool runs() const;  ///< the speed changes through the record
  /// Adds a finding whose `chance` counts the tests of its kind alone, where it is unlikely and large enough to count.
  /// Returns whether it was added.
  bool add(VibrationFinding finding);
  void unjudged(VibrationCode code, UnjudgedReason reason);
  /// Root mean square over blocks of the amplitude of a line.
  static double mean_amplitude(const std::vector<LineValue>& values);
};

// One kind each, in the order in which they need each other.
void find_electric(ChannelStudy& study);
void find_subsynchronous(ChannelStudy& study);
void find_orders(ChannelStudy& study);
void find_phase_scatter(ChannelStudy& study);
void find_sidebands(ChannelStudy& study);
void find_run_out(ChannelStudy& study);

}  // namespace whirl::diagnosis::detail
