#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string_view>

namespace whirl::rt::board {

/// Behind the bytes of a datagram with a key: two starts and 16 bytes of HMAC-SHA256.
constexpr std::size_t kSealSize = 32;

/// When a program started, ns: rises from start to start, so that a recorded datagram serves in no later one.
struct Starts {
  std::uint64_t sender = 0;
  std::uint64_t receiver = 0;  ///< as the sender has heard it; 0: not yet
};
std::uint64_t start_of_now();

/// A key that both ends know. Nothing here allocates, locks or throws, but for the constructor.
class Key {
 public:
  explicit Key(std::string_view secret);
  /// Fills the last kSealSize bytes.
  void seal(std::span<std::byte> datagram, const Starts& starts) const noexcept;
  /// Nothing when the datagram was not sealed with this key.
  std::optional<Starts> open(std::span<const std::byte> datagram) const noexcept;

 private:
  static constexpr std::size_t kBlock = 64;  // of SHA-256
  std::array<std::byte, kBlock> inner_, outer_;
};

/// The first line of a file that its owner alone may read, 16 characters at least. Throws Error.
Key read_key(const std::filesystem::path& file);

}  // namespace whirl::rt::board
