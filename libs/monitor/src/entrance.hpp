#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <functional>
#include <string>

#include "door.hpp"

namespace whirl::monitor {

/// Takes connections, also when the process has no descriptor left: then one that is unfinished makes room. The door
/// must outlive the context, whose handlers hold places.
class Entrance {
 public:
  using Socket = boost::asio::ip::tcp::socket;
  Entrance(boost::asio::io_context& context, Door& door, std::function<void(Socket&&)> take)
      : acceptor(context), door_(door), again_(context), take_(std::move(take)) {}

  void accept(bool exhausted_before = false);

  boost::asio::ip::tcp::acceptor acceptor;

 private:
  void make_room();

  Door& door_;
  boost::asio::steady_timer again_;
  std::function<void(Socket&&)> take_;
};

/// The address that the limits count: of IPv6 the network of 64 bits, which one machine holds.
std::string counted_address(const Entrance::Socket& socket);

}  // namespace whirl::monitor
