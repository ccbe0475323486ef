#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/monitor/frame_source.hpp"

namespace whirl::monitor {

/// 1X amplitude over speed of another run, e.g. the open loop, shown behind the live one.
struct Reference {
  std::string name;
  Eigen::VectorXd speed;  ///< rad/s, per turn in the order of time
  std::vector<std::string> channels;
  Eigen::MatrixXd amplitude;  ///< m peak, turns x channels
};

/// Channels whose synchronous motion is followed: x and y where there is one of them, otherwise every displacement.
std::vector<Eigen::Index> tracked_channels(const std::vector<ChannelInfo>& channels);

/// From a recording with the rotor angle `beta`, at most `most` turns of it. The log of `whirl run` holds both runs: of
/// x_open beside x, the open one is taken. Throws Error without angle or displacement.
Reference reference_of(const Recording& recording, Eigen::Index most = 600);

}  // namespace whirl::monitor
