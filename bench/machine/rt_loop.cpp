// What the loop costs beside sensor, law and actuator. Google Benchmark; the law is one multiplication.
#include <benchmark/benchmark.h>

#include <vector>

#include "whirl/rt/clock.hpp"
#include "whirl/rt/drivers/optoncdt.hpp"
#include "whirl/rt/drivers/udp_board.hpp"
#include "whirl/rt/histogram.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/loop_sample.hpp"
#include "whirl/rt/pace.hpp"
#include "whirl/rt/realtime.hpp"
#include "whirl/rt/record_queue.hpp"

namespace {

using namespace whirl;

struct Rig {
  Measurement m{.x = 1e-4, .y = 1e-4, .omega = 75};
  Command sent;
  Measurement read() noexcept {
    m.beta += 0.075;
    return m;
  }
  void write(const Command& u) noexcept { sent = u; }
  void advance() const noexcept {}
};
struct Law {
  Expected<Command, Fault> step(const Measurement& m) noexcept { return Command{-1e4 * m.x, -1e4 * m.y}; }
  void applied(const Command&) noexcept {}
};

// One cycle with all limits, with and without what the release of a trip learns.
void cycle(benchmark::State& state) {
  Rig rig;
  Law law;
  rt::SimulatedClock clock(1e-3);
  const rt::SafetyLimits limits{.force = 10, .slew = 5, .displacement = 1e-2, .stale = 20};
  rt::Loop loop(rig, law, clock, limits, {.release = state.range(0)});
  for (auto _ : state) benchmark::DoNotOptimize(loop.cycle());
}
BENCHMARK(cycle)->Arg(0)->Arg(3000);

struct NoWait {
  rt::WallTime wall;
  std::int64_t now() const noexcept { return wall.now(); }
  void sleep_until(std::int64_t) const noexcept {}
};
// The clock's own work: policy, three histograms, reading the time twice.
void pace_of_a_cycle(benchmark::State& state) {
  NoWait time;
  rt::PacedClock clock(time, rt::PaceOptions{});
  for (auto _ : state) benchmark::DoNotOptimize(clock.wait());
}
BENCHMARK(pace_of_a_cycle);

void queue_push_and_pop(benchmark::State& state) {
  rt::RecordQueue<rt::LoopSample> queue(1 << 14);
  rt::LoopSample sample;
  for (auto _ : state) {
    queue.push(sample);
    benchmark::DoNotOptimize(queue.pop(sample));
  }
}
BENCHMARK(queue_push_and_pop);

// `lines`: how many serial lines of 921 600 baud (92 160 bytes a second) one processor could decode.
void decode_laser(benchmark::State& state) {
  using namespace rt::optoncdt;
  std::vector<std::uint8_t> bytes;
  for (std::uint32_t k = 0; k < 1u << 18; ++k) {
    for (const Value v : {Value{k * 7 % 65520, true}, Value{k & kValueMask, false}}) {
      for (const std::uint8_t b : encode(v)) bytes.push_back(b);
    }
  }
  FrameDecoder decoder(2, 1);
  long frames = 0;
  for (auto _ : state) decoder.feed(bytes, [&](const Frame& f) { frames += f.raw[0] > 0; });
  benchmark::DoNotOptimize(frames);
  const double total = static_cast<double>(state.iterations()) * static_cast<double>(bytes.size());
  state.SetBytesProcessed(static_cast<std::int64_t>(total));
  state.counters["lines"] = benchmark::Counter(total / 92160, benchmark::Counter::kIsRate);
}
BENCHMARK(decode_laser)->Unit(benchmark::kMillisecond);

void board_datagrams(benchmark::State& state) {
  std::array<std::byte, rt::board::kReadingSize> bytes;
  rt::BoardReading reading;
  for (auto _ : state) {
    ++reading.tick;
    rt::board::encode(reading, bytes);
    benchmark::DoNotOptimize(rt::board::decode_reading(bytes));
  }
}
BENCHMARK(board_datagrams);

}  // namespace

BENCHMARK_MAIN();
