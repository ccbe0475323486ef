#include "whirl/rt/drivers/iio_board.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <sched.h>
#include <signal.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <optional>
#include <thread>

#include "iio_library.hpp"
#include "whirl/rt/drivers/angle_tracker.hpp"
#include "whirl/rt/latest_value.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::rt {
namespace {

constexpr double kTransfer = 1;   // s that a transfer may take, beside twice the watchdog's time
constexpr unsigned kBuffers = 4;  // of the kernel, one sample each
constexpr const char* kTimestamp = "timestamp";

/// Wakes whoever polls it.
class Event {
 public:
  Event() : fd_(::eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC)) {
    if (fd_ == -1) throw Error(fmt::format("board iio: eventfd: {}", std::strerror(errno)));
  }
  ~Event() { ::close(fd_); }
  Event(const Event&) = delete;
  Event& operator=(const Event&) = delete;
  int descriptor() const noexcept { return fd_; }
  void signal() const noexcept {
    const std::uint64_t one = 1;
    (void)!::write(fd_, &one, sizeof one);
  }
  void clear() const noexcept {
    std::uint64_t count = 0;
    (void)!::read(fd_, &count, sizeof count);
  }

 private:
  int fd_;
};

/// libiio writes to a closed connection without guarding against SIGPIPE, which would end the program: held back in
/// this thread while the object lives.
class NoPipeSignal {
 public:
  NoPipeSignal() noexcept {
    sigemptyset(&pipe_);
    sigaddset(&pipe_, SIGPIPE);
    pthread_sigmask(SIG_BLOCK, &pipe_, &before_);
  }
  ~NoPipeSignal() {
    const timespec none{};
    if (sigismember(&before_, SIGPIPE) != 0) return;
    while (sigtimedwait(&pipe_, nullptr, &none) == SIGPIPE) {
    }
    pthread_sigmask(SIG_SETMASK, &before_, nullptr);
  }
  NoPipeSignal(const NoPipeSignal&) = delete;
  NoPipeSignal& operator=(const NoPipeSignal&) = delete;

 private:
  sigset_t pipe_{}, before_{};
};

}  // namespace

struct IioBoard::Work {
  struct Input {
    iio::Channel* channel = nullptr;
    iio::Connection::Scale scale;
  };

  explicit Work(const IioBoardOptions& o)
      : options(o),
        library(o.library),
        in(library, o.uri),
        out(library, o.uri),
        angle(o.counts, o.bandwidth, o.sample_time) {
    find_outputs();
    find_inputs();
    find_angle();
    const auto patience = static_cast<unsigned>(1e3 * (kTransfer + 2 * o.watchdog));
    in.set_timeout(patience);
    out.set_timeout(patience);
    for (const Input& line : outputs) {
      out.check(set(line, 0), fmt::format("0 V on output {}", library.channel_id(line.channel)));
    }
    if (o.buffer) open_buffer();
    reader = std::thread([this] { run_as("iio in", [this] { read_all(); }); });
    writer = std::thread([this] { run_as("iio out", [this] { write_all(); }); });
  }
  ~Work() {
    over = true;
    if (buffer) library.cancel(buffer);
    asked.signal();
    reader.join();
    writer.join();
    if (buffer) library.destroy_buffer(buffer);
  }
  Work(const Work&) = delete;
  Work& operator=(const Work&) = delete;

  // Setting up.

