#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>

#include "whirl/rt/drivers/board.hpp"
#include "whirl/rt/drivers/board_key.hpp"

namespace whirl::rt {

/// Board protocol over UDP (docs/formats.md): one datagram per tick and direction, little-endian, no state but
/// the numbers in it, so that a lost one does no harm.
namespace board {

constexpr std::size_t kCommandSize = 32, kReadingSize = 72;
/// A sequence number tells late and doubled datagrams.
struct NumberedCommand {
  BoardCommand command;
  std::uint32_t number = 0;
};
void encode(const NumberedCommand& command, std::span<std::byte, kCommandSize> out) noexcept;
void encode(const BoardReading& reading, std::span<std::byte, kReadingSize> out) noexcept;
/// Nothing when size, magic word or a number (NaN, infinite) is wrong.
std::optional<NumberedCommand> decode_command(std::span<const std::byte> bytes) noexcept;
std::optional<BoardReading> decode_reading(std::span<const std::byte> bytes) noexcept;

constexpr std::size_t kLargestDatagram = kReadingSize + kSealSize;

/// "127.0.0.1:47010" as host and port; throws Error otherwise.
struct Address {
  std::string host;
  int port = 0;
};
Address parse_address(const std::string& text);

}  // namespace board

/// A board at the other end of a UDP connection. The constructor throws Error when the address is no address.
/// With a key every command carries its seal, and readings without it are no readings.
class UdpBoard : public Board {
 public:
  explicit UdpBoard(const std::string& address, std::optional<board::Key> key = {});
  ~UdpBoard() override;
  UdpBoard(const UdpBoard&) = delete;
  UdpBoard& operator=(const UdpBoard&) = delete;

  bool read(BoardReading& out) noexcept override;
  void write(const BoardCommand& command) noexcept override;
  bool connected() const noexcept override { return connected_; }
  int descriptor() const noexcept override { return fd_; }
  std::string failure() const override;
  long refused() const { return refused_; }  ///< datagrams without the key

 private:
  std::optional<BoardReading> open(std::span<const std::byte> datagram) noexcept;
  /// Sent before the one that was read last, or that one again: dropped, here or in a later call.
  bool is_late(const BoardReading& reading) const noexcept;

  int fd_ = -1;
  std::string address_;
  std::optional<board::Key> key_;
  board::Starts starts_;  ///< of this program and of the board as it was last heard
  long refused_ = 0;
  std::uint32_t number_ = 0;
  std::uint32_t tick_ = 0;  ///< of the reading that came last
  std::uint16_t session_ = 0;
  bool seen_ = false;
  bool connected_ = true;  ///< false when nobody listens there
};

}  // namespace whirl::rt
