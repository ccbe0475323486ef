#include "whirl/rt/drivers/udp_board.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <memory>
#include <vector>

#include "loopback.hpp"
#include "whirl/core/error.hpp"

namespace whirl::rt {
namespace {

using Bytes = std::vector<std::byte>;

// Written by hand from docs/formats.md, not by the code under test.
template <class T>
void put(Bytes& bytes, T value) {
  const auto* from = reinterpret_cast<const std::byte*>(&value);
  bytes.insert(bytes.end(), from, from + sizeof value);
}
Bytes head(const char* magic) {
  const auto* from = reinterpret_cast<const std::byte*>(magic);
  return {from, from + 4};
}
Bytes command(std::uint32_t number, std::uint32_t answers, std::uint32_t flags, double x, double y) {
  Bytes b = head("WHC1");
  put(b, number), put(b, answers), put(b, flags), put(b, x), put(b, y);
  return b;
}
Bytes reading(std::uint32_t tick, std::uint32_t flags, std::uint32_t answered, const std::vector<double>& numbers) {
  Bytes b = head("WHR1");
  put(b, tick), put(b, flags), put(b, answered);
  for (const double v : numbers) put(b, v);
  return b;
}
const std::vector<double> kNumbers{12.5, 60, -4, 1, 2, 3, 4};

TEST(BoardProtocol, ACommandIsReadFromItsDocumentedBytesAndWrittenAsThem) {
  for (const std::uint32_t flags : {0u, 1u, 2u, 3u}) {
    const Bytes bytes = command(7, 41, flags, 1.5, -2.25);
    ASSERT_EQ(bytes.size(), board::kCommandSize);
    const auto c = board::decode_command(bytes);
    ASSERT_TRUE(c);
    EXPECT_EQ(c->number, 7u);
    EXPECT_EQ(c->command.answers, 41u);
    EXPECT_EQ(c->command.armed, (flags & 1) != 0);
    EXPECT_EQ(c->command.start, (flags & 2) != 0);
    EXPECT_EQ(c->command.volts[0], 1.5);
    EXPECT_EQ(c->command.volts[1], -2.25);
    std::array<std::byte, board::kCommandSize> out;
    board::encode(*c, out);
    EXPECT_TRUE(std::equal(out.begin(), out.end(), bytes.begin()));
  }
}

TEST(BoardProtocol, AReadingIsReadFromItsDocumentedBytesAndWrittenAsThem) {
  for (const std::uint32_t flags : {0u, 1u, 2u, 4u, 7u}) {
    const Bytes bytes = reading(42, flags, 41, kNumbers);
    ASSERT_EQ(bytes.size(), board::kReadingSize);
    const auto r = board::decode_reading(bytes);
    ASSERT_TRUE(r);
    EXPECT_EQ(r->tick, 42u);
    EXPECT_EQ(r->answered, 41u);
    EXPECT_EQ(r->output, (flags & 1) != 0);
    EXPECT_EQ(r->expired, (flags & 2) != 0);
    EXPECT_EQ(r->done, (flags & 4) != 0);
    EXPECT_EQ(r->beta, 12.5);
    EXPECT_EQ(r->omega, 60);
    EXPECT_EQ(r->omega_dot, -4);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(r->analog[i], static_cast<double>(i + 1));
    std::array<std::byte, board::kReadingSize> out;
    board::encode(*r, out);
    EXPECT_TRUE(std::equal(out.begin(), out.end(), bytes.begin()));
  }
}

TEST(BoardProtocol, WhatHasAnotherSizeOrHeadOrIsNoNumberIsNothing) {
  const Bytes c = command(7, 41, 1, 1, 2), r = reading(42, 1, 41, kNumbers);
  for (std::size_t size = 0; size < c.size(); ++size) EXPECT_FALSE(board::decode_command(std::span(c).first(size)));
  for (std::size_t size = 0; size < r.size(); ++size) EXPECT_FALSE(board::decode_reading(std::span(r).first(size)));
  Bytes longer = c;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(board::decode_command(longer));
  for (std::size_t i = 0; i < 4; ++i) {
    Bytes other = c, odd = r;
    other[i] ^= std::byte{1}, odd[i] ^= std::byte{1};
    EXPECT_FALSE(board::decode_command(other));
    EXPECT_FALSE(board::decode_reading(odd));
  }
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    EXPECT_FALSE(board::decode_command(command(7, 41, 1, bad, 1)));
    EXPECT_FALSE(board::decode_command(command(7, 41, 1, 1, bad)));
    for (std::size_t i = 0; i < 3; ++i) {
      std::vector<double> numbers = kNumbers;
      numbers[i] = bad;
      EXPECT_FALSE(board::decode_reading(reading(42, 1, 41, numbers))) << i;
    }
  }
}

TEST(BoardProtocol, AnAddressIsIPv4AndPort) {
  EXPECT_EQ(board::parse_address("127.0.0.1:47010").host, "127.0.0.1");
  EXPECT_EQ(board::parse_address("127.0.0.1:47010").port, 47010);
  EXPECT_EQ(board::parse_address("10.0.0.9:0").port, 0);
  EXPECT_EQ(board::parse_address("10.0.0.9:65535").port, 65535);
  for (const char* bad :
       {"", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:80x", "127.0.0.1:65536", "127.0.0.1:-1",
        "127.0.0.1: 80", "127.0.0.1:+80", "127.0.0.1:000080", "127.0.0:80", "localhost:80", ":80", "[::1]:80"})
    EXPECT_THROW(board::parse_address(bad), Error) << bad;
}

/// The board's end of the connection.
struct Peer : LoopbackSocket {
  using LoopbackSocket::LoopbackSocket;
  Bytes receive() {
    Bytes b(100);
    socklen_t size = sizeof host;
    b.resize(static_cast<std::size_t>(
        std::max<ssize_t>(0, ::recvfrom(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&host), &size))));
    return b;
  }
  void send(const Bytes& b) { ::sendto(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&host), sizeof host); }
};

