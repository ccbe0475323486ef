#include "whirl/rig/segments.hpp"

#include <algorithm>
#include <cmath>

namespace whirl::rig {

namespace {
// Not std::max: the NaN of a diverged run must stay visible.
void raise(double& peak, double value) {
  if (value > peak || std::isnan(value)) peak = value;
}
}  // namespace

std::vector<int> segments(const Eigen::VectorXd& omega, double natural_frequency, const SegmentBounds& bounds) {
  std::vector<int> segment(static_cast<std::size_t>(omega.size()));
  for (Eigen::Index i = 0; i < omega.size(); ++i) {
    const double ratio = std::abs(omega[i]) / natural_frequency;
    segment[static_cast<std::size_t>(i)] = static_cast<int>(
        std::count_if(bounds.ratio.begin(), bounds.ratio.end(), [&](double bound) { return ratio < bound; }));
  }
  return segment;
}

SegmentPeaks segment_peaks(const Eigen::VectorXd& x, const std::vector<int>& segment, Eigen::Index skip) {
  SegmentPeaks peaks;
  for (Eigen::Index i = skip; i < x.size(); ++i) {
    raise(peaks.segment[static_cast<std::size_t>(segment[static_cast<std::size_t>(i)])], std::abs(x[i]));
  }
  for (double peak : peaks.segment) raise(peaks.all, peak);
  return peaks;
}

SegmentPeaks suppression(const SegmentPeaks& open, const SegmentPeaks& closed) {
  SegmentPeaks s;
  for (std::size_t i = 0; i < s.segment.size(); ++i) s.segment[i] = 1 - closed.segment[i] / open.segment[i];
  s.all = 1 - closed.all / open.all;
  return s;
}

}  // namespace whirl::rig
