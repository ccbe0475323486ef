#include "whirl/hardware/at_rest.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace whirl::hardware {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kSpeed = 0.1;    // rad/s, a turn a minute: an encoder of 4096 counts that dithers by one shows half
constexpr double kMemory = 0.2;   // s
constexpr double kWatched = 0.5;  // s
constexpr double kPulse = 0.5;    // V between the levels of a pulse: less is noise

}  // namespace

RestWatch::RestWatch(const IoSettings& io) noexcept
    : tacho_(io.tacho.analog),
      limit_(kSpeed),
      memory_(1 / (kMemory * io.rate)),
      least_(std::lround(io.rate * (io.tacho.analog >= 0 ? std::max(io.tacho.learn, kWatched) : kWatched))) {
  low_.fill(std::numeric_limits<double>::infinity());
  high_.fill(-std::numeric_limits<double>::infinity());
  // A count within the time of the filter, twice: more than any pattern of one count brings out of it.
  if (io.driver != "udp")
    limit_ = std::max(limit_, 2 * kTurn / std::abs(io.vendor.counts) * kTurn * io.vendor.bandwidth);
}

void RestWatch::see(const rt::BoardReading& reading) noexcept {
  if (ticks_ == 0) speed_ = reading.omega;
  speed_ += std::min(memory_, 1.0) * (reading.omega - speed_);
  if (tacho_ >= 0) {
    // The third ones count: one sample alone may be a disturbance, a pulse shows three.
    const double volts = reading.analog[static_cast<std::size_t>(tacho_)];
    low_[0] = std::min(low_[0], volts), high_[0] = std::max(high_[0], volts);
    for (std::size_t i = 1; i < low_.size(); ++i) {
      if (low_[i - 1] < low_[i]) std::swap(low_[i - 1], low_[i]);
      if (high_[i - 1] > high_[i]) std::swap(high_[i - 1], high_[i]);
    }
  }
  ++ticks_;
}

std::string RestWatch::refusal() const {
  if (tacho_ >= 0) {  // the board's own speed is none
    if (high_[0] - low_[0] <= kPulse) return {};
    return fmt::format("the tacho on input {} gives pulses ({:.2f} to {:.2f} V): let the shaft come to rest", tacho_,
                       low_[0], high_[0]);
  }
  if (!(std::abs(speed_) > limit_)) return {};
  return fmt::format("the shaft turns at {:.1f} rad/s: let it come to rest", speed_);
}

}  // namespace whirl::hardware
