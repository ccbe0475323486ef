#pragma once
#include <netinet/in.h>

#include <filesystem>
#include <optional>
#include <string>

#include "whirl/rt/drivers/udp_board.hpp"

namespace whirl::hardware {

/// The board's end of the UDP protocol: who commands, and which datagrams count.
class BoardSocket {
 public:
  /// `key_file` empty: no key, then only an address of this machine is served. Throws Error.
  BoardSocket(const std::string& address, const std::filesystem::path& key_file);
  ~BoardSocket();
  BoardSocket(const BoardSocket&) = delete;
  BoardSocket& operator=(const BoardSocket&) = delete;

  struct Heard {
    rt::board::NumberedCommand numbered;
    bool same = false;  ///< from the program that commanded before
  };
  /// The next command that counts. One program commands at a time; another one may when `silent`.
  std::optional<Heard> receive(bool silent);
  /// To the program that commands.
  void send(const rt::BoardReading& reading);
  bool commanded() const { return peer_.has_value(); }
  const std::string& address() const { return address_; }
  int descriptor() const { return fd_; }
  long refused() const { return refused_; }  ///< datagrams without the key, and recorded ones of earlier starts

 private:
  bool opens(std::span<const std::byte> datagram, const sockaddr_in& from, rt::board::Starts& starts);
  std::optional<Heard> accepted(std::span<const std::byte> datagram, const sockaddr_in& from, bool silent);
  void send_to(std::span<std::byte> datagram, const sockaddr_in& to, std::uint64_t receiver);

  int fd_ = -1;
  std::string address_;
  std::optional<rt::board::Key> key_;
  std::uint64_t start_ = rt::board::start_of_now();
  std::optional<sockaddr_in> peer_;
  std::uint64_t peer_start_ = 0;
  std::uint32_t last_number_ = 0;
  long refused_ = 0;
};

}  // namespace whirl::hardware
