// What the live view costs the loop: one push per control tick.
#include <benchmark/benchmark.h>

#include <memory>
#include <vector>

#include "whirl/monitor/hub.hpp"
#include "whirl/monitor/sample_ring.hpp"

namespace {

using namespace whirl::monitor;

/// 1024 accepted rows; the ring is emptied between the rounds.
void push(benchmark::State& state) {
  SampleRing ring(static_cast<std::size_t>(state.range(0)), 1024);
  std::vector<double> row(ring.channels(), 1.5), out(ring.channels());
  std::uint64_t tick = 0;
  for (auto _ : state) {
    for (int i = 0; i < 1024; ++i) ring.push(tick++, row.data());
    state.PauseTiming();
    std::uint64_t taken = 0;
    while (ring.pop(taken, out.data())) {
    }
    state.ResumeTiming();
  }
  state.SetItemsProcessed(static_cast<std::int64_t>(tick));
  state.counters["refused"] = static_cast<double>(ring.dropped());
}
BENCHMARK(push)->Arg(8)->Arg(32);

/// One step of the hub with 40 ms of a stream of eight channels and four clients.
void hub_step(benchmark::State& state) {
  const double rate = static_cast<double>(state.range(0));
  StreamInfo info{"bench", rate, {}};
  for (int c = 0; c < 8; ++c) info.channels.push_back({"x" + std::to_string(c), whirl::Quantity::displacement});
  SampleRing ring(8, 1 << 15);
  Hub hub(std::make_unique<RingSource>(info, ring), {});
  std::vector<std::shared_ptr<ClientQueue>> clients;
  for (int i = 0; i < 4; ++i) hub.add(clients.emplace_back(std::make_shared<ClientQueue>(64)));
  std::uint64_t tick = 0;
  double row[8] = {};
  for (auto _ : state) {
    state.PauseTiming();
    for (int i = 0; i < static_cast<int>(0.04 * rate); ++i) {
      row[0] = static_cast<double>(tick % 100);
      ring.push(tick++, row);
    }
    state.ResumeTiming();
    hub.step();
  }
}
BENCHMARK(hub_step)->Arg(1000)->Arg(100000)->Unit(benchmark::kMicrosecond);

}  // namespace

BENCHMARK_MAIN();
