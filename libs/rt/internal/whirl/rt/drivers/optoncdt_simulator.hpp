#pragma once
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "whirl/rt/drivers/optoncdt.hpp"

namespace whirl::rt::optoncdt {

/// A laser on a pseudo-terminal, for tests and for trying the program without hardware: answers the commands
/// of the start-up with prompts, streams frames at the measuring rate in real time, and can spoil the line.
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
  explicit Simulator(Options options);
  ~Simulator();
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  const std::string& device() const;  ///< path to open as the serial line
  std::uint64_t sent() const;         ///< measurements so far, lost ones included
  void unplug();                      ///< closes the line

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace whirl::rt::optoncdt
