#include "whirl/rt/drivers/udp_board.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <utility>

#include "whirl/core/error.hpp"

namespace whirl::rt {
namespace board {
namespace {

static_assert(std::endian::native == std::endian::little, "the datagrams are little-endian");

constexpr std::array<char, 4> kCommandMagic{'W', 'H', 'C', '1'}, kReadingMagic{'W', 'H', 'R', '1'};
enum : std::uint32_t { kArmed = 1, kStart = 2 };
enum : std::uint32_t { kOutput = 1, kExpired = 2, kDone = 4 };

// As they lie in the datagram: no gaps.
struct CommandBytes {
  std::array<char, 4> magic;
  std::uint32_t number, answers, flags;
  std::array<double, 2> volts;
};
struct ReadingBytes {
  std::array<char, 4> magic;
  std::uint32_t tick, flags, answered;
  double beta, omega, omega_dot;
  std::array<double, 4> analog;
};
static_assert(sizeof(CommandBytes) == kCommandSize && sizeof(ReadingBytes) == kReadingSize);

template <class T>
bool take(std::span<const std::byte> bytes, const std::array<char, 4>& magic, T& out) noexcept {
  if (bytes.size() != sizeof(T)) return false;
  std::memcpy(&out, bytes.data(), sizeof(T));
  return out.magic == magic;
}

}  // namespace

void encode(const NumberedCommand& c, std::span<std::byte, kCommandSize> out) noexcept {
  const CommandBytes bytes{kCommandMagic, c.number, c.command.answers,
                           (c.command.armed ? kArmed : 0u) | (c.command.start ? kStart : 0u), c.command.volts};
  std::memcpy(out.data(), &bytes, sizeof bytes);
}

void encode(const BoardReading& r, std::span<std::byte, kReadingSize> out) noexcept {
  const ReadingBytes bytes{kReadingMagic,
                           r.tick,
                           (r.output ? kOutput : 0u) | (r.expired ? kExpired : 0u) | (r.done ? kDone : 0u) |
                               (std::uint32_t{r.session} << 16),
                           r.answered,
                           r.beta,
                           r.omega,
                           r.omega_dot,
                           r.analog};
  std::memcpy(out.data(), &bytes, sizeof bytes);
}

std::optional<NumberedCommand> decode_command(std::span<const std::byte> bytes) noexcept {
  CommandBytes b;
  if (!take(bytes, kCommandMagic, b) || !std::isfinite(b.volts[0]) || !std::isfinite(b.volts[1])) return {};
  return NumberedCommand{{b.volts, b.answers, (b.flags & kArmed) != 0, (b.flags & kStart) != 0}, b.number};
}

std::optional<BoardReading> decode_reading(std::span<const std::byte> bytes) noexcept {
  ReadingBytes b;
  if (!take(bytes, kReadingMagic, b)) return {};
  if (!std::isfinite(b.beta) || !std::isfinite(b.omega) || !std::isfinite(b.omega_dot)) return {};
  return BoardReading{b.tick,
                      b.beta,
                      b.omega,
                      b.omega_dot,
                      b.analog,
                      b.answered,
                      (b.flags & kOutput) != 0,
                      (b.flags & kExpired) != 0,
                      (b.flags & kDone) != 0,
                      static_cast<std::uint16_t>(b.flags >> 16)};
}

Address parse_address(const std::string& text) {
  const std::size_t colon = text.rfind(':');
  const std::string digits = colon == std::string::npos ? "" : text.substr(colon + 1);
  const bool number =
      !digits.empty() && digits.size() <= 5 && digits.find_first_not_of("0123456789") == std::string::npos;
  const long port = number ? std::strtol(digits.c_str(), nullptr, 10) : -1;
  in_addr ignored;
  if (port < 0 || port > 65535 || ::inet_pton(AF_INET, text.substr(0, colon).c_str(), &ignored) != 1) {
    throw Error::in_field("board address", text, "IPv4 address and port, e.g. 127.0.0.1:47010");
  }
  return {text.substr(0, colon), static_cast<int>(port)};
}

}  // namespace board

UdpBoard::UdpBoard(const std::string& address, std::optional<board::Key> key)
    : address_(address), key_(std::move(key)), starts_{board::start_of_now(), 0} {
  const board::Address a = board::parse_address(address);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(a.port));
  ::inet_pton(AF_INET, a.host.c_str(), &to.sin_addr);
  fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd_ == -1 || ::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) {
    const int reason = errno;
    if (fd_ != -1) ::close(fd_);
    throw Error(fmt::format("board {}: {}", address, std::strerror(reason)));
  }
}

UdpBoard::~UdpBoard() { ::close(fd_); }

bool UdpBoard::read(BoardReading& out) noexcept {
  bool fresh = false;
  std::array<std::byte, board::kLargestDatagram + 1> bytes;
  while (true) {
    const ssize_t n = ::recv(fd_, bytes.data(), bytes.size(), 0);
    if (n == -1) {
      if (errno == ECONNREFUSED) {
        connected_ = false;
        seen_ = seen_ && key_;  // a board with a key that starts again says so by its seal
      }
      if (errno == EINTR || errno == ECONNREFUSED) continue;
      break;
    }
    connected_ = true;
    const auto reading = open(std::span(bytes).first(static_cast<std::size_t>(n)));
    if (!reading || is_late(*reading)) continue;
    out = *reading;
    tick_ = out.tick;
    session_ = out.session;
    seen_ = fresh = true;
  }
  return fresh;
}

std::optional<BoardReading> UdpBoard::open(std::span<const std::byte> datagram) noexcept {
  if (!key_) return board::decode_reading(datagram);
  const auto starts = key_->open(datagram);
  // What the board said to an earlier start of this program, or before a later start of its own, is old.
  if (!starts || starts->receiver != starts_.sender || starts->sender < starts_.receiver) {
    ++refused_;
    return {};
  }
  if (starts->sender != starts_.receiver) seen_ = false;
  starts_.receiver = starts->sender;
  const auto reading = board::decode_reading(datagram.first(datagram.size() - board::kSealSize));
  // Sealed readings of one start only ever count forward.
  if (reading && seen_ && static_cast<std::int32_t>(reading->tick - tick_) <= 0) return {};
  return reading;
}

std::string UdpBoard::failure() const {
  if (starts_.receiver != 0 || refused() == 0) return {};
  return fmt::format("{}: {} datagrams without the key of board.key_file: both ends need the same key", address_,
                     refused());
}

bool UdpBoard::is_late(const BoardReading& reading) const noexcept {
  // Datagrams overtake each other by a few; a board that counts from its beginning again is another thing.
  constexpr std::int32_t kMostOvertaken = 1000;  // ticks
  const auto ahead = static_cast<std::int32_t>(reading.tick - tick_);
  return seen_ && reading.session == session_ && ahead <= 0 && ahead > -kMostOvertaken;
}

void UdpBoard::write(const BoardCommand& command) noexcept {
  std::array<std::byte, board::kCommandSize + board::kSealSize> bytes;
  board::encode({command, ++number_}, std::span(bytes).first<board::kCommandSize>());
  if (key_) key_->seal(bytes, starts_);
  (void)!::send(fd_, bytes.data(), key_ ? bytes.size() : board::kCommandSize, MSG_NOSIGNAL);
}

}  // namespace whirl::rt
