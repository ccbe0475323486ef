#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/monitor/frame_source.hpp"

namespace whirl::monitor {

/// The 1X vectors of another run, e.g. the open loop, shown behind the live one and compared with it.
struct Reference {
  std::string name;
  Eigen::VectorXd speed;  ///< rad/s, per turn in the order of time
  std::vector<std::string> channels;
  Eigen::MatrixXd amplitude;   ///< m peak, turns x channels
  Eigen::VectorXd time = {};   ///< end of each turn, s
  Eigen::MatrixXd phase = {};  ///< rad, lead: x = Re(Z exp(j beta)); turns x channels
};

/// Which of x and x_open (a log of `whirl run` holds both) a reference is made of.
enum class Motion { open_loop, measured };

/// Channels whose synchronous motion is followed: x and y where there is one of them, otherwise every displacement.
std::vector<Eigen::Index> tracked_channels(const std::vector<ChannelInfo>& channels);

/// From a recording with the rotor angle `beta`, at most `most` turns of it; Motion::open_loop takes x_open where it
/// stands beside x. Throws Error without angle, displacement or a full turn.
Reference reference_of(const Recording& recording, Eigen::Index most = 600, Motion motion = Motion::open_loop);

}  // namespace whirl::monitor