  void find_outputs() {
    const iio::Device* dac = out.device(options.output_device, "output_device");
    const std::array<const char*, 2> keys{"output_x", "output_y"};
    for (std::size_t i = 0; i < 2; ++i) {
      outputs[i].channel = out.channel(dac, options.outputs[i], true, keys[i]);
      outputs[i].scale = out.scale(outputs[i].channel, options.output_scale, options.output_offset, "output_scale_mV");
    }
  }
  void find_inputs() {
    device = in.device(options.input_device, "input_device");
    for (std::size_t i = 0; i < 4; ++i) {
      if (options.inputs[i].empty()) continue;
      const std::string key = fmt::format("input_{}", i);
      inputs[i].channel = in.channel(device, options.inputs[i], false, key.c_str());
      inputs[i].scale = in.scale(inputs[i].channel, options.input_scale, options.input_offset, "input_scale_mV");
      require_source(inputs[i].channel, options.buffer);
    }
  }
  void find_angle() {
    const bool apart = !options.angle_device.empty() && options.angle_device != options.input_device;
    const iio::Device* of = apart ? in.device(options.angle_device, "angle_device") : device;
    angle_channel = in.channel(of, options.angle, false, "angle");
    angle_buffered = options.buffer && !apart;
    require_source(angle_channel, angle_buffered);
    unsigned bits = static_cast<unsigned>(options.angle_bits);
    if (bits == 0) bits = library.is_scan_element(angle_channel) ? library.format(angle_channel)->bits : 32;
    // A count of fewer bits than 32 fills the upper ones, so that both wrap at the same place.
    angle_shift = 32 - std::clamp(bits, 1u, 32u);
    angle =
        AngleTracker(std::ldexp(options.counts, static_cast<int>(angle_shift)), options.bandwidth, options.sample_time);
  }
  void require_source(const iio::Channel* channel, bool buffered) const {
    if (buffered ? !library.is_scan_element(channel) : !library.find_attr(channel, "raw")) {
      in.refuse(fmt::format("channel {} {}", library.channel_id(channel),
                            buffered ? "is not in the device's buffer: set iio.buffer = false"
                                     : "cannot be read for one value: set iio.buffer = true"));
    }
  }
  void open_buffer() {
    const iio::Device* trigger = options.trigger.empty() ? nullptr : in.trigger(options.trigger);
    const double rate = 1 / options.sample_time;
    if (!(trigger && in.set_rate(trigger, rate))) in.set_rate(device, rate);
    if (trigger) in.check(library.set_trigger(device, trigger), "trigger " + options.trigger);
    for (const Input& input : inputs) {
      if (input.channel) library.enable(input.channel);
    }
    if (angle_buffered) library.enable(angle_channel);
    for (unsigned i = 0; i < library.channels(device); ++i) {
      iio::Channel* channel = library.channel(device, i);
      if (library.channel_id(channel) != std::string(kTimestamp) || !library.is_scan_element(channel)) continue;
      timestamp = channel;
      library.enable(channel);
    }
    (void)library.set_kernel_buffers(device, kBuffers);  // not every device lets itself be asked
    buffer = library.create_buffer(device, 1, false);
    if (!buffer) in.refuse(fmt::format("buffer of {}: {}", options.input_device, std::strerror(errno)));
  }

  // The two threads.

  template <class Body>
  void run_as(const char* name, const Body& body) noexcept {
    const NoPipeSignal guard;
    pthread_setname_np(pthread_self(), name);
    if (options.priority > 0) {
      sched_param p{};
      p.sched_priority = options.priority;
      // The loop says when the system refuses it.
      (void)pthread_setschedparam(pthread_self(), SCHED_FIFO, &p);
    }
    body();
  }
  void fail(const char* what, long code) noexcept {
    int none = 0;
    if (!failing.compare_exchange_strong(none, 1)) return;
    failed_at = what;
    failed_code = static_cast<int>(-code);
    lost.store(true, std::memory_order_release);
    fresh.signal();
    asked.signal();
  }

  void read_all() noexcept {
    const WallTime time;
    IioTimer timer{time.now(), static_cast<std::int64_t>(1e9 * options.sample_time)};
    while (!over) {
      BoardReading r;
      if (buffer) {
        const ssize_t n = library.refill(buffer);
        if (over) return;
        if (n < 0) return fail("reading the buffer", n);
        if (!take_sample(r)) return;
      } else {
        time.sleep_until(timer.next());
        if (over) return;
        tick = timer.wake(time.now());
        for (std::size_t i = 0; i < 4; ++i) {
          long long count = 0;
          if (!inputs[i].channel) continue;
          if (const int code = library.read_count(inputs[i].channel, "raw", &count); code < 0) {
            return fail("reading an input", code);
          }
          r.analog[i] = volts(inputs[i], static_cast<double>(count));
        }
      }
      if (!follow_angle()) return;
      r.tick = tick;
      r.beta = angle.beta();
      r.omega = angle.omega();
      r.omega_dot = angle.omega_dot();
      readings.put(r);
      fresh.signal();
    }
  }
  // The newest sample of the buffer.
  bool take_sample(BoardReading& r) noexcept {
    const auto* end = static_cast<const char*>(library.end(buffer));
    const std::ptrdiff_t step = library.step(buffer);
    const auto last = [&](const iio::Channel* channel) {
      const auto* at = static_cast<const char*>(library.first(buffer, channel));
      return at < end && step > 0 ? at + (end - at - 1) / step * step : nullptr;
    };
    for (std::size_t i = 0; i < 4; ++i) {
      if (!inputs[i].channel) continue;
      const char* at = last(inputs[i].channel);
      if (!at) return fail("an empty buffer", -EIO), false;
      r.analog[i] = volts(inputs[i], static_cast<double>(count_of(inputs[i].channel, at)));
    }
    if (angle_buffered) {
      const char* at = last(angle_channel);
      if (!at) return fail("an empty buffer", -EIO), false;
      angle_count = count_of(angle_channel, at);
    }
    std::int64_t ticks = 1;
    if (const char* at = timestamp ? last(timestamp) : nullptr) {
      const std::int64_t now = count_of(timestamp, at);
      if (stamped) ticks = std::llround(static_cast<double>(now - *stamped) / (1e9 * options.sample_time));
      stamped = now;
    }
    // Two samples of one tick are one tick apart all the same; a clock that was set is for the loop to refuse.
    tick += static_cast<std::uint32_t>(ticks == 0 ? 1 : ticks);
    return true;
  }
  std::int64_t count_of(const iio::Channel* channel, const char* at) const noexcept {
    std::int64_t raw = 0;  // little-endian: shorter numbers lie in its low bytes
    library.convert(channel, &raw, at);
    const iio::DataFormat& f = *library.format(channel);
    const unsigned up = 64 - std::clamp(f.length, 1u, 64u);
    const std::uint64_t shifted = static_cast<std::uint64_t>(raw) << up;
    return f.is_signed ? static_cast<std::int64_t>(shifted) >> up : static_cast<std::int64_t>(shifted >> up);
  }
  bool follow_angle() noexcept {
    if (!angle_buffered) {
      long long count = 0;
      if (const int code = library.read_count(angle_channel, "raw", &count); code < 0) {
        return fail("reading the angle", code), false;
      }
      angle_count = count;
    }
    angle.update(static_cast<std::int32_t>(static_cast<std::uint32_t>(angle_count) << angle_shift));
    return true;
  }
  static double volts(const Input& input, double count) noexcept {
    return input.scale.volts * (count + input.scale.offset);
  }
  int set(const Input& line, double volts) const noexcept {
    return library.write_count(line.channel, "raw", std::llround(volts / line.scale.volts - line.scale.offset));
  }

