#include "entrance.hpp"

#include <poll.h>

#include <algorithm>
#include <boost/asio/error.hpp>
#include <boost/system/error_code.hpp>
#include <chrono>
#include <utility>

namespace whirl::monitor {
namespace {

namespace asio = boost::asio;
using Code = boost::system::error_code;
constexpr std::chrono::milliseconds kAgain{20};  ///< until connections are taken again after the system refused one

}  // namespace

void Entrance::accept(bool exhausted_before) {
  if (!exhausted_before) door_.reserve();
  acceptor.async_accept([this](Code failed, Socket socket) {
    if (!acceptor.is_open()) return;
    if (!failed) take_(std::move(socket));
    const bool exhausted =
        failed == asio::error::no_descriptors || failed == boost::system::errc::too_many_files_open_in_system;
    if (exhausted) return make_room();
    accept();
  });
}

void Entrance::make_room() {
  // Without a descriptor the system says so also when nobody waits.
  pollfd waiting{acceptor.native_handle(), POLLIN, 0};
  if (::poll(&waiting, 1, 0) <= 0) {
    acceptor.async_wait(asio::ip::tcp::acceptor::wait_read, [this](Code ended) {
      if (!ended && acceptor.is_open()) accept(true);
    });
    return;
  }
  // An unfinished connection goes, and failing that the descriptor kept for this moment.
  if (door_.close_one() || door_.release()) return accept(true);
  again_.expires_after(kAgain);
  again_.async_wait([this](Code ended) {
    if (!ended && acceptor.is_open()) accept();
  });
}

std::string counted_address(const Entrance::Socket& socket) {
  Code failed;
  const auto end = socket.remote_endpoint(failed);
  if (failed) return {};
  const asio::ip::address address = end.address();
  if (!address.is_v6() || address.to_v6().is_v4_mapped()) return address.to_string();
  asio::ip::address_v6::bytes_type network = address.to_v6().to_bytes();
  std::fill(network.begin() + 8, network.end(), 0);
  return asio::ip::address_v6(network).to_string();
}

}  // namespace whirl::monitor
