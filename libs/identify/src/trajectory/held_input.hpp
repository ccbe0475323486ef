#pragma once
#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <vector>

#include "whirl/core/identified_model.hpp"

namespace whirl::identification::detail {

/// What an input does between and beyond its samples; before the first and after the last it keeps their value.
class HeldInput {
 public:
  HeldInput(const Eigen::Ref<const Eigen::VectorXd>& samples, Hold hold);
  Hold hold() const { return hold_; }
  /// Value at `at` samples from the first.
  double value(double at) const;
  /// Slope there, per sample; 0 for a zero-order hold.
  double slope(double at) const;

 private:
  Hold hold_;
  Eigen::VectorXd samples_;  // band-limited: kFine times finer
};

/// Calls `f(first, count)` for every stretch without a missing sample.
template <class F>
void each_whole_stretch(const Eigen::Ref<const Eigen::VectorXd>& samples, const F& f) {
  for (Eigen::Index first = 0, i = 0; i <= samples.size(); ++i) {
    if (i < samples.size() && std::isfinite(samples[i])) continue;
    if (i > first) f(first, i - first);
    first = i + 1;
  }
}

/// The signal `shift` samples before each sample, band-limited, stretch by stretch. Beyond the ends of a stretch: the
/// value there (`keep_ends`), or missing.
Eigen::VectorXd read_before(const Eigen::Ref<const Eigen::VectorXd>& samples, double shift, bool keep_ends);

/// One Runge-Kutta step of a run, in samples from the record's first.
struct HeldStep {
  double begin = 0, length = 0;
  bool sample = false;         ///< begins at a sample
  std::uint64_t switched = 0;  ///< bit j: held input j switches at its beginning
};

/// Steps from sample `first` over `count` samples: `substeps` a sample at least, and one ends wherever a held input
/// (dead time in samples, one per input) switches or bends.
std::vector<HeldStep> held_steps(const std::vector<HeldInput>& inputs, const Eigen::VectorXd& dead_samples,
                                 Eigen::Index first, Eigen::Index count, int substeps);

}  // namespace whirl::identification::detail