  void write_all() noexcept {
    const int patience = std::max(1, static_cast<int>(std::ceil(1e3 * options.watchdog)));
    bool watched = false;  // a command that acts waits for its successor
    while (!over && !lost) {
      pollfd fd{asked.descriptor(), POLLIN, 0};
      const int ready = ::poll(&fd, 1, watched ? patience : -1);
      if (ready > 0) asked.clear();
      BoardCommand c;
      const bool some = commands.take(c);
      if (!some && !(watched && ready == 0)) continue;
      if (!some) expired = true;
      if (some && !c.armed) expired = false;
      const bool acts = some && c.armed && !expired;
      watched = acts;
      set_both(acts ? c.volts : std::array<double, 2>{});
      acting = acts;
      if (some) answered = c.answers;
    }
    set_both({});
  }
  void set_both(const std::array<double, 2>& volts) noexcept {
    for (std::size_t i = 0; i < 2; ++i) {
      if (const int code = set(outputs[i], volts[i]); code < 0) fail("writing an output", code);
    }
  }

  IioBoardOptions options;
  iio::Library library;
  iio::Connection in, out;  // one for each thread
  iio::Device* device = nullptr;
  std::array<Input, 4> inputs;
  std::array<Input, 2> outputs;
  iio::Channel* angle_channel = nullptr;
  iio::Channel* timestamp = nullptr;
  iio::Buffer* buffer = nullptr;
  bool angle_buffered = false;
  unsigned angle_shift = 0;
  AngleTracker angle;
  std::int64_t angle_count = 0;
  std::optional<std::int64_t> stamped;
  std::uint32_t tick = 0;

  LatestValue<BoardReading> readings;
  LatestValue<BoardCommand> commands;
  Event fresh, asked;
  std::atomic<bool> over{false}, lost{false}, expired{false}, acting{false};
  std::atomic<std::uint32_t> answered{0};
  std::atomic<int> failing{0};
  const char* failed_at = "";  // these two before `lost`
  int failed_code = 0;
  std::thread reader, writer;
};

IioBoard::IioBoard(const IioBoardOptions& options) {
  const NoPipeSignal guard;
  work_ = std::make_unique<Work>(options);
}
IioBoard::~IioBoard() {
  const NoPipeSignal guard;
  work_.reset();
}

bool IioBoard::read(BoardReading& out) noexcept {
  work_->fresh.clear();
  if (!work_->readings.take(out)) return false;
  out.output = work_->acting;
  out.expired = work_->expired;
  out.answered = work_->answered;
  return true;
}

void IioBoard::write(const BoardCommand& command) noexcept {
  work_->commands.put(command);
  work_->asked.signal();
}

bool IioBoard::connected() const noexcept { return !work_->lost; }
int IioBoard::descriptor() const noexcept { return work_->fresh.descriptor(); }
Fault IioBoard::loss() const noexcept { return kBoardLost; }

std::string IioBoard::failure() const {
  if (!work_->lost.load(std::memory_order_acquire)) return {};
  return fmt::format("iio {}: {}: {}", work_->options.uri, work_->failed_at, std::strerror(work_->failed_code));
}

}  // namespace whirl::rt
