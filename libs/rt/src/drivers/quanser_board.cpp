#include <fmt/format.h>

#include <cmath>
#include <cstdint>

#include "shared_library.hpp"
#include "whirl/rt/drivers/vendor_boards.hpp"

namespace whirl::rt {

void VendorBoard::count(std::int32_t encoder, BoardReading& out) noexcept {
  angle_.update(encoder, ticks_);
  out.tick = tick_ += static_cast<std::uint32_t>(ticks_);
  ticks_ = 1;
  out.beta = angle_.beta();
  out.omega = angle_.omega();
  out.omega_dot = angle_.omega_dot();
  out.answered = answered_;
  out.output = output_;
  out.expired = expired_;
}

// Signatures from the maker's documentation of the HIL C API.
struct QuanserBoard::Api {
  using Card = void*;
  using Channels = const std::uint32_t*;
  SharedLibrary library;
  int (*open)(const char*, const char*, Card*) = nullptr;
  int (*close)(Card) = nullptr;
  int (*set_input_ranges)(Card, Channels, std::uint32_t, const double*, const double*) = nullptr;
  int (*set_output_ranges)(Card, Channels, std::uint32_t, const double*, const double*) = nullptr;
  int (*read)(Card, Channels, std::uint32_t, Channels, std::uint32_t, Channels, std::uint32_t, Channels, std::uint32_t,
              double*, std::int32_t*, char*, double*) = nullptr;
  int (*write_analog)(Card, Channels, std::uint32_t, const double*) = nullptr;
  int (*expiration_state)(Card, Channels, std::uint32_t, const double*) = nullptr;
  int (*watchdog_start)(Card, double) = nullptr;
  int (*watchdog_reload)(Card) = nullptr;
  int (*watchdog_clear)(Card) = nullptr;
  int (*watchdog_stop)(Card) = nullptr;
  Card card = nullptr;

  explicit Api(const std::string& name) : library(name) {
    library.find("hil_open", open);
    library.find("hil_close", close);
    library.find("hil_set_analog_input_ranges", set_input_ranges);
    library.find("hil_set_analog_output_ranges", set_output_ranges);
    library.find("hil_read", read);
    library.find("hil_write_analog", write_analog);
    library.find("hil_watchdog_set_analog_expiration_state", expiration_state);
    library.find("hil_watchdog_start", watchdog_start);
    library.find("hil_watchdog_reload", watchdog_reload);
    library.find("hil_watchdog_clear", watchdog_clear);
    library.find("hil_watchdog_stop", watchdog_stop);
  }
  ~Api() {
    if (card) close(card);
  }
};

QuanserBoard::QuanserBoard(const VendorBoardOptions& options)
    : VendorBoard(options), api_(std::make_unique<Api>(options.library.empty() ? "libhil.so" : options.library)) {
  const auto check = [&](int code, const char* what) {
    if (code < 0)
      throw Error(fmt::format("board {} {}: {} failed with code {}", options.card, options.device, what, code));
  };
  check(api_->open(options.card.c_str(), options.device.c_str(), &api_->card), "hil_open");
  constexpr std::array<double, 4> low{-10, -10, -10, -10}, high{10, 10, 10, 10};
  constexpr std::array<double, 2> zero{};
  check(api_->set_input_ranges(api_->card, options_.inputs.data(), 4, low.data(), high.data()),
        "hil_set_analog_input_ranges");
  check(api_->set_output_ranges(api_->card, options_.outputs.data(), 2, low.data(), high.data()),
        "hil_set_analog_output_ranges");
  check(api_->write_analog(api_->card, options_.outputs.data(), 2, zero.data()), "hil_write_analog");
  // Without these the outputs stay as they are when the watchdog expires.
  check(api_->expiration_state(api_->card, options_.outputs.data(), 2, zero.data()),
        "hil_watchdog_set_analog_expiration_state");
  check(api_->watchdog_start(api_->card, options_.watchdog), "hil_watchdog_start");
}

QuanserBoard::~QuanserBoard() {
  constexpr std::array<double, 2> zero{};
  api_->write_analog(api_->card, options_.outputs.data(), 2, zero.data());
  api_->watchdog_stop(api_->card);
}

bool QuanserBoard::read(BoardReading& out) noexcept {
  std::int32_t encoder = 0;
  if (const int code = api_->read(api_->card, options_.inputs.data(), 4, &options_.encoder, 1, nullptr, 0, nullptr, 0,
                                  out.analog.data(), &encoder, nullptr, nullptr);
      code < 0) {
    lose("hil_read", code);
    ++ticks_;
    return false;
  }
  count(encoder, out);
  return true;
}

void QuanserBoard::write(const BoardCommand& command) noexcept {
  // 1: reloaded, 0: it had expired, below: it cannot be reached.
  const int reloaded = api_->watchdog_reload(api_->card);
  if (reloaded == 0) expired_ = true;
  if (reloaded < 0) lose("hil_watchdog_reload", reloaded);
  if (expired_ && !command.armed) {
    expired_ = api_->watchdog_clear(api_->card) < 0 || api_->watchdog_start(api_->card, options_.watchdog) < 0;
  }
  output_ = command.armed && !expired_ && connected_;
  const std::array<double, 2> volts = output_ ? command.volts : std::array<double, 2>{};
  if (const int code = api_->write_analog(api_->card, options_.outputs.data(), 2, volts.data()); code < 0) {
    lose("hil_write_analog", code);
  }
  answered_ = command.answers;
}

std::string QuanserBoard::failure() const {
  if (connected_) return {};
  return fmt::format("quanser {} {}: {} failed with code {}", options_.card, options_.device, failed_at_, failed_code_);
}

}  // namespace whirl::rt
