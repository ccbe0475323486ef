#include "whirl/monitor/sample_ring.hpp"

#include <bit>

#include "whirl/core/error.hpp"

namespace whirl::monitor {

SampleRing::SampleRing(std::size_t channels, std::size_t capacity)
    : channels_(channels), mask_(std::bit_ceil(capacity) - 1), ticks_(mask_ + 1), values_((mask_ + 1) * channels) {
  require_range("channels", static_cast<double>(channels), 1, 1024);
  require_range("capacity", static_cast<double>(capacity), 2, 1 << 24);
}

}  // namespace whirl::monitor
