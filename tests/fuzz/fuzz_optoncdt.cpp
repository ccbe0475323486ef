// Serial bytes of the laser: any bytes give only values of 18 bits, and an error code never becomes a
// distance.
#include <cmath>

#include "harness.hpp"
#include "whirl/rt/drivers/optoncdt.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  using namespace whirl::rt::optoncdt;
  const auto* data = reinterpret_cast<const std::uint8_t*>(bytes.data());
  const std::size_t size = bytes.size();
  static const Scale scale(0.010), mastered(0.010, true);
  for (const int values : {1, 3}) {
    FrameDecoder decoder(values);
    decoder.feed({data, size}, [&](const Frame& frame) {
      for (const std::uint32_t raw : frame.raw) {
        if (raw > kValueMask) std::abort();
      }
      for (const Scale* s : {&scale, &mastered}) {
        const Reading r = (*s)(frame.raw[0]);
        if ((r.error == SensorError::none) != std::isfinite(r.distance)) std::abort();
        if (frame.raw[0] >= 262072 && r.error == SensorError::none) std::abort();
      }
    });
    const LineStatistics& s = decoder.statistics();
    if (s.bytes != size || s.dropped + 3 * s.values > size || size - s.dropped - 3 * s.values > 2) std::abort();
  }
}
