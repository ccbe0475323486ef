#pragma once
#include <Eigen/Core>
#include <string>

#include "whirl/signal/window.hpp"

namespace whirl::monitor {

enum class Averaging { linear, exponential, peak_hold };

struct SpectrumSettings {
  Eigen::Index block = 1024;  ///< samples, 64 to 65536
  Window window = Window::hann;
  double overlap = 0.5;       ///< [0, 0.9]
  Averaging averaging = Averaging::exponential;
  int averages = 8;           ///< N of the linear and exponential average, 1 to 1000
};

/// Running amplitude spectrum of several channels (amplitude peak, corrected for the window's gain).
///
///   linear       mean of the powers of N blocks, then it stands until reset
///   exponential  A <- A + (P - A) / min(count, N)
///   peak hold    largest power per line
///
/// A block with a lost sample (NaN) is left out and counted.
class SpectrumAverage {
 public:
  /// Throws Error when a setting is outside its range.
  SpectrumAverage(Eigen::Index channels, double rate, const SpectrumSettings& settings);

  /// Takes samples (rows) and returns the number of blocks completed by them.
  int push(const Eigen::Ref<const Eigen::MatrixXd>& samples);
  void reset();

  const SpectrumSettings& settings() const { return settings_; }
  double line_spacing() const { return rate_ / static_cast<double>(settings_.block); }  ///< Hz
  long count() const { return count_; }      ///< blocks in the average
  long skipped() const { return skipped_; }  ///< blocks left out
  /// Amplitude, lines x channels.
  Eigen::MatrixXd amplitude() const { return power_.cwiseSqrt(); }

 private:
  void average_block();

  double rate_;
  SpectrumSettings settings_;
  Eigen::Index filled_ = 0;
  Eigen::MatrixXd buffer_;  ///< block x channels
  Eigen::MatrixXd power_;   ///< squared amplitude, lines x channels
  long count_ = 0, skipped_ = 0;
};

}  // namespace whirl::monitor
