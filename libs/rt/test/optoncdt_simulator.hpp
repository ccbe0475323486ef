#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>

#include "whirl/rt/drivers/optoncdt_line.hpp"

namespace whirl::rt::optoncdt {

/// A laser on a pseudo-terminal: answers the commands of the start-up with prompts, streams frames at the measuring
/// rate in real time, and can spoil the line.
class Simulator {
 public:
  struct Options {
    /// Raw value of measurement k (18 bits; error codes allowed).
    std::function<std::uint32_t(std::uint64_t k)> value = [](std::uint64_t) { return 32760u; };
    unsigned lose_byte_every = 0;  ///< leaves out every n-th byte of the frames; 0: none
    std::string refuse;            ///< a command starting so is answered with an error
    bool mute = false;             ///< never answers
    bool streaming = true;         ///< already sends frames before the first command, as a sensor that was left running
  };
  explicit Simulator(Options options) : options_(std::move(options)), device_(line_.device()) {
    line_.refuse = options_.refuse;
    line_.mute = options_.mute;
    line_.lose_byte_every = options_.lose_byte_every;
    line_.streaming = options_.streaming;
    thread_ = std::thread([this] { run(); });
  }
  ~Simulator() { halt(); }
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  const std::string& device() const { return device_; }  ///< path to open as the serial line
  void unplug() {                                        ///< closes the line
    halt();
    line_.unplug();
  }

 private:
  void halt() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  void run() {
    using Clock = std::chrono::steady_clock;
    Clock::time_point start = Clock::now();
    std::uint64_t done = 0, measured = 0;  // since `start`; in all
    while (!stop_) {
      line_.wait(1e-3);
      if (line_.answer()) start = Clock::now(), done = 0;
      if (line_.streaming) {
        const double elapsed = std::chrono::duration<double>(Clock::now() - start).count();
        for (const auto due = static_cast<std::uint64_t>(elapsed * line_.rate()); done < due; ++done) {
          const std::uint64_t k = measured++;
          line_.send(options_.value(k), k);
        }
      }
      line_.flush();
    }
  }

  Options options_;
  DeviceLine line_;
  std::string device_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace whirl::rt::optoncdt
