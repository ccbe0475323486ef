// The stream that both benchmarks of the live view watch: 16 channels at 10 kHz, pushed by a loop of a controller's
// kind.
#pragma once
#include <cmath>
#include <memory>
#include <optional>
#include <string>

#include "whirl/monitor/server.hpp"
#include "whirl/rt/pace.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::bench {

constexpr double kRate = 10'000;
constexpr std::size_t kChannels = 16;

inline monitor::StreamInfo stream_info() {
  monitor::StreamInfo info{"load", kRate, {}};
  for (std::size_t c = 0; c < kChannels; ++c) {
    info.channels.push_back({c == 0   ? "x"
                             : c == 1 ? "y"
                             : c == 2 ? "beta"
                                      : "c" + std::to_string(c),
                             c == 2 ? Quantity::angle : Quantity::displacement});
  }
  return info;
}

/// The stream served on any free port, with the spectra that the program would choose.
struct Served {
  Served() {
    hub.start();
    server->start();
  }
  ~Served() { stop(); }
  void stop() {
    server.reset();
    hub.stop();
  }
  static monitor::HubOptions hub_options() {
    monitor::HubOptions options;
    options.spectrum.block = monitor::block_for(kRate);
    return options;
  }
  static monitor::ServerOptions any_port() {
    monitor::ServerOptions options;
    options.port = 0;
    return options;
  }
  monitor::SampleRing ring{kChannels, 1 << 15};
  monitor::Hub hub{std::make_unique<monitor::RingSource>(stream_info(), ring), hub_options()};
  std::optional<monitor::Server> server{std::in_place, hub, any_port()};
};

/// The cycle of a controller: some arithmetic on each channel, then the push.
inline rt::LoopTiming loop(double seconds, monitor::SampleRing* ring) {
  const rt::RealtimeThread realtime({});
  rt::WallTime time;
  rt::PaceOptions options;
  options.period = std::llround(1e9 / kRate);
  rt::PacedClock<rt::WallTime> clock(time, options);
  double row[kChannels] = {};
  const long ticks = std::lround(seconds * kRate);
  for (long tick = 0; tick < ticks; ++tick) {
    tick += clock.wait();
    const double beta = 2 * 3.141592653589793 * 25 * static_cast<double>(tick) / kRate;
    for (std::size_t c = 0; c < kChannels; ++c) row[c] = 1e-3 * std::cos(beta + 0.1 * static_cast<double>(c));
    row[2] = beta;
    if (ring) ring->push(static_cast<std::uint64_t>(tick), row);
  }
  return clock.timing();
}

}  // namespace whirl::bench
