#include "whirl/hardware/board_socket.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/hardware/realtime_run.hpp"
#include "whirl/hardware/rig_server.hpp"

namespace whirl::hardware {
namespace {

using Bytes = std::vector<std::byte>;
namespace board = rt::board;

std::filesystem::path key_file(const std::string& secret = "a key of both ends") {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / ("whirl_" + secret + ".key");
  std::ofstream(file) << secret << "\n";
  ::chmod(file.c_str(), 0600);
  return file;
}

/// Somebody on the network who sends bytes.
struct Sender {
  int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in to{};
  explicit Sender(const std::string& address) {
    const board::Address a = board::parse_address(address);
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(a.port));
    ::inet_pton(AF_INET, a.host.c_str(), &to.sin_addr);
  }
  ~Sender() { ::close(fd); }
  void send(const Bytes& b) { ::sendto(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to); }
  bool answered() {
    pollfd p{fd, POLLIN, 0};
    return ::poll(&p, 1, 20) == 1;
  }
};

Bytes start_command(std::uint32_t number) {
  Bytes b(board::kCommandSize);
  board::encode({{.volts = {1, 2}, .armed = true, .start = true}, number}, std::span(b).first<board::kCommandSize>());
  return b;
}
Bytes sealed_command(std::uint32_t number, const board::Starts& starts, const std::string& secret) {
  Bytes b = start_command(number);
  b.resize(b.size() + board::kSealSize);
  board::Key(secret).seal(b, starts);
  return b;
}

TEST(BoardSocket, WithAKeyAnyAddressIsServedAndWithoutOneOnlyThisMachine) {
  EXPECT_NO_THROW(BoardSocket("0.0.0.0:0", key_file()));
  EXPECT_NO_THROW(BoardSocket("127.0.0.3:0", {}));
  try {
    BoardSocket("0.0.0.0:0", {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("--board-key"));
  }
}

// A stranger's start command, one with another key, and ones that were recorded command nothing.
TEST(BoardSocket, OnlyFreshCommandsWithTheKeyCount) {
  const std::string secret = "a key of both ends";
  BoardSocket served("127.0.0.1:0", key_file(secret));
  Sender stranger(served.address());
  stranger.send(start_command(1));
  stranger.send(sealed_command(1, {7, 0}, "another key of both"));
  EXPECT_FALSE(served.receive(true));
  EXPECT_EQ(served.refused(), 2);
  EXPECT_FALSE(stranger.answered());
  EXPECT_FALSE(served.commanded());

  rt::UdpBoard host(served.address(), board::read_key(key_file(secret)));
  host.write({.start = true});
  EXPECT_FALSE(served.receive(true)) << "it has not heard the start of this board: that could be a recording";
  EXPECT_FALSE(served.commanded());
  pollfd told{host.descriptor(), POLLIN, 0};
  ASSERT_EQ(::poll(&told, 1, 5000), 1);
  rt::BoardReading r;
  EXPECT_FALSE(host.read(r)) << "the start alone";
  host.write({.start = true});
  const auto heard = served.receive(false);
  ASSERT_TRUE(heard);
  EXPECT_TRUE(heard->numbered.command.start);
  EXPECT_EQ(heard->numbered.number, 2U);
  EXPECT_EQ(served.refused(), 2);

  r.tick = 41;
  served.send(r);
  ASSERT_EQ(::poll(&told, 1, 5000), 1);
  EXPECT_TRUE(host.read(r));
  EXPECT_EQ(r.tick, 41U);
}

TEST(BoardSocket, LateDoubledAndRecordedCommandsAreDropped) {
  const std::string secret = "a key of both ends";
  BoardSocket served("127.0.0.1:0", key_file(secret));
  Sender one(served.address());
  one.send(sealed_command(1, {100, 0}, secret));
  EXPECT_FALSE(served.receive(true));
  ASSERT_TRUE(one.answered());
  Bytes welcome(200);
  welcome.resize(static_cast<std::size_t>(::recv(one.fd, welcome.data(), welcome.size(), 0)));
  ASSERT_EQ(welcome.size(), 36U);
  const auto starts = board::Key(secret).open(welcome);
  ASSERT_TRUE(starts);
  EXPECT_EQ(starts->receiver, 100U);
  const std::uint64_t mine = starts->sender;

  const auto takes = [&](Sender& from, std::uint32_t number, std::uint64_t start, bool silent) {
    from.send(sealed_command(number, {start, mine}, secret));
    return served.receive(silent).has_value();
  };
  EXPECT_TRUE(takes(one, 5, 100, false));
  EXPECT_FALSE(takes(one, 5, 100, false)) << "doubled";
  EXPECT_FALSE(takes(one, 4, 100, false)) << "late";
  EXPECT_TRUE(takes(one, 6, 100, false));
  Sender other(served.address());
  EXPECT_FALSE(takes(other, 7, 100, false)) << "one program commands at a time";
  EXPECT_FALSE(takes(other, 6, 100, true)) << "recorded, from another address, after the first fell silent";
  EXPECT_TRUE(takes(other, 1, 200, true)) << "a later start takes over";
  EXPECT_EQ(served.refused(), 0);
  EXPECT_FALSE(takes(one, 7, 100, true)) << "recorded before that";
  EXPECT_EQ(served.refused(), 1);
  EXPECT_TRUE(takes(other, 2, 200, false));
}

TEST(BoardSocket, WithoutAKeyTheNumbersCountTooAndOneProgramCommands) {
  BoardSocket served("127.0.0.1:0", {});
  Sender one(served.address()), other(served.address());
  const auto takes = [&](Sender& from, std::uint32_t number, bool silent) {
    from.send(start_command(number));
    return served.receive(silent).has_value();
  };
  EXPECT_TRUE(takes(one, 0xffffffffu, false));
  EXPECT_FALSE(takes(one, 0xffffffffu, false)) << "doubled";
  EXPECT_TRUE(takes(one, 0, false)) << "counted beyond 2^32";
  EXPECT_FALSE(takes(one, 0xfffffff0u, false)) << "late";
  EXPECT_FALSE(takes(other, 9, false));
  EXPECT_TRUE(takes(other, 1, true)) << "another may when the first is silent";
  EXPECT_FALSE(takes(one, 9, false));
}

// The loop of `whirl run --io` reaches a rig with a key by its settings; a stranger's datagrams change nothing.
TEST(BoardKeyRealtime, AServedRigWithAKeyIsRecordedAndIgnoresStrangers) {
  ServeOptions options;
  options.key_file = key_file();
  RigServer server(options);
  const IoSettings io = server.io();
  EXPECT_TRUE(std::filesystem::path(io.key_file).is_absolute());
  std::atomic<bool> over{false};
  std::thread rig([&] { server.run([&] { return over.load(); }); });
  std::thread stranger([&] {
    Sender sender(io.address);
    for (std::uint32_t number = 1; !over; ++number) sender.send(start_command(number)), ::usleep(1000);
  });
  ::usleep(50000);
  const auto record = [&](const IoSettings& settings) {
    RealtimeRunOptions run;
    run.seconds = 0.3;
    run.record = std::filesystem::path(::testing::TempDir()) / "whirl_keyed.h5";
    return record_disarmed(settings, run);
  };
  const RecordRun good = record(io);
  IoSettings wrong = io;
  wrong.key_file = key_file("a key of one end only").string();
  const RecordRun refused = record(wrong);
  over = true;
  rig.join();
  stranger.join();
  EXPECT_EQ(good.summary.status, Status::ok) << good.loop.reason;
  EXPECT_GT(good.cycles, 50);
  EXPECT_NE(refused.summary.status, Status::ok);
  EXPECT_EQ(refused.loop.reason, "the board does not answer");
  EXPECT_GT(server.refused(), 50);
}

}  // namespace
}  // namespace whirl::hardware
