#pragma once
#include <Eigen/Core>
#include <complex>
#include <memory>
#include <vector>

#include "whirl/core/quantity.hpp"

namespace whirl::diagnosis::detail {

/// A channel at equal steps of the rotor angle, from a whole turn on.
struct AngularChannel {
  std::string name;
  Quantity quantity = Quantity::displacement;
  Eigen::VectorXd samples;
  Eigen::VectorXd time;  ///< s, of each sample
  int per_turn = 32;
  double rate = 0;     ///< Hz, of the record
  double quantum = 0;  ///< smallest step between readings of the record

  Eigen::Index turns() const { return samples.size() / per_turn; }
  double turn_start(Eigen::Index turn) const;                  ///< s, also of the end of the last turn
  double speed(Eigen::Index first, Eigen::Index turns) const;  ///< rad/s, mean
};

/// A line that turns with the shaft (`order`) or has a fixed frequency (Hz); the other one is 0.
struct Line {
  double order = 0;
  double frequency = 0;
  bool operator==(const Line&) const = default;
};

/// A line as it stands in a block.
struct LineValue {
  std::complex<double> vector;  ///< amplitude (peak) and phase to the angle, or to time 0
  double power = 0;   ///< in units of the noise of one sample: exponential about its variance where no line is
  double share = 0;   ///< of the line that the other lines leave; 0: they cannot be told apart
  double chance = 1;  ///< of that power under the noise on either side; 1 where it cannot be judged

  double amplitude() const { return std::abs(vector); }
};
/// Below it a line is not judged beside the others: its deviation is twice that of a line alone.
inline constexpr double kLeastShare = 0.25;
inline constexpr double kUsedBand = 0.42;  // of the sample rate: above it the filters of loggers fall

/// Whole turns of a channel with lines fitted to them under a Hann window, by least squares, all together.
class LineBlock {
 public:
  LineBlock(const AngularChannel& channel, Eigen::Index first_turn, Eigen::Index turns, const std::vector<Line>& lines);

  Eigen::Index turns() const { return turns_; }
  Eigen::Index first_turn() const { return first_ / channel_->per_turn; }
  double speed() const { return speed_; }        ///< rad/s, mean
  double duration() const { return duration_; }  ///< s
  double middle() const;                         ///< s
  double turning() const;                        ///< Hz, mean
  double bin_of(const Line& line) const;         ///< place in the spectrum over the angle, in lines of 1 / turns

  /// Value of one of the lines fitted; without chance where the record's band does not reach it.
  LineValue fitted(const Line& line) const;
  /// A further line, fitted to what the others leave. With `skirts` a fixed line near an order counts only above what
  /// stands on the other side of the order.
  LineValue added(const Line& line, bool skirts = true) const;
  /// Power and amplitude of the residual at a place of the spectrum, against either side of it.
  LineValue at_bin(Eigen::Index bin) const;
  /// The mean power of the free lines on both sides of a place; NaN where there are none.
  double floor(double bin) const;
  bool near_line(Eigen::Index bin) const { return taken_[static_cast<std::size_t>(bin)]; }
  Eigen::Index bins() const { return power_.size(); }
  /// The samples less all lines fitted but one.
  Eigen::VectorXd samples_with(const Line& kept) const;

 private:
  struct Near;
  /// The fitted lines near a place, made ready to be taken off further ones.
  std::shared_ptr<const Near> near_to(const Line& line) const;
  Eigen::MatrixX2d columns(const Line& line) const;
  Eigen::Index column_of(const Line& line) const;  ///< first one; -1: not fitted
  bool judged(double bin, const Line& line) const;
  double chance(double power, double bin, const Eigen::VectorXd& spectrum) const;
  double mirror_chance(const Line& line, double power) const;
  LineValue added_alone(const Line& line, bool against_floor) const;
  Eigen::VectorXd spectrum_of(const Eigen::VectorXd& residual) const;

  const AngularChannel* channel_;
  Eigen::Index first_ = 0, turns_ = 0;
  std::vector<Line> lines_;
  double speed_ = 0, duration_ = 0, slowest_ = 0, fastest_ = 0;
  Eigen::VectorXd weight_, residual_, power_;
  Eigen::VectorXd solution_;
  Eigen::MatrixXd inverse_, normal_, spread_;  // of the normal equations; these; noise of their right side
  std::vector<bool> taken_;
  // Of the last place that was asked for: a search goes from place to place, and most have the same lines near.
  mutable std::shared_ptr<const Near> near_;
};

/// Blocks of whole turns: as many, up to `most`, as change the speed by less than `tolerance`, 16 at least; evenly
/// chosen ones where there are more than 96.
std::vector<LineBlock> blocks_of(const AngularChannel& channel, const std::vector<Line>& lines, Eigen::Index most,
                                 double tolerance);

/// Chance that an exponential variable is larger than `power` where `floor` holds others of its law, of which the
/// smallest three quarters are used (others may hold lines): prod 1 / (1 + r w_i), r their ratio to the sum of those k
/// of m, w_i = (k - i + 1) / (m - i + 1), from Renyi's representation of ordered exponentials (1953).
double exceedance(double power, std::vector<double> floor);

/// Chance of a product of chances at least as small (Fisher 1932).
double fisher(const std::vector<double>& chances);

/// Evidence of a line over the blocks of a record.
struct Evidence {
  double chance = 1;              ///< over the record or the stretch that shows it best, times their number
  std::vector<std::size_t> seen;  ///< blocks that show it alone (chance below 0.01)
};
/// Of four blocks or more the best one does not count: something else may have crossed there.
Evidence evidence_of(const std::vector<double>& chances);

}  // namespace whirl::diagnosis::detail
