#pragma once
#include <array>
#include <deque>
#include <memory>
#include <vector>

#include "monte_carlo/monte_carlo_draw.hpp"
#include "runs/run_judge.hpp"
#include "whirl/rig/batch.hpp"

namespace whirl::tuning {

/// One closed-loop run of one machine.
struct LaneRun {
  JudgedRun judged;
  double saturated = 0;  ///< fraction of all ticks at the force limit
  bool held = true;      ///< by the design: supervision took nothing back
};

/// At most `Lanes` random machines side by side; their runs without control are made once, for any number of designs.
template <int Lanes>
class MachineLanes {
 public:
  /// The machines `indices` of `draw`. Their tables share what they can with `like`.
  MachineLanes(const RigDraw& draw, const std::vector<int>& indices, const std::shared_ptr<const rig::RigTables>& like);

  /// One run of every machine with the design. May be called from several threads.
  std::vector<LaneRun> run(const ControllerDesign& design) const;
  const std::vector<DrawnRig>& rigs() const noexcept { return rigs_; }

 private:
  std::vector<DrawnRig> rigs_;
  std::array<std::shared_ptr<const rig::RigTables>, static_cast<std::size_t>(Lanes)> tables_;
  std::array<std::uint64_t, static_cast<std::size_t>(Lanes)> seeds_{};  ///< lanes left over repeat the last machine
  Eigen::VectorXd omega_;                                               ///< of all machines, rad/s
  double smooth_ = 0;  ///< variation of the force that holds an eccentricity of 1 m still
  std::vector<std::vector<int>> segments_;
  std::vector<rig::SegmentPeaks> open_;
};

extern template class MachineLanes<8>;
extern template class MachineLanes<16>;
extern template class MachineLanes<32>;

}  // namespace whirl::tuning
