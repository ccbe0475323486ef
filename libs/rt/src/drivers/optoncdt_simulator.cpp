#include "whirl/rt/drivers/optoncdt_simulator.hpp"

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "whirl/core/error.hpp"

namespace whirl::optoncdt {

struct Simulator::State {
  Options options;
  int master = -1, slave = -1;  // the slave stays open so that the master sees no hang-up between users
  std::string device;
  std::atomic<bool> stop{false};
  std::atomic<std::uint64_t> measured{0};
  std::thread thread;

  // Of the thread.
  std::string input, pending;
  bool streaming = false, counter = false;
  double rate = 4000;
  std::chrono::steady_clock::time_point start;
  std::uint64_t due_before = 0, bytes_made = 0;

  explicit State(Options o) : options(std::move(o)) {
    master = ::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (master < 0 || ::grantpt(master) != 0 || ::unlockpt(master) != 0 || !::ptsname(master)) {
      const int reason = errno;
      close_all();
      throw Error(fmt::format("no pseudo-terminal: {}", std::strerror(reason)));
    }
    device = ::ptsname(master);
    slave = ::open(device.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    termios t{};
    if (slave < 0 || ::tcgetattr(slave, &t) != 0) {
      const int reason = errno;
      close_all();
      throw Error::in_file(device, 0, std::strerror(reason));
    }
    ::cfmakeraw(&t);
    ::tcsetattr(slave, TCSANOW, &t);
    streaming = options.streaming;
    start = std::chrono::steady_clock::now();
    thread = std::thread([this] { run(); });
  }
  ~State() {
    halt();
    close_all();
  }
  void halt() {
    stop = true;
    if (thread.joinable()) thread.join();
  }
  void close_all() {
    if (slave >= 0) ::close(slave);
    if (master >= 0) ::close(master);
    slave = master = -1;
  }

  /// What the line does not take at once waits: a slow reader gets the frames late, but gets them.
  void send(std::string_view bytes) {
    pending += bytes;
    const ssize_t n = ::write(master, pending.data(), pending.size());
    if (n > 0) pending.erase(0, static_cast<std::size_t>(n));
  }

  void answer(const std::string& command) {
    if (options.mute || command.empty()) return;
    const auto is = [&](std::string_view start_of) { return command.starts_with(start_of); };
    if (!options.refuse.empty() && is(options.refuse)) {
      send("E204 unsupported command\r\n->");
      return;
    }
    if (is("OUTPUT ")) {
      streaming = is("OUTPUT RS422");
      restart();
    } else if (is("MEASRATE ")) {
      rate = 1000 * std::strtod(command.c_str() + 9, nullptr);
      if (!(rate >= 250 && rate <= 8000)) {
        rate = 4000;
        send("E211 value out of range\r\n->");
        return;
      }
      restart();
    } else if (is("OUTADD_RS422 ")) {
      counter = command.find("COUNTER") != std::string::npos;
    } else if (!is("OUTREDUCEDEVICE ")) {
      send("E204 unsupported command\r\n->");
      return;
    }
    send("\r\n->");
  }

  void restart() {
    start = std::chrono::steady_clock::now();
    due_before = 0;
  }

  void stream() {
    const double elapsed = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const auto due = static_cast<std::uint64_t>(elapsed * rate);
    std::string out;
    const auto add = [&](Value v) {
      for (const std::uint8_t byte : encode(v)) {
        ++bytes_made;
        if (options.lose_byte_every == 0 || bytes_made % options.lose_byte_every != 0)
          out += static_cast<char>(byte);
      }
    };
    for (; due_before < due; ++due_before) {
      const std::uint64_t k = measured++;
      add({options.value(k) & kValueMask, true});
      if (counter) add({static_cast<std::uint32_t>(k) & kValueMask, false});
    }
    if (!out.empty()) send(out);
  }

  void run() {
    while (!stop) {
      pollfd p{master, POLLIN, 0};
      ::poll(&p, 1, 1);
      char buffer[256];
      const ssize_t n = (p.revents & POLLIN) ? ::read(master, buffer, sizeof buffer) : 0;
      if (n > 0) input.append(buffer, static_cast<std::size_t>(n));
      for (std::size_t end; (end = input.find_first_of("\r\n")) != std::string::npos;) {
        const std::string command = input.substr(0, end);
        input.erase(0, end + 1);
        answer(command);
      }
      if (streaming) stream();
      send({});
    }
  }
};

Simulator::Simulator(Options options) : state_(std::make_unique<State>(std::move(options))) {}
Simulator::~Simulator() = default;
const std::string& Simulator::device() const { return state_->device; }
std::uint64_t Simulator::sent() const { return state_->measured; }
void Simulator::unplug() {
  state_->halt();
  state_->close_all();
}

}  // namespace whirl::optoncdt
