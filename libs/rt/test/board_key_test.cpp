#include "whirl/rt/drivers/board_key.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <malloc.h>
#include <netinet/in.h>
#include <openssl/evp.h>
#include <openssl/hmac.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "loopback.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rt/drivers/udp_board.hpp"
#include "whirl/testing/alloc_guard.hpp"

namespace whirl::rt {
namespace {

using Bytes = std::vector<std::byte>;
const std::string kSecret = "a key of both ends";

// Against the HMAC of OpenSSL: keys shorter than, as long as and longer than a block of SHA-256.
TEST(BoardKey, ASealIsTwoStartsAndHalfOfTheHmac) {
  for (const std::size_t length : {16, 63, 64, 65, 100}) {
    const std::string secret(length, 'k');
    Bytes bytes(36 + board::kSealSize, std::byte{7});
    const board::Key key(secret);
    key.seal(bytes, {0x0102030405060708, 9});
    EXPECT_EQ(bytes[36], std::byte{8}) << "little-endian";
    EXPECT_EQ(bytes[44], std::byte{9});
    unsigned char mac[32];
    unsigned size = 0;
    ::HMAC(EVP_sha256(), secret.data(), static_cast<int>(length), reinterpret_cast<const unsigned char*>(bytes.data()),
           36 + 16, mac, &size);
    ASSERT_EQ(size, 32U);
    EXPECT_EQ(std::memcmp(mac, bytes.data() + 52, 16), 0) << length;
    const auto starts = key.open(bytes);
    ASSERT_TRUE(starts);
    EXPECT_EQ(starts->sender, 0x0102030405060708U);
    EXPECT_EQ(starts->receiver, 9U);
  }
}

TEST(BoardKey, NoChangedBitNoOtherKeyAndNoCutDatagramOpens) {
  Bytes bytes(40 + board::kSealSize, std::byte{1});
  const board::Key key(kSecret), other(kSecret + ".");
  key.seal(bytes, {5, 6});
  EXPECT_TRUE(key.open(bytes));
  EXPECT_FALSE(other.open(bytes));
  for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
    Bytes changed = bytes;
    changed[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    EXPECT_FALSE(key.open(changed)) << bit;
  }
  for (std::size_t size = 0; size < bytes.size(); ++size) EXPECT_FALSE(key.open(std::span(bytes).first(size))) << size;
}

TEST(BoardKey, SealingAndOpeningInTheControlStepAllocateNothing) {
  Bytes bytes(72 + board::kSealSize);
  const board::Key key(kSecret);
  key.seal(bytes, {1, 2});
  const std::size_t before = ::mallinfo2().uordblks;
  const testing::AllocationGuard guard;
  bool good = true;
  for (std::uint64_t i = 1; i < 1000; ++i) {
    key.seal(bytes, {i, 2});
    good = good && key.open(bytes)->sender == i;
  }
  EXPECT_EQ(guard.count(), 0U);
  EXPECT_EQ(::mallinfo2().uordblks, before) << "libcrypto";
  EXPECT_TRUE(good);
}

TEST(BoardKey, AFileThatOthersReadAShortKeyAndNoFileAreRefusedWithTheCure) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "whirl_board.key";
  const auto refusal = [&] {
    try {
      board::read_key(file);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  std::filesystem::remove(file);
  EXPECT_THAT(refusal(), ::testing::HasSubstr("No such file"));
  std::ofstream(file) << kSecret << "\nnot part of it\n";
  for (const mode_t mode : {0644, 0640, 0604, 0620, 0601}) {
    ::chmod(file.c_str(), mode);
    EXPECT_THAT(refusal(), ::testing::HasSubstr("chmod 600")) << mode;
  }
  ::chmod(file.c_str(), 0600);
  EXPECT_EQ(refusal(), "");
  Bytes bytes(board::kSealSize);
  board::Key(kSecret).seal(bytes, {1, 1});
  EXPECT_TRUE(board::read_key(file).open(bytes)) << "the first line without its end";
  std::ofstream(file) << std::string(15, 'k') << "\n";
  EXPECT_THAT(refusal(), ::testing::AllOf(::testing::HasSubstr("15 characters"), ::testing::HasSubstr("at least 16")));
  std::ofstream(file) << std::string(16, 'k');
  EXPECT_EQ(refusal(), "");
}

/// A board with a key: sends what a test says.
struct SealedPeer : LoopbackSocket {
  std::uint64_t host_start = 0;
  board::Starts receive() {
    Bytes b(200);
    socklen_t size = sizeof host;
    const ssize_t n = ::recvfrom(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&host), &size);
    EXPECT_EQ(n, static_cast<ssize_t>(board::kCommandSize + board::kSealSize));
    b.resize(static_cast<std::size_t>(n));
    const auto starts = board::Key(kSecret).open(b);
    EXPECT_TRUE(starts);
    host_start = starts->sender;
    return *starts;
  }
  static Bytes sealed(const std::string& secret, std::uint32_t tick, const board::Starts& starts) {
    BoardReading r;
    r.tick = tick;
    Bytes b(board::kReadingSize + board::kSealSize);
    board::encode(r, std::span(b).first<board::kReadingSize>());
    board::Key(secret).seal(b, starts);
    return b;
  }
  void send(const Bytes& b) { ::sendto(fd, b.data(), b.size(), 0, reinterpret_cast<sockaddr*>(&host), sizeof host); }
};

TEST(UdpBoardWithKey, TakesOnlyReadingsOfThisKeyThisStartAndForwardInTheirCount) {
  SealedPeer peer;
  UdpBoard udp(peer.address, board::Key(kSecret));
  udp.write({});
  EXPECT_EQ(peer.receive().receiver, 0U) << "the board's start is not known yet";
  BoardReading r;
  const auto reads = [&](const Bytes& bytes) {
    peer.send(bytes);
    pollfd ready{udp.descriptor(), POLLIN, 0};
    EXPECT_EQ(::poll(&ready, 1, 5000), 1);
    return udp.read(r);
  };
  const std::uint64_t me = 1000, host = peer.host_start;
  Bytes plain(board::kReadingSize);
  board::encode(BoardReading{}, std::span(plain).first<board::kReadingSize>());
  EXPECT_FALSE(reads(plain)) << "without a seal";
  EXPECT_FALSE(reads(SealedPeer::sealed("another key of both", 4, {me, host})));
  EXPECT_THAT(udp.failure(), ::testing::HasSubstr("2 datagrams without the key of board.key_file"));
  EXPECT_FALSE(reads(SealedPeer::sealed(kSecret, 4, {me, host - 1}))) << "recorded in an earlier run of this program";
  EXPECT_EQ(udp.refused(), 3);
  EXPECT_TRUE(reads(SealedPeer::sealed(kSecret, 5000, {me, host})));
  EXPECT_EQ(udp.failure(), "");
  EXPECT_FALSE(reads(SealedPeer::sealed(kSecret, 5000, {me, host}))) << "doubled";
  EXPECT_FALSE(reads(SealedPeer::sealed(kSecret, 4999, {me, host}))) << "late";
  EXPECT_FALSE(reads(SealedPeer::sealed(kSecret, 1, {me, host}))) << "recorded at the beginning";
  EXPECT_EQ(r.tick, 5000U);
  udp.write({});
  EXPECT_EQ(peer.receive().receiver, me);
  EXPECT_TRUE(reads(SealedPeer::sealed(kSecret, 1, {me + 1, host}))) << "the board has started again";
  EXPECT_FALSE(reads(SealedPeer::sealed(kSecret, 6000, {me, host}))) << "recorded before that";
  EXPECT_EQ(r.tick, 1U);
  EXPECT_EQ(udp.refused(), 4);
}

}  // namespace
}  // namespace whirl::rt
