#pragma once
#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace whirl::rig {

/// Speed ratios Omega / w1 that separate the four segments of paper Fig. 24 and Table 4: before the critical
/// region, entering it, through the natural frequency, coming to rest.
struct SegmentBounds {
  std::array<double, 3> ratio{2.14, 1.081, 0.755};
};

/// Table 4 rows: 1 to 4, then the whole run.
struct SegmentPeaks {
  std::array<double, 4> segment{};  ///< largest |x|, zero-to-peak, m; 0 for a segment never entered
  double all = 0;
};

/// Segment (0 to 3) of every sample by its speed, whatever the direction of the run.
std::vector<int> segments(const Eigen::VectorXd& omega, double natural_frequency, const SegmentBounds& bounds = {});

/// Largest |x| per segment; the first `skip` samples (start transient, 0.5 s by convention) are left out.
SegmentPeaks segment_peaks(const Eigen::VectorXd& x, const std::vector<int>& segment, Eigen::Index skip);

/// Suppression 1 - closed / open per segment and for the whole run, as fractions.
SegmentPeaks suppression(const SegmentPeaks& open, const SegmentPeaks& closed);

}  // namespace whirl::rig
