// The calls of SHA-256 that OpenSSL 3 recommends allocate and lock; these run in the control step.
#define OPENSSL_SUPPRESS_DEPRECATED
#include "whirl/rt/drivers/board_key.hpp"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/sha.h>
#include <sys/stat.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fstream>
#include <string>

#include "whirl/core/error.hpp"

namespace whirl::rt::board {
namespace {

constexpr std::size_t kShortest = 16;  // characters of a key
constexpr std::size_t kMac = kSealSize - sizeof(Starts);

using Digest = std::array<unsigned char, SHA256_DIGEST_LENGTH>;

Digest hash(std::span<const std::byte> head, std::span<const std::byte> tail) noexcept {
  SHA256_CTX context;
  Digest out;
  SHA256_Init(&context);
  SHA256_Update(&context, head.data(), head.size());
  SHA256_Update(&context, tail.data(), tail.size());
  SHA256_Final(out.data(), &context);
  return out;
}

}  // namespace

std::uint64_t start_of_now() {
  const auto since = std::chrono::system_clock::now().time_since_epoch();
  return static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::nanoseconds>(since).count());
}

Key::Key(std::string_view secret) {
  std::array<unsigned char, kBlock> block{};
  if (secret.size() > kBlock) {
    const Digest shorter = hash(std::as_bytes(std::span(secret)), {});
    std::memcpy(block.data(), shorter.data(), shorter.size());
  } else {
    std::memcpy(block.data(), secret.data(), secret.size());
  }
  for (std::size_t i = 0; i < kBlock; ++i) {
    inner_[i] = static_cast<std::byte>(block[i] ^ 0x36);
    outer_[i] = static_cast<std::byte>(block[i] ^ 0x5c);
  }
}

void Key::seal(std::span<std::byte> datagram, const Starts& starts) const noexcept {
  const std::size_t sealed = datagram.size() - kMac;
  std::memcpy(datagram.data() + sealed - sizeof starts, &starts, sizeof starts);
  const Digest inside = hash(inner_, datagram.first(sealed));
  const Digest mac = hash(outer_, std::as_bytes(std::span(inside)));
  std::memcpy(datagram.data() + sealed, mac.data(), kMac);
}

std::optional<Starts> Key::open(std::span<const std::byte> datagram) const noexcept {
  if (datagram.size() < kSealSize) return {};
  const std::size_t sealed = datagram.size() - kMac;
  const Digest inside = hash(inner_, datagram.first(sealed));
  const Digest mac = hash(outer_, std::as_bytes(std::span(inside)));
  if (CRYPTO_memcmp(datagram.data() + sealed, mac.data(), kMac) != 0) return {};
  Starts starts;
  std::memcpy(&starts, datagram.data() + sealed - sizeof starts, sizeof starts);
  return starts;
}

Key read_key(const std::filesystem::path& file) {
  struct stat state {};
  std::ifstream in(file);
  if (::stat(file.c_str(), &state) != 0 || !in) {
    throw Error::in_file(file.string(), 0, fmt::format("key of the board: {}", std::strerror(errno)));
  }
  if (!S_ISREG(state.st_mode) || (state.st_mode & (S_IRWXG | S_IRWXO)) != 0) {
    throw Error::in_file(
        file.string(), 0,
        fmt::format("key of the board: mode {:04o}: its owner alone may read it (chmod 600)", state.st_mode & 07777));
  }
  std::string secret;
  std::getline(in, secret);
  if (secret.size() < kShortest) {
    throw Error::in_file(file.string(), 1,
                         fmt::format("key of the board: {} characters: at least {} are needed, such as those of "
                                     "`openssl rand -hex 32`",
                                     secret.size(), kShortest));
  }
  return Key(secret);
}

}  // namespace whirl::rt::board
