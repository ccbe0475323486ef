#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::shaft {

/// Synchronous vectors of one run, block by block of whole turns: x = Re(Z e^{i theta}), zero-to-peak.
struct OrderRun {
  std::string name;
  int turns = 1;             ///< of a block
  Eigen::VectorXd time;      ///< s, at kGridPerTurn equal steps of the angle through all blocks, both ends included
  Eigen::VectorXd speed;     ///< rad/s, mean of each block
  Eigen::VectorXd samples;   ///< of the record in each block
  Eigen::MatrixXcd vectors;  ///< probes x blocks, m

  Eigen::Index blocks() const { return speed.size(); }
};
inline constexpr int kGridPerTurn = 8;

/// Vectors of the channels of a record. `angle` is the rising angle of the shaft, rad, at the samples from `first` on.
/// A block has as many turns as leave at most `most_blocks` of them. Throws Error for fewer than eight turns.
OrderRun order_run(const Recording& record, Eigen::Index first, const Eigen::VectorXd& angle,
                   const std::vector<std::string>& channels, const std::string& name, int most_blocks = 300);

}  // namespace whirl::shaft
