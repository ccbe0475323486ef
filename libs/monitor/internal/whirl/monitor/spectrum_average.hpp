#pragma once
#include <Eigen/Core>
#include <utility>
#include <vector>

#include "whirl/signal/window.hpp"

namespace whirl::monitor {

enum class Averaging { linear, exponential, peak_hold };

struct SpectrumSettings {
  Eigen::Index block = 1024;  ///< samples, 64 to 65536
  signal::Window window = signal::Window::hann;
  double overlap = 0.5;  ///< [0, 0.9]
  Averaging averaging = Averaging::exponential;
  int averages = 8;  ///< N of the linear and exponential average, 1 to 1000
};

/// Block whose lines are about 1 Hz apart at this rate, within 256 to 32768 samples.
Eigen::Index block_for(double rate);

/// Running amplitude spectrum of several channels (amplitude peak, corrected for the window's gain).
///
///   linear       mean of the powers of N blocks, then it stands until reset
///   exponential  A <- A + (P - A) / min(count, N)
///   peak hold    largest power per line
///
/// Lost samples (NaN) are bridged by straight lines where they are at most one in a hundred of a block, which changes
/// an amplitude by at most about 2 % and far less below a tenth of the rate; a block with more is left out of the
/// average of that channel. Both are counted where it matters: in the orbit, or in the first channel when there is no
/// orbit.
class SpectrumAverage {
 public:
  /// `orbit`: the channels x and y of the full spectrum; -1: none. Throws Error when a setting is outside its range.
  SpectrumAverage(Eigen::Index channels, double rate, const SpectrumSettings& settings,
                  std::pair<Eigen::Index, Eigen::Index> orbit = {-1, -1});

  /// Takes samples (rows) and returns the number of blocks completed by them.
  int push(const Eigen::Ref<const Eigen::MatrixXd>& samples);
  void reset();

  const SpectrumSettings& settings() const { return settings_; }
  double line_spacing() const { return rate_ / static_cast<double>(settings_.block); }  ///< Hz
  long count() const { return count_; }                                                 ///< blocks in the average
  long skipped() const { return skipped_; }                                             ///< blocks left out
  long bridged() const { return bridged_; }  ///< blocks in which a lost sample was bridged
  /// Amplitude, lines x channels.
  Eigen::MatrixXd amplitude() const { return power_.cwiseSqrt(); }
  /// Amplitude of x + j y over an odd number of lines, 0 Hz in the middle, backward whirl first; empty without an
  /// orbit.
  Eigen::VectorXd full_amplitude() const { return full_power_.cwiseSqrt(); }
  /// Amplitude of the newest block alone, lines x channels; empty before the first.
  const Eigen::MatrixXd& latest() const { return latest_; }

 private:
  /// A channel of the block without its lost samples; empty when too many are lost.
  Eigen::VectorXd whole(Eigen::Index channel) const;
  void average_block();
  void take(std::size_t index, Eigen::Ref<Eigen::VectorXd> average, const Eigen::Ref<const Eigen::VectorXd>& power);

  double rate_;
  SpectrumSettings settings_;
  std::pair<Eigen::Index, Eigen::Index> orbit_;
  Eigen::Index filled_ = 0;
  Eigen::MatrixXd buffer_;  ///< block x channels
  Eigen::MatrixXd power_;   ///< squared amplitude, lines x channels
  Eigen::VectorXd full_power_;
  Eigen::MatrixXd latest_;
  std::vector<long> counts_;  ///< blocks per channel, the last one of the full spectrum
  long count_ = 0, skipped_ = 0, bridged_ = 0;
};

}  // namespace whirl::monitor
