#include "whirl/rt/drivers/optoncdt_simulator.hpp"

#include <chrono>
#include <thread>

#include "whirl/rt/drivers/optoncdt_line.hpp"

namespace whirl::rt::optoncdt {

struct Simulator::State {
  Options options;
  DeviceLine line;
  std::string device;
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> measured{0};
  std::thread thread;

  explicit State(Options o) : options(std::move(o)), device(line.device()) {
    line.refuse = options.refuse;
    line.mute = options.mute;
    line.lose_byte_every = options.lose_byte_every;
    line.streaming = options.streaming;
    thread = std::thread([this] { run(); });
  }
  ~State() { halt(); }
  void halt() {
    stop = true;
    if (thread.joinable()) thread.join();
  }

  void run() {
    using Clock = std::chrono::steady_clock;
    Clock::time_point start = Clock::now();
    std::uint64_t done = 0;  // measurements since `start`
    while (!stop) {
      line.wait(1e-3);
      if (line.answer()) start = Clock::now(), done = 0;
      if (line.streaming) {
        const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
        for (const auto due = static_cast<std::uint64_t>(elapsed * line.rate()); done < due; ++done) {
          const std::uint64_t k = measured++;
          line.send(options.value(k), k);
        }
      }
      line.flush();
    }
  }
};

Simulator::Simulator(Options options) : state_(std::make_unique<State>(std::move(options))) {}
Simulator::~Simulator() = default;
const std::string& Simulator::device() const { return state_->device; }
std::uint64_t Simulator::sent() const { return state_->measured; }
void Simulator::unplug() {
  state_->halt();
  state_->line.unplug();
}

}  // namespace whirl::rt::optoncdt
