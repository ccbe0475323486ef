#include "whirl/monitor/frame_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"

namespace whirl::monitor {

using Eigen::Index;

double PlaybackSource::steady_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

PlaybackSource::PlaybackSource(Recording recording, double speed, bool loop, Clock clock)
    : recording_(std::move(recording)), speed_(speed), loop_(loop), clock_(std::move(clock)) {
  require_range("speed", speed, 0.01, 10000);
  if (recording_.size() < 2) throw Error::in_file(recording_.source, 0, "too short to be played: needs 2 samples");
  info_.name = recording_.source;
  info_.rate = recording_.rate();
  for (const Channel& c : recording_.channels) info_.channels.push_back({c.name, c.quantity});
  restart_clock();
}

void PlaybackSource::restart_clock() {
  started_ = clock_();
  from_ = static_cast<double>(next_);
}

Index PlaybackSource::read(Eigen::Ref<Eigen::MatrixXd> block, double& t_first) {
  const Index n = recording_.size();
  if (paused_ || (next_ >= n && !loop_)) return 0;
  if (next_ >= n) {
    next_ = 0;
    ++lap_;
    jumped_ = true;
    restart_clock();
  }
  const double due = from_ + (clock_() - started_) * speed_ * info_.rate;
  const Index to = static_cast<Index>(std::min<double>(static_cast<double>(n), std::floor(due + 1e-6)));
  const Index count = std::clamp<Index>(to - next_, 0, block.rows());
  // Time goes on from pass to pass, so that a view never sees it run backwards.
  t_first =
      recording_.t0 + recording_.dt * (static_cast<double>(next_) + static_cast<double>(lap_) * static_cast<double>(n));
  for (Index c = 0; c < block.cols(); ++c) {
    block.col(c).head(count) = recording_.channels[static_cast<std::size_t>(c)].samples.segment(next_, count);
  }
  next_ += count;
  return count;
}

std::vector<std::pair<std::string, std::string>> PlaybackSource::status() const {
  const bool ended = next_ >= recording_.size() && !loop_;
  return {{"state", ended     ? "ended"
                    : paused_ ? "paused"
                              : "playing"},
          {"speed", fmt::format("{:g} x", speed_)},
          {"position",
           fmt::format("{:.2f} of {:.2f} s", recording_.dt * static_cast<double>(next_), recording_.duration())}};
}

bool PlaybackSource::command(const std::string& name, double value) {
  if (name == "pause") {
    paused_ = true;
  } else if (name == "play") {
    if (next_ >= recording_.size()) next_ = 0, ++lap_, jumped_ = true;
    paused_ = false;
  } else if (name == "speed") {
    require_range("speed", value, 0.01, 10000);
    speed_ = value;
  } else if (name == "seek") {
    require_range("seek", value, 0, recording_.duration(), "s");
    // The time shown never runs backwards: going back counts as another pass.
    const Index to = std::min(recording_.size() - 1, static_cast<Index>(value / recording_.dt));
    if (to < next_) ++lap_;
    jumped_ = to != next_;
    next_ = to;
  } else if (name == "loop") {
    loop_ = value != 0;
  } else {
    return false;
  }
  restart_clock();
  return true;
}

std::vector<Control> PlaybackSource::controls() const {
  return {{.name = "play"},
          {.name = "pause"},
          {.name = "speed", .takes_value = true, .low = 0.01, .high = 10000, .value = speed_, .unit = "x"},
          {.name = "seek", .takes_value = true, .low = 0, .high = recording_.duration(), .unit = "s"},
          {.name = "loop", .takes_value = true, .low = 0, .high = 1, .value = loop_ ? 1.0 : 0.0}};
}

RingSource::RingSource(StreamInfo info, SampleRing& ring) : info_(std::move(info)), ring_(ring), row_(ring.channels()) {
  if (info_.channels.size() != ring.channels()) {
    throw Error(fmt::format("stream '{}' has {} channels, its ring {}: must be equal", info_.name,
                            info_.channels.size(), ring.channels()));
  }
  if (!(info_.rate > 0)) throw Error::in_field("rate", fmt::format("{:g}", info_.rate), "positive");
}

Index RingSource::read(Eigen::Ref<Eigen::MatrixXd> block, double& t_first) {
  Index rows = 0;
  std::uint64_t tick = 0;
  while (rows < block.rows() && ring_.peek(tick)) {
    // A jump larger than the block (a pause of the loop) starts anew at the tick that came.
    if (!started_ || tick < expected_ || tick - expected_ > static_cast<std::uint64_t>(block.rows())) {
      if (rows > 0) break;
      expected_ = tick;
      started_ = true;
    }
    if (rows == 0) t_first = static_cast<double>(expected_) / info_.rate;
    if (tick > expected_) {
      block.row(rows++).setConstant(std::numeric_limits<double>::quiet_NaN());
    } else {
      ring_.pop(tick, row_.data());
      block.row(rows++) = Eigen::Map<const Eigen::RowVectorXd>(row_.data(), static_cast<Index>(row_.size()));
    }
    ++expected_;
  }
  return rows;
}

std::vector<std::pair<std::string, std::string>> RingSource::status() const {
  return {{"samples lost to the view", std::to_string(ring_.dropped())}};
}

}  // namespace whirl::monitor
