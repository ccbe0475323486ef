#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "whirl/rt/drivers/optoncdt.hpp"

namespace whirl::rt::optoncdt {

/// The sensor's end of the serial line, on a pseudo-terminal: answers the commands of the start-up with prompts
/// and sends frames. When frames are due is the caller's business. Not for several threads.
class DeviceLine {
 public:
  /// Throws Error when there is no pseudo-terminal.
  DeviceLine();
  ~DeviceLine();
  DeviceLine(const DeviceLine&) = delete;
  DeviceLine& operator=(const DeviceLine&) = delete;

  std::string refuse;            ///< a command starting so is answered with an error
  bool mute = false;             ///< never answers
  unsigned lose_byte_every = 0;  ///< leaves out every n-th byte of the frames; 0: none
  double only_rate = 0;          ///< Hz; the one measuring rate that is accepted; 0: 250 to 8000
  bool streaming = true;         ///< sends frames, as a sensor that was left running

  const std::string& device() const { return device_; }  ///< path to open as the serial line
  double rate() const { return rate_; }                  ///< Hz
  /// Reads what has come and answers; true when a command changed rate or output, so that time starts anew.
  bool answer();
  /// One measurement: its value (18 bits, error codes allowed) and number. Nothing while the output is off. What
  /// the line does not take waits; a reader that stays away loses whole frames.
  void send(std::uint32_t raw, std::uint64_t number);
  /// Hands over what waits.
  void flush();
  /// Waits up to `seconds` for a command.
  void wait(double seconds) const;
  void unplug();  ///< closes the line

 private:
  bool obey(const std::string& command);
  void reply(std::string_view text);

  int master_ = -1, slave_ = -1;  // the slave stays open so that the master sees no hang-up between users
  std::string device_, input_, pending_;
  bool counter_ = false;
  double rate_ = 4000;
  std::uint64_t bytes_made_ = 0;
};

}  // namespace whirl::rt::optoncdt
