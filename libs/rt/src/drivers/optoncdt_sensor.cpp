#include "whirl/rt/drivers/optoncdt_sensor.hpp"

#include <fmt/format.h>

// termios2 and BOTHER take any baud rate; their header excludes <termios.h>.
#include <asm/termbits.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <string_view>

#include "whirl/core/error.hpp"

namespace whirl::rt::optoncdt {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kCleanFrames = 8;

Clock::time_point deadline_in(double seconds) {
  return Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
}

/// Waits for bytes until the deadline and reads them; 0 when the time is over, -1 when the line failed.
ssize_t read_until(int fd, void* to, std::size_t size, Clock::time_point deadline) {
  while (true) {
    const auto left = std::chrono::duration_cast<std::chrono::milliseconds>(deadline - Clock::now()).count();
    if (left <= 0) return 0;
    pollfd p{fd, POLLIN, 0};
    const int ready = ::poll(&p, 1, static_cast<int>(left));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) return ready;
    const ssize_t n = ::read(fd, to, size);
    if (n > 0) return n;
    if (n == 0 || (errno != EAGAIN && errno != EINTR)) return -1;
  }
}

int open_line(const SensorOptions& options) {
  const int fd = ::open(options.device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0) throw Error::in_file(options.device, 0, fmt::format("cannot be opened: {}", std::strerror(errno)));
  termios2 t{};
  bool good = ::ioctl(fd, TCGETS2, &t) == 0;
  t.c_iflag = 0;
  t.c_oflag = 0;
  t.c_lflag = 0;
  t.c_cflag = CS8 | CREAD | CLOCAL | BOTHER | (BOTHER << IBSHIFT);
  t.c_ispeed = t.c_ospeed = static_cast<speed_t>(options.baud);
  t.c_cc[VMIN] = 0;
  t.c_cc[VTIME] = 0;
  good = good && ::ioctl(fd, TCSETS2, &t) == 0;
  if (!good) {
    const int reason = errno;
    ::close(fd);
    throw Error::in_file(options.device, 0,
                         fmt::format("is no serial line with {} baud: {}", options.baud, std::strerror(reason)));
  }
  ::ioctl(fd, TCFLSH, TCIOFLUSH);
  return fd;
}

}  // namespace

Sensor::Sensor(const SensorOptions& options)
    : options_(options),
      scale_(options.range, options.mastering),
      decoder_(options.counter ? 2 : 1, options.counter ? 1 : -1) {
  require_range("baud", options.baud, 9600, 1000000);
  require_range("measuring_rate", options.measuring_rate, 250, 8000, "Hz");
  require_range("timeout", options.timeout, 1e-3, 60, "s");
  fd_ = open_line(options);
  try {
    command("OUTPUT NONE");
    command(fmt::format("MEASRATE {:g}", options.measuring_rate / 1000));
    command("OUTREDUCEDEVICE NONE");
    command(options.counter ? "OUTADD_RS422 COUNTER" : "OUTADD_RS422 NONE");
    command("OUTPUT RS422");
    wait_for_frames();
  } catch (...) {
    ::close(fd_);
    throw;
  }
  connected_ = true;
}

Sensor::~Sensor() {
  constexpr std::string_view kStop = "OUTPUT NONE\n";
  if (connected_) (void)!::write(fd_, kStop.data(), kStop.size());
  ::close(fd_);
}

void Sensor::command(const std::string& text) {
  const std::string line = text + "\n";
  if (::write(fd_, line.data(), line.size()) != static_cast<ssize_t>(line.size())) {
    throw Error::in_file(options_.device, 0,
                         fmt::format("command '{}' cannot be sent: {}", text, std::strerror(errno)));
  }
  // The reply ends with the prompt. Frames still on their way cannot imitate it: in a frame a byte of class
  // 00 is followed by one of class 01, and both characters of "->" are of class 00.
  std::string reply;
  const auto deadline = deadline_in(options_.timeout);
  while (reply.find("->") == std::string::npos) {
    std::array<char, 256> buffer;
    const ssize_t n = read_until(fd_, buffer.data(), buffer.size(), deadline);
    if (n <= 0) {
      throw Error::in_file(options_.device, 0,
                           fmt::format("no answer to '{}' within {:g} s; is the sensor connected and set to {} baud?",
                                       text, options_.timeout, options_.baud));
    }
    reply.append(buffer.data(), static_cast<std::size_t>(n));
    if (reply.size() > (1u << 16)) reply.erase(0, 1u << 15);
  }
  // "Exxx text" refuses the command, "Wxxx text" warns; three digits cannot be part of a frame either.
  const auto is_digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 0; i + 3 < reply.size(); ++i) {
    if ((reply[i] != 'E' && reply[i] != 'W') || !is_digit(reply[i + 1]) || !is_digit(reply[i + 2]) ||
        !is_digit(reply[i + 3])) {
      continue;
    }
    const std::string message = reply.substr(i, reply.find_first_of("\r\n-", i) - i);
    if (reply[i] == 'E')
      throw Error::in_file(options_.device, 0, fmt::format("the sensor refused '{}': {}", text, message));
    warnings_.push_back(text + ": " + message);
  }
}

void Sensor::wait_for_frames() {
  const auto deadline = deadline_in(options_.timeout);
  int clean = 0;
  while (clean < kCleanFrames) {
    const ssize_t n = read_until(fd_, bytes_.data(), bytes_.size(), deadline);
    if (n <= 0) {
      throw Error::in_file(
          options_.device, 0,
          fmt::format("{} clean frames within {:g} s after the start, {} are needed ({} bytes, {} dropped)", clean,
                      options_.timeout, kCleanFrames, statistics().bytes, statistics().dropped));
    }
    end_ = static_cast<std::size_t>(n);
    for (begin_ = 0; begin_ < end_ && clean < kCleanFrames; ++begin_) {
      const auto spoilt = [this] { return statistics().dropped + statistics().incomplete + statistics().unconfirmed; };
      const std::uint64_t before = spoilt();
      Frame frame;
      if (decoder_.push(bytes_[begin_], frame)) {
        (void)accept(frame);
        ++clean;
      }
      if (spoilt() != before) clean = 0;
    }
  }
}

Sample Sensor::accept(const Frame& frame) noexcept {
  if (options_.counter && started_) {
    const std::uint32_t gap = lost_between(counter_, frame.raw[1]);
    lost_ += gap;
    index_ += gap;
  }
  counter_ = options_.counter ? frame.raw[1] : 0;
  if (started_) ++index_;
  started_ = true;
  return {scale_(frame.raw[0]), index_, frame.raw[0], counter_};
}

std::size_t Sensor::read(std::span<Sample> out) noexcept {
  std::size_t count = 0;
  Frame frame;
  while (connected_ && count < out.size()) {
    if (begin_ == end_) {
      const ssize_t n = ::read(fd_, bytes_.data(), bytes_.size());
      if (n <= 0) {
        // Nothing there: with VMIN = 0 that is 0 or EAGAIN. A line that hung up says EIO, or 0 together with
        // POLLHUP.
        pollfd p{fd_, POLLIN, 0};
        if ((n < 0 && errno != EAGAIN && errno != EINTR) ||
            (::poll(&p, 1, 0) > 0 && (p.revents & (POLLHUP | POLLERR)))) {
          connected_ = false;
        }
        break;
      }
      begin_ = 0;
      end_ = static_cast<std::size_t>(n);
    }
    while (begin_ < end_ && count < out.size()) {
      if (decoder_.push(bytes_[begin_++], frame)) out[count++] = accept(frame);
    }
  }
  return count;
}

}  // namespace whirl::rt::optoncdt
