#include "whirl/rt/drivers/optoncdt_line.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <cstring>

#include "whirl/core/error.hpp"

namespace whirl::rt::optoncdt {

constexpr std::size_t kMostPending = 16384;  // bytes, half a second of frames at 4 kHz

DeviceLine::DeviceLine() {
  master_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (master_ < 0 || ::grantpt(master_) != 0 || ::unlockpt(master_) != 0 || !::ptsname(master_)) {
    const int reason = errno;
    unplug();
    throw Error(fmt::format("no pseudo-terminal: {}", std::strerror(reason)));
  }
  device_ = ::ptsname(master_);
  slave_ = ::open(device_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  termios t{};
  if (slave_ < 0 || ::tcgetattr(slave_, &t) != 0) {
    const int reason = errno;
    unplug();
    throw Error::in_file(device_, 0, std::strerror(reason));
  }
  ::cfmakeraw(&t);
  ::tcsetattr(slave_, TCSANOW, &t);
}

DeviceLine::~DeviceLine() { unplug(); }

void DeviceLine::unplug() {
  if (slave_ >= 0) ::close(slave_);
  if (master_ >= 0) ::close(master_);
  slave_ = master_ = -1;
}

void DeviceLine::wait(double seconds) const {
  pollfd p{master_, POLLIN, 0};
  ::poll(&p, 1, static_cast<int>(std::ceil(1e3 * seconds)));
}

bool DeviceLine::answer() {
  char buffer[256];
  const ssize_t n = ::read(master_, buffer, sizeof buffer);
  if (n > 0) input_.append(buffer, static_cast<std::size_t>(n));
  bool changed = false;
  for (std::size_t end; (end = input_.find_first_of("\r\n")) != std::string::npos;) {
    const std::string command = input_.substr(0, end);
    input_.erase(0, end + 1);
    if (!mute && !command.empty()) changed = obey(command) || changed;
  }
  return changed;
}

bool DeviceLine::obey(const std::string& command) {
  const auto is = [&](std::string_view start) { return command.starts_with(start); };
  bool changed = false;
  if (!refuse.empty() && is(refuse)) {
    reply("E204 unsupported command\r\n->");
    return false;
  }
  if (is("OUTPUT ")) {
    streaming = is("OUTPUT RS422");
    changed = true;
  } else if (is("MEASRATE ")) {
    const double asked = 1000 * std::strtod(command.c_str() + 9, nullptr);
    const bool good = only_rate > 0 ? std::abs(asked - only_rate) < 1e-6 * only_rate : asked >= 250 && asked <= 8000;
    if (!good) {
      reply("E211 value out of range\r\n->");
      return false;
    }
    rate_ = asked;
    changed = true;
  } else if (is("OUTADD_RS422 ")) {
    counter_ = command.find("COUNTER") != std::string::npos;
  } else if (!is("OUTREDUCEDEVICE ")) {
    reply("E204 unsupported command\r\n->");
    return false;
  }
  reply("\r\n->");
  return changed;
}

void DeviceLine::reply(std::string_view text) {
  pending_ += text;
  flush();
}

void DeviceLine::send(std::uint32_t raw, std::uint64_t number) {
  if (!streaming || pending_.size() > kMostPending) return;
  const auto add = [&](Value v) {
    for (const std::uint8_t byte : encode(v)) {
      ++bytes_made_;
      if (lose_byte_every == 0 || bytes_made_ % lose_byte_every != 0) pending_ += static_cast<char>(byte);
    }
  };
  add({raw & kValueMask, true});
  if (counter_) add({static_cast<std::uint32_t>(number) & kValueMask, false});
}

void DeviceLine::flush() {
  if (pending_.empty() || master_ < 0) return;
  const ssize_t n = ::write(master_, pending_.data(), pending_.size());
  if (n > 0) pending_.erase(0, static_cast<std::size_t>(n));
}

}  // namespace whirl::rt::optoncdt
