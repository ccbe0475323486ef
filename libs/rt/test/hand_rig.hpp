// A rig on a clock that the test turns: each read() without a wait() is a tick.
#pragma once
#include <gtest/gtest.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <string>
#include <thread>

#include "whirl/rt/drivers/hardware_rig.hpp"
#include "whirl/rt/drivers/optoncdt_line.hpp"

namespace whirl::rt {

/// What the test says is what the board says.
struct HandBoard : Board {
  struct State {
    BoardReading reading;
    bool answers = true, online = true;
    int descriptor = -1;
    bool once = false;  ///< it answers one read, then none
    long reads = 0, left_out = 0;
    BoardCommand written;
  };
  explicit HandBoard(State& s) : state(s) {}
  State& state;
  bool read(BoardReading& out) noexcept override {
    ++state.reads;
    if (!state.answers) return false;
    state.answers = !state.once;
    ++state.reading.tick;
    out = state.reading;
    return true;
  }
  void write(const BoardCommand& c) noexcept override { state.written = c; }
  void left_out(long ticks) noexcept override { state.left_out += ticks; }
  bool connected() const noexcept override { return state.online; }
  int descriptor() const noexcept override { return state.descriptor; }
};

/// A laser whose frames the test sends one by one.
class HandLaser {
 public:
  const std::string& device() const { return line_.device(); }
  /// Streams while `make` runs, so that the start-up of the driver succeeds.
  template <class Make>
  static auto start(HandLaser& a, HandLaser& b, Make&& make) {
    std::atomic<bool> over{false};
    std::thread answering([&] {
      while (!over) {
        for (HandLaser* l : {&a, &b}) l->line_.answer(), l->send(32760), l->line_.flush();
        std::this_thread::sleep_for(std::chrono::microseconds(100));
      }
    });
    auto rig = make();
    over = true;
    answering.join();
    return rig;
  }
  void send(std::uint32_t raw) { line_.send(raw, number_++); }
  /// Its counter goes on by so many frames, as that of a laser that was started again.
  void jump(std::uint64_t frames) { number_ += frames; }
  /// Hands over what was sent, and waits until it lies in the driver's line.
  void deliver(const optoncdt::Sensor& sensor, int frames) {
    line_.flush();
    int waiting = 0;
    for (int i = 0; i < 100000; ++i) {
      if (::ioctl(sensor.descriptor(), FIONREAD, &waiting) == 0 && waiting >= 6 * frames) return;
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    }
    FAIL() << "the line does not carry";
  }

 private:
  optoncdt::DeviceLine line_;
  std::uint64_t number_ = 1;
};

struct LaserRigRealtime : ::testing::Test {
  HandBoard::State board;
  HandLaser x, y;
  std::unique_ptr<HardwareRig> rig;
  std::uint32_t wiggle = 0;

  explicit LaserRigRealtime(int descriptor = -1) {
    board.descriptor = descriptor;
    HardwareOptions o;
    for (std::size_t i = 0; i < 2; ++i) {
      o.position[i].laser.device = (i == 0 ? x : y).device();
      o.position[i].laser.timeout = 30;
      o.position[i].offset = 5e-3;
    }
    o.position[1].direction = -1;
    rig = HandLaser::start(x, y, [&] { return std::make_unique<HardwareRig>(o, std::make_unique<HandBoard>(board)); });
    // What was on its way while the driver started.
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    for (int k = 0; k < 50; ++k) tick(32760, 32760);
    rig->arm(true);
  }
  /// Four frames of each laser, then the cycle; 0: the laser is silent.
  Measurement tick(std::uint32_t of_x, std::uint32_t of_y) {
    for (int i = 0; i < 2; ++i) {
      HandLaser& laser = i == 0 ? x : y;
      const std::uint32_t raw = i == 0 ? of_x : of_y;
      if (raw == 0) continue;
      for (int k = 0; k < 4; ++k) laser.send(raw < 262000 ? raw + ++wiggle % 2 : raw);
      laser.deliver(*rig->laser(i), 4);
    }
    return rig->read();
  }
};

}  // namespace whirl::rt
