#include "whirl/monitor/reference.hpp"

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/monitor/synchronous.hpp"

namespace whirl::monitor {

using Eigen::Index;

std::vector<Index> tracked_channels(const std::vector<ChannelInfo>& channels) {
  std::vector<Index> orbit, all;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c].quantity != Quantity::displacement) continue;
    all.push_back(static_cast<Index>(c));
    if (channels[c].name == "x" || channels[c].name == "y") orbit.push_back(static_cast<Index>(c));
  }
  return orbit.empty() ? all : orbit;
}

Reference reference_of(const Recording& recording, Index most, Motion which) {
  std::vector<ChannelInfo> infos;
  for (const Channel& c : recording.channels) infos.push_back({c.name, c.quantity});
  const std::vector<Index> tracked = tracked_channels(infos);
  if (tracked.empty()) throw Error::in_file(recording.source, 0, "no displacement to compare with");
  Reference out;
  out.name = recording.source;
  Eigen::MatrixXd motion(recording.size(), static_cast<Index>(tracked.size()));
  for (std::size_t k = 0; k < tracked.size(); ++k) {
    const Channel& c = recording.channels[static_cast<std::size_t>(tracked[k])];
    const Channel* open = which == Motion::open_loop ? recording.find(c.name + "_open") : nullptr;
    motion.col(static_cast<Index>(k)) = (open ? *open : c).samples;
    out.channels.push_back(c.name);
  }
  SynchronousTracker tracker(motion.cols(), recording.rate());
  const auto turns = tracker.push(recording["beta"], motion);
  if (turns.empty()) throw Error::in_file(recording.source, 0, "holds no full turn of the rotor to compare with");
  const Index all = static_cast<Index>(turns.size()), every = std::max<Index>(1, (all + most - 1) / most);
  const Index n = (all + every - 1) / every;
  out.speed.resize(n);
  out.time.resize(n);
  out.amplitude.resize(n, motion.cols());
  out.phase.resize(n, motion.cols());
  for (Index i = 0; i < n; ++i) {
    const auto& turn = turns[static_cast<std::size_t>(i * every)];
    out.speed(i) = turn.speed;
    out.time(i) = recording.t0 + turn.end;
    out.amplitude.row(i) = turn.vector.cwiseAbs().transpose();
    out.phase.row(i) = turn.vector.array().arg().transpose();
  }
  return out;
}

}  // namespace whirl::monitor