TEST(UdpBoard, NumbersItsCommandsAndGivesTheNewestReadingWhateverTheOrder) {
  Peer peer;
  UdpBoard udp(peer.address);
  EXPECT_GE(udp.descriptor(), 0);
  BoardReading r;
  r.tick = 1000;
  EXPECT_FALSE(udp.read(r)) << "nothing has come";
  for (std::uint32_t number = 1; number <= 3; ++number) {
    udp.write({.volts = {1, 2}, .answers = 9, .armed = true});
    EXPECT_EQ(peer.receive(), command(number, 9, 1, 1, 2));
  }
  const auto come = [&](std::uint32_t tick) { peer.send(reading(tick, 1, 3, kNumbers)); };
  peer.send({});  // an empty datagram hides nothing
  come(5), come(7), come(6);
  peer.send(reading(7, 1, 3, {99, 99, 99, 0, 0, 0, 0}));  // doubled and changed
  peer.send(reading(99, 1, 3, {1, 2}));                   // cut off
  pollfd ready{udp.descriptor(), POLLIN, 0};
  EXPECT_EQ(::poll(&ready, 1, 5000), 1);
  bool fresh = false;
  for (int i = 0; i < 1000 && r.tick != 7; ++i) fresh = udp.read(r) || fresh;
  EXPECT_TRUE(fresh);
  EXPECT_EQ(r.tick, 7u) << "the newest of those that wait, although 1000 was there before: a board may start again";
  EXPECT_EQ(r.beta, 12.5) << "the first of two with the same tick";
  EXPECT_TRUE(udp.connected());
  EXPECT_FALSE(udp.read(r));
}

TEST(UdpBoard, ItsCountOfTicksGoesOnBehind2To32) {
  Peer peer;
  UdpBoard udp(peer.address);
  udp.write({});
  peer.receive();
  BoardReading r;
  for (const std::uint32_t tick : {0xffffffffu, 0u}) {
    peer.send(reading(tick, 1, 3, kNumbers));
    for (int i = 0; i < 1000 && !udp.read(r); ++i) ::usleep(1000);
    EXPECT_EQ(r.tick, tick);
  }
}

// A datagram that comes late or twice, also in a later call, is none; the motion is that of the newest.
TEST(UdpBoard, LateAndDoubledReadingsAreDroppedAlsoBetweenCalls) {
  Peer peer;
  UdpBoard udp(peer.address);
  udp.write({});
  peer.receive();
  BoardReading r;
  const auto reads = [&](std::uint32_t tick, std::uint32_t session, double beta) {
    std::vector<double> numbers = kNumbers;
    numbers[0] = beta;
    peer.send(reading(tick, 1 | session << 16, 3, numbers));
    pollfd ready{udp.descriptor(), POLLIN, 0};
    EXPECT_EQ(::poll(&ready, 1, 5000), 1);
    return udp.read(r);
  };
  EXPECT_TRUE(reads(5000, 4, 1));
  EXPECT_FALSE(reads(5000, 4, 9)) << "doubled";
  EXPECT_FALSE(reads(4998, 4, 9)) << "late";
  EXPECT_EQ(r.beta, 1);
  EXPECT_EQ(r.tick, 5000U);
  EXPECT_TRUE(reads(5001, 4, 2));
  EXPECT_TRUE(reads(5000, 5, 3)) << "a board that was started again";
  EXPECT_TRUE(reads(3, 5, 4)) << "one that gives no other session, and counts from its beginning";
}

TEST(UdpBoard, ABoardThatIsGoneIsSeenAndOneThatComesBackToo) {
  auto peer = std::make_unique<Peer>();
  UdpBoard udp(peer->address);
  udp.write({});
  peer->receive();
  const sockaddr_in host = peer->host;
  sockaddr_in at{};
  socklen_t size = sizeof at;
  ::getsockname(peer->fd, reinterpret_cast<sockaddr*>(&at), &size);
  BoardReading r;
  EXPECT_FALSE(udp.read(r));
  EXPECT_TRUE(udp.connected()) << "silent is not gone";
  peer.reset();
  udp.write({});  // nobody listens: the system says so
  pollfd told{udp.descriptor(), POLLIN, 0};
  ASSERT_EQ(::poll(&told, 1, 5000), 1);
  EXPECT_FALSE(udp.read(r));
  EXPECT_FALSE(udp.connected());
  udp.write({});
  Peer again(at);
  again.host = host;
  again.send(reading(3, 0, 0, kNumbers));
  int waiting = 0;
  for (int i = 0; i < 5000 && waiting == 0; ++i, ::usleep(1000)) ::ioctl(udp.descriptor(), FIONREAD, &waiting);
  EXPECT_TRUE(udp.read(r)) << "the refusal that still waits does not hide it";
  EXPECT_TRUE(udp.connected());
}

TEST(UdpBoard, AnAddressThatMayNotBeUsedIsRefusedAndKeepsNothingOpen) {
  const auto open = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  const auto before = open();
  for (int i = 0; i < 3; ++i) EXPECT_THROW(UdpBoard("255.255.255.255:9"), Error);
  EXPECT_EQ(open(), before);
}

}  // namespace
}  // namespace whirl::rt
