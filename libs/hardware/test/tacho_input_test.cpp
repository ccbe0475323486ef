// The loop with a tacho on an analogue input, over the UDP protocol, from a board that the test plays.
#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <fstream>
#include <numbers>
#include <thread>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/hardware/io_settings.hpp"
#include "whirl/hardware/realtime_run.hpp"
#include "whirl/rt/drivers/udp_board.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::hardware {
namespace {

using ::testing::HasSubstr;

/// A board that goes on by a tick of 1 ms with each command, whose shaft turns `speed` times a second: marks of `width`
/// turns on input 2, displacements at rest on inputs 0 and 1. Its own angle is none.
class TurningBoard {
 public:
  TurningBoard(std::vector<double> marks, double width, double speed) : marks_(std::move(marks)), width_(width) {
    sockaddr_in at{};
    at.sin_family = AF_INET;
    ::inet_pton(AF_INET, "127.0.0.1", &at.sin_addr);
    socklen_t size = sizeof at;
    socket_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
    if (::bind(socket_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 ||
        ::getsockname(socket_, reinterpret_cast<sockaddr*>(&at), &size) != 0)
      throw Error("no socket");
    port_ = ntohs(at.sin_port);
    speed_ = speed;
    thread_ = std::thread([this] { serve(); });
  }
  ~TurningBoard() {
    over_ = true;
    thread_.join();
    ::close(socket_);
  }
  TurningBoard(const TurningBoard&) = delete;
  TurningBoard& operator=(const TurningBoard&) = delete;
  int port() const { return port_; }
  double turn_at(std::uint32_t tick) const { return 0.2 + speed_ * 1e-3 * tick; }

 private:
  void serve() {
    sockaddr_in peer{};
    socklen_t size = sizeof peer;
    std::uint32_t tick = 0;
    while (!over_) {
      pollfd waiting{socket_, POLLIN, 0};
      ::poll(&waiting, 1, 20);
      std::array<std::byte, 128> bytes;
      if (::recvfrom(socket_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&peer), &size) <= 0) continue;
      ++tick;
      rt::BoardReading r;
      r.tick = tick;
      r.output = true;
      const double noise = 1e-6 * static_cast<double>(tick % 97), at = turn_at(tick) - std::floor(turn_at(tick));
      r.analog = {3 + noise, 3 - noise, 0.1, 0};
      for (const double mark : marks_)
        if (at >= mark && at < mark + width_) r.analog[2] = 4.8;
      std::array<std::byte, rt::board::kReadingSize> out;
      rt::board::encode(r, out);
      (void)!::sendto(socket_, out.data(), out.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&peer), size);
    }
  }
  std::vector<double> marks_;
  double width_, speed_ = 0;
  int socket_ = -1, port_ = 0;
  std::atomic<bool> over_{false};
  std::thread thread_;
};

IoSettings settings_of(const TurningBoard& board, const std::string& tacho) {
  const auto file = ::testing::TempDir() + "tacho_io.toml";
  std::ofstream(file) << "[board]\naddress = \"127.0.0.1:" << board.port() << "\"\n[realtime]\npriority = 0\n"
                      << "lock_memory = false\nno_deep_idle = false\n[sensor.x]\ndevice = \"\"\nanalog = 0\n"
                      << "[sensor.y]\ndevice = \"\"\nanalog = 1\n[tacho]\nanalog = 2\n"
                      << tacho;
  return read_io(file);
}

TEST(TachoInput, TheLoopSeesTheAngleOfEightTeethLessTwoOnAnAnalogueInput) {
  std::vector<double> teeth;
  for (int k = 0; k < 6; ++k) teeth.push_back(k / 8.0);  // 8 places, 2 without a tooth
  const TurningBoard board(teeth, 0.06, 9);
  RealtimeRunOptions options;
  options.seconds = 1.5;
  std::vector<double> beta, omega;
  options.take = [&](const rt::LoopSample& s) { beta.push_back(s.beta), omega.push_back(s.omega); };
  const RecordRun run = record_disarmed(settings_of(board, ""), options);
  ASSERT_EQ(run.angle.size(), 1u);
  EXPECT_THAT(run.angle[0], HasSubstr("8 places a turn, 2 without a pulse"));
  ASSERT_GT(beta.size(), 1000u);
  // Against whole turns at the first tooth after the gap: a line of 9 turns a second, through 0.
  double worst = 0;
  for (std::size_t k = 1; k < beta.size(); ++k)
    worst = std::max(worst, std::abs(omega[k] / (2 * std::numbers::pi * 9) - 1));
  EXPECT_LT(worst, 0.05);
  const double turns = (beta.back() - beta.front()) / (2 * std::numbers::pi);
  EXPECT_NEAR(turns, 9e-3 * static_cast<double>(beta.size() - 1), 0.05);
}

RealtimeRunOptions brief() {
  RealtimeRunOptions options;
  options.seconds = 0.2;
  return options;
}

TEST(TachoInput, WhatATachoDoesNotShowIsToldWithTheKeyToSet) {
  {
    const TurningBoard rest({0}, 0.1, 0);
    EXPECT_THAT(testing::error_of([&] { record_disarmed(settings_of(rest, "learn_s = 1\n"), brief()); }),
                AllOf(HasSubstr("0 pulses on input 2"), HasSubstr("Let the rotor turn")));
  }
  {
    std::vector<double> teeth;
    for (int k = 0; k < 36; ++k) teeth.push_back(k / 36.0);
    const TurningBoard fine(teeth, 0.014, 10);
    EXPECT_THAT(testing::error_of([&] { record_disarmed(settings_of(fine, "learn_s = 1\n"), brief()); }),
                AllOf(HasSubstr("ticks a pulse"), HasSubstr("board.counts")));
  }
  const TurningBoard uneven({0, 0.2, 0.55}, 0.06, 12);
  EXPECT_THAT(testing::error_of(
                  [&] { record_disarmed(settings_of(uneven, "pulses = 4\nmissing = 0\nlearn_s = 2\n"), brief()); }),
              HasSubstr("tacho.pulses"));
  EXPECT_THAT(testing::error_of([&] { settings_of(uneven, "edge = \"up\"\n"); }), HasSubstr("tacho.edge"));
  EXPECT_THAT(testing::error_of([&] { settings_of(uneven, "pulses = -3\n"); }), HasSubstr("tacho.pulses"));
}

}  // namespace
}  // namespace whirl::hardware
