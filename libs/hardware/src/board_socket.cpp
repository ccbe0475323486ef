#include "whirl/hardware/board_socket.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "whirl/core/error.hpp"

namespace whirl::hardware {
namespace {

namespace board = rt::board;

/// To a program that has the key and has not heard the start of this board: nothing but that start.
constexpr std::array<char, 4> kWelcome{'W', 'H', 'S', '1'};

bool same_address(const sockaddr_in& a, const sockaddr_in& b) {
  return a.sin_addr.s_addr == b.sin_addr.s_addr && a.sin_port == b.sin_port;
}

}  // namespace

BoardSocket::BoardSocket(const std::string& address, const std::filesystem::path& key_file) {
  const board::Address a = board::parse_address(address);
  if (!key_file.empty()) key_ = board::read_key(key_file);
  if (!key_ && !a.host.starts_with("127.")) {
    throw Error::in_field("board address", address,
                          "127.0.0.1:PORT without a key, for whoever reaches the port may start the run; with "
                          "--board-key FILE any address");
  }
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(static_cast<std::uint16_t>(a.port));
  ::inet_pton(AF_INET, a.host.c_str(), &at.sin_addr);
  fd_ = ::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  socklen_t size = sizeof at;
  if (fd_ < 0 || ::bind(fd_, reinterpret_cast<sockaddr*>(&at), sizeof at) != 0 ||
      ::getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size) != 0) {
    const int reason = errno;
    if (fd_ >= 0) ::close(fd_);
    throw Error(fmt::format("board at {}: {}", address, std::strerror(reason)));
  }
  address_ = fmt::format("{}:{}", a.host, ntohs(at.sin_port));
}

BoardSocket::~BoardSocket() { ::close(fd_); }

bool BoardSocket::opens(std::span<const std::byte> datagram, const sockaddr_in& from, board::Starts& starts) {
  if (!key_) return true;
  const auto opened = key_->open(datagram);
  if (!opened || opened->sender < peer_start_) {
    ++refused_;
    return false;
  }
  starts = *opened;
  if (starts.receiver == start_) return true;
  std::array<std::byte, kWelcome.size() + board::kSealSize> welcome;
  std::memcpy(welcome.data(), kWelcome.data(), kWelcome.size());
  send_to(welcome, from, starts.sender);
  return false;
}

std::optional<BoardSocket::Heard> BoardSocket::accepted(std::span<const std::byte> datagram, const sockaddr_in& from,
                                                        bool silent) {
  board::Starts starts;
  if (!opens(datagram, from, starts)) return {};
  const auto c = board::decode_command(datagram.first(datagram.size() - (key_ ? board::kSealSize : 0)));
  if (!c) return {};
  const bool same = peer_ && same_address(*peer_, from) && starts.sender == peer_start_;
  if (!same && peer_ && !silent) return {};
  // With a key the numbers of one start rise also where an address has changed.
  const bool counted = same || (key_ && peer_ && starts.sender == peer_start_);
  if (counted && static_cast<std::int32_t>(c->number - last_number_) <= 0) return {};
  peer_ = from;
  peer_start_ = starts.sender;
  last_number_ = c->number;
  return Heard{*c, same};
}

std::optional<BoardSocket::Heard> BoardSocket::receive(bool silent) {
  std::array<std::byte, board::kLargestDatagram + 1> bytes;
  sockaddr_in from{};
  socklen_t size = sizeof from;
  for (ssize_t n; (n = ::recvfrom(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&from), &size)) >= 0;
       size = sizeof from) {
    if (auto heard = accepted(std::span(bytes).first(static_cast<std::size_t>(n)), from, silent)) return heard;
  }
  return {};
}

void BoardSocket::send(const rt::BoardReading& reading) {
  if (!peer_) return;
  std::array<std::byte, board::kLargestDatagram> bytes;
  board::encode(reading, std::span(bytes).first<board::kReadingSize>());
  send_to(std::span(bytes).first(board::kReadingSize + (key_ ? board::kSealSize : 0)), *peer_, peer_start_);
}

void BoardSocket::send_to(std::span<std::byte> datagram, const sockaddr_in& to, std::uint64_t receiver) {
  if (key_) key_->seal(datagram, {start_, receiver});
  (void)!::sendto(fd_, datagram.data(), datagram.size(), MSG_NOSIGNAL, reinterpret_cast<const sockaddr*>(&to),
                  sizeof to);
}

}  // namespace whirl::hardware
