#pragma once
#include <boost/asio/io_context.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>
#include <thread>

#include "whirl/monitor/hub.hpp"

namespace whirl::monitor {

/// Recordings that pages send. The bytes go to a file in a folder that only this user can enter; a thread of its own
/// reads it, so that no frame waits; the folder goes when that is done. Used by the server's thread.
class Uploads {
 public:
  using Request = boost::beast::http::request<boost::beast::http::string_body>;
  using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;

  Uploads(Hub& hub, boost::asio::io_context& context, std::uint64_t largest)
      : hub_(hub), context_(context), largest_(largest) {}
  ~Uploads() { wait(); }
  Uploads(const Uploads&) = delete;
  Uploads& operator=(const Uploads&) = delete;

  static bool is_one(const Request& request);
  /// Takes over a connection of which only the header was read, and answers it.
  void take(boost::beast::tcp_stream stream, boost::beast::flat_buffer buffer, Parser& header, bool allowed);
  /// Until the thread that reads has ended.
  void wait();

 private:
  class Session;

  Hub& hub_;
  boost::asio::io_context& context_;
  std::uint64_t largest_;
  bool busy_ = false;
  std::thread reader_;
};

}  // namespace whirl::monitor
