// Boost.Beast is slow to compile: only this file and upload.cpp include it.
#include "whirl/monitor/server.hpp"

#include <fmt/format.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <thread>
#include <utility>
#include <vector>

#include "entrance.hpp"
#include "page.hpp"
#include "upload.hpp"
#include "whirl/core/error.hpp"

namespace whirl::monitor {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
namespace asio = boost::asio;
using tcp = asio::ip::tcp;
using json = nlohmann::json;
using std::chrono_literals::operator""s;

constexpr std::size_t kMaxRequest = 4096;     ///< bytes of one message of a client
constexpr std::uint64_t kLargestBody = 1024;  ///< bytes, of a request for the page
constexpr int kSendBuffer = 1 << 18;          ///< bytes
constexpr std::size_t kHolders = 8;           ///< clients with the token, beside the viewers
constexpr auto kRefusalEvery = 60s;           ///< a line at most about refused commands
constexpr auto kWholeRequest = 5s;            ///< a request has come until then

/// Beast of this age has its own string view.
std::string_view plain(beast::string_view text) { return {text.data(), text.size()}; }

/// Takes the same time wherever the first difference is.
bool same_secret(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0U : 1U;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b.empty() ? 0 : b[i % b.size()]);
  }
  return difference == 0 && !a.empty();
}

}  // namespace

std::string make_token() {
  std::random_device random;
  std::string token;
  for (int i = 0; i < 4; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(random()));
  return token;
}

namespace {

class StreamSession;

/// What all sessions share.
struct Service {
  Service(Hub& h, const ServerOptions& o);

  Hub& hub;
  ServerOptions options;
  std::uint16_t port = 0;
  std::size_t viewers = 0;  ///< clients without the token; of the server's thread
  std::size_t holders = 0;  ///< clients with it
  std::size_t refused = 0;  ///< commands since the last line about them
  std::chrono::steady_clock::time_point refusal_told{};
  std::vector<std::weak_ptr<StreamSession>> viewing;
  std::vector<std::weak_ptr<ClientQueue>> queues;  ///< all that were given to the hub
  Uploads uploads{hub, context, options.largest_file};
  Door door{most_unfinished()};
  asio::io_context context{1};  ///< destroyed before what its handlers use
  Entrance entrance;
  std::thread thread;

  bool host_allowed(std::string_view host) const {
    const auto matches = [&](const std::string& name) {
      return host == name + ":" + std::to_string(port) || (port == 80 && host == name);
    };
    return matches("127.0.0.1") || matches("localhost") || matches("[::1]") || matches(options.address) ||
           matches("[" + options.address + "]");
  }
  /// Pages of this server only; programs that are no browsers send no Origin.
  bool origin_allowed(std::string_view origin) const {
    constexpr std::string_view kScheme = "http://";
    if (origin.empty()) return true;
    return origin.starts_with(kScheme) && host_allowed(origin.substr(kScheme.size()));
  }
  bool has_token(std::string_view target) const {
    constexpr std::string_view kBefore = "/stream?token=";
    return target.starts_with(kBefore) && same_secret(options.token, std::string(target.substr(kBefore.size())));
  }
  /// Whoever sends thousands of commands without the token must not push what matters out of the log.
  void note_refusal() {
    ++refused;
    const auto now = std::chrono::steady_clock::now();
    if (refusal_told != std::chrono::steady_clock::time_point{} && now - refusal_told < kRefusalEvery) return;
    refusal_told = now;
    hub.report(fmt::format("refused: {} without the right token",
                           refused == 1 ? "a command" : fmt::format("{} commands", refused)));
    refused = 0;
  }
  bool make_room();
};

/// One WebSocket client.
class StreamSession : public std::enable_shared_from_this<StreamSession> {
 public:
  StreamSession(tcp::socket&& socket, Service& server, bool holder);
  ~StreamSession();
  void run(http::request<http::string_body> request);
  void close();
  std::chrono::steady_clock::time_point heard() const { return heard_; }
  bool closed() const { return closed_; }

 private:
  void read();
  void received();
  void write();

  Service& server_;
  const bool holder_;  ///< came with the token
  websocket::stream<beast::tcp_stream> stream_;
  std::shared_ptr<ClientQueue> queue_;
  beast::flat_buffer buffer_;
  MessagePtr sending_;
  std::uint64_t reported_ = 0;  ///< dropped frames already told
  int refused_ = 0;
  std::chrono::steady_clock::time_point heard_ = std::chrono::steady_clock::now();
  bool closed_ = false;
};

/// One HTTP connection: a file of the page, or the step up to WebSocket.
class PageSession : public std::enable_shared_from_this<PageSession> {
 public:
  PageSession(tcp::socket&& socket, Service& server) : server_(server), stream_(std::move(socket)) {
    const auto close = [this] {
      beast::error_code ignored;
      stream_.socket().close(ignored);
    };
    place_ = server_.door.enter(close, counted_address(stream_.socket()));
  }
  void read() {
    place_->asked = false;
    parser_.emplace();
    parser_->header_limit(8192);
    parser_->body_limit(server_.options.largest_file);
    stream_.expires_after(kWholeRequest);
    http::async_read_header(stream_, buffer_, *parser_,
                            [self = shared_from_this()](beast::error_code failed, std::size_t) {
                              if (!failed) self->read_body();
                            });
  }

 private:
  void read_body();
  void answer();
  void send(http::status status, std::string_view type, std::string_view body);

  Service& server_;
  beast::tcp_stream stream_;
  std::shared_ptr<Door::Place> place_;  ///< given up before the stream
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

void PageSession::read_body() {
  const auto& request = parser_->get();
  if (Uploads::is_one(request)) {
    const bool allowed = server_.host_allowed(plain(request[http::field::host])) &&
                         server_.origin_allowed(plain(request[http::field::origin])) &&
                         same_secret(server_.options.token, std::string(plain(request["X-Whirl-Token"])));
    if (!allowed) server_.note_refusal();
    place_.reset();
    return server_.uploads.take(std::move(stream_), std::move(buffer_), *parser_, allowed);
  }
  if (parser_->content_length().value_or(0) > kLargestBody) return;  // no request of the page has one
  parser_->body_limit(kLargestBody);
  http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code failed, std::size_t) {
    if (!failed) self->answer();
  });
}

void PageSession::answer() {
  place_->asked = true;
  const auto& request = parser_->get();
  const std::string_view target = plain(request.target());
  if (!server_.host_allowed(plain(request[http::field::host])) ||
      !server_.origin_allowed(plain(request[http::field::origin]))) {
    return send(http::status::forbidden, "text/plain", "forbidden: this page is served to its own address only\n");
  }
  if (websocket::is_upgrade(request)) {
    const bool holder = server_.has_token(target);
    // A page that was opened with the token of an earlier start still shows.
    if (!holder && target != "/stream" && !target.starts_with("/stream?")) {
      return send(http::status::not_found, "text/plain", "not found\n");
    }
    // Viewers never take the place of the person who can trip.
    if (holder ? server_.holders >= kHolders : server_.viewers >= server_.options.max_clients && !server_.make_room()) {
      return send(http::status::service_unavailable, "text/plain", "too many clients\n");
    }
    stream_.expires_never();
    place_.reset();
    const auto session = std::make_shared<StreamSession>(stream_.release_socket(), server_, holder);
    if (!holder) server_.viewing.push_back(session);
    session->run(parser_->release());
    return;
  }
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    return send(http::status::method_not_allowed, "text/plain", "only GET\n");
  }
  for (const PageFile& file : page_files()) {
    if (target == file.path) return send(http::status::ok, file.type, file.text);
  }
  send(http::status::not_found, "text/plain", "not found\n");
}

void PageSession::send(http::status status, std::string_view type, std::string_view body) {
  const auto& request = parser_->get();
  const bool keep = request.keep_alive() && status == http::status::ok;
  response_ = {};
  response_.result(status);
  response_.version(request.version());
  response_.set(http::field::content_type, beast::string_view(type.data(), type.size()));
  response_.set(http::field::cache_control, "no-store");
  response_.set("X-Content-Type-Options", "nosniff");
  response_.set("Referrer-Policy", "no-referrer");
  response_.set("Content-Security-Policy",
                "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data:; "
                "frame-ancestors 'none'; base-uri 'none'; form-action 'none'");
  response_.keep_alive(keep);
  if (request.method() == http::verb::head) {
    response_.content_length(body.size());
  } else {
    response_.body() = std::string(body);
    response_.prepare_payload();
  }
  stream_.expires_after(10s);
  http::async_write(stream_, response_, [self = shared_from_this(), keep](beast::error_code failed, std::size_t) {
    if (!failed && keep) return self->read();
    beast::error_code ignored;
    self->stream_.socket().shutdown(tcp::socket::shutdown_send, ignored);
  });
}

StreamSession::StreamSession(tcp::socket&& socket, Service& server, bool holder)
    : server_(server), holder_(holder), stream_(std::move(socket)) {
  ++(holder_ ? server_.holders : server_.viewers);
  // A slow page shall lose frames, not lag behind: the system must not hold seconds of them.
  beast::error_code ignored;
  auto& wire = beast::get_lowest_layer(stream_).socket();
  wire.set_option(asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  wire.set_option(tcp::no_delay(true),
                  ignored);  // else a frame waits up to 40 ms for the acknowledgement of the one before
}

StreamSession::~StreamSession() {
  if (queue_) server_.hub.remove(queue_);
  if (!closed_) --(holder_ ? server_.holders : server_.viewers);
}

void StreamSession::run(http::request<http::string_body> request) {
  // Pings find out clients that are gone; a client that does not take its data for 10 s is closed.
  websocket::stream_base::timeout timeout;
  timeout.handshake_timeout = 10s;
  timeout.idle_timeout = 20s;
  timeout.keep_alive_pings = true;
  stream_.set_option(timeout);
  stream_.read_message_max(kMaxRequest);
  stream_.async_accept(request, [self = shared_from_this()](beast::error_code failed) {
    if (failed) return;
    std::weak_ptr<StreamSession> weak = self;
    auto wake = [weak, &context = self->server_.context] {
      asio::post(context, [weak] {
        if (const auto session = weak.lock()) session->write();
      });
    };
    self->queue_ = std::make_shared<ClientQueue>(self->server_.options.queue, std::move(wake));
    std::erase_if(self->server_.queues, [](const auto& queue) { return queue.expired(); });
    self->server_.queues.push_back(self->queue_);
    self->server_.hub.add(self->queue_);
    self->read();
  });
}

void StreamSession::read() {
  stream_.async_read(buffer_, [self = shared_from_this()](beast::error_code failed, std::size_t) {
    if (failed) return self->close();
    self->received();
    self->buffer_.consume(self->buffer_.size());
    if (self->refused_ <= 10) return self->read();
    self->close();  // somebody is trying tokens
  });
}

void StreamSession::received() {
  const std::string text = beast::buffers_to_string(buffer_.data());
  json answer;
  json request = json::parse(text, nullptr, false);
  if (stream_.got_text() && request.is_object() && request.contains("here")) {
    heard_ = std::chrono::steady_clock::now();
    return;
  }
  if (!stream_.got_text() || !request.is_object() || !request.contains("command")) {
    answer = {{"type", "refused"}, {"reason", "not a command"}};
    ++refused_;
  } else if (!request.contains("token") || !request["token"].is_string() ||
             !same_secret(server_.options.token, request["token"].get<std::string>())) {
    answer = {{"type", "refused"}, {"reason", "this needs the token that the monitor printed at its start"}};
    ++refused_;
    server_.note_refusal();
  } else {
    request.erase("token");
    server_.hub.submit(request.dump());
    return;
  }
  queue_->push(std::make_shared<Message>(Message{answer.dump(), true}));
}

void StreamSession::write() {
  if (sending_ || !stream_.is_open()) return;
  if (const std::uint64_t dropped = queue_->dropped(); dropped != reported_) {
    reported_ = dropped;
    sending_ = std::make_shared<Message>(Message{json{{"type", "client"}, {"dropped", dropped}}.dump(), true});
  } else {
    sending_ = queue_->pop();
  }
  if (!sending_) return;
  stream_.text(sending_->text);
  stream_.async_write(asio::buffer(sending_->data), [self = shared_from_this()](beast::error_code failed, std::size_t) {
    self->sending_ = nullptr;
    if (failed) return self->close();
    self->write();
  });
}

void StreamSession::close() {
  if (!std::exchange(closed_, true)) --(holder_ ? server_.holders : server_.viewers);
  if (queue_) server_.hub.remove(queue_);
  beast::error_code ignored;
  beast::get_lowest_layer(stream_).socket().close(ignored);
}

/// The place of the viewer who has been silent longest; false when all have shown themselves lately.
bool Service::make_room() {
  std::erase_if(viewing, [](const auto& v) { return v.expired(); });
  std::shared_ptr<StreamSession> silent;
  for (const auto& weak : viewing) {
    const auto viewer = weak.lock();
    if (viewer && !viewer->closed() && (!silent || viewer->heard() < silent->heard())) silent = viewer;
  }
  const std::chrono::duration<double> since =
      std::chrono::steady_clock::now() - (silent ? silent->heard() : std::chrono::steady_clock::now());
  if (!silent || since.count() < options.idle) return false;
  silent->close();
  return true;
}

Service::Service(Hub& h, const ServerOptions& o)
    : hub(h), options(o), entrance(context, door, [this](tcp::socket&& socket) {
        std::make_shared<PageSession>(std::move(socket), *this)->read();
      }) {}

}  // namespace

struct Server::Impl : Service {
  using Service::Service;
};

Server::Server(Hub& hub, const ServerOptions& options) : impl_(std::make_unique<Impl>(hub, options)) {
  beast::error_code failed;
  const auto address = asio::ip::make_address(options.address, failed);
  if (failed) throw Error::in_field("address", options.address, "an IP address such as 127.0.0.1");
  const tcp::endpoint endpoint(address, options.port);
  auto& acceptor = impl_->entrance.acceptor;
  acceptor.open(endpoint.protocol(), failed);
  if (!failed) acceptor.set_option(tcp::acceptor::reuse_address(true), failed);
  if (!failed) acceptor.bind(endpoint, failed);
  if (!failed) acceptor.listen(asio::socket_base::max_listen_connections, failed);
  if (failed) throw Error(fmt::format("cannot serve at {}:{}: {}", options.address, options.port, failed.message()));
  impl_->port = acceptor.local_endpoint().port();
}

Server::~Server() { stop(); }

void Server::start() {
  if (impl_->thread.joinable()) return;
  impl_->entrance.accept();
  impl_->thread = std::thread([this] { impl_->context.run(); });
}

void Server::stop() {
  if (!impl_->thread.joinable()) return;
  asio::post(impl_->context, [this] {
    beast::error_code ignored;
    impl_->entrance.acceptor.close(ignored);
    impl_->context.stop();
  });
  impl_->thread.join();
  impl_->uploads.wait();
  // From here on the hub must not wake sessions whose context is about to go.
  for (const auto& weak : impl_->queues) {
    if (const auto queue = weak.lock()) impl_->hub.remove(queue);
  }
}

std::uint16_t Server::port() const { return impl_->port; }

std::string Server::url() const {
  const bool v6 = impl_->options.address.find(':') != std::string::npos;
  const std::string host = v6 ? "[" + impl_->options.address + "]" : impl_->options.address;
  const std::string token = impl_->options.token.empty() ? "" : "#token=" + impl_->options.token;
  return fmt::format("http://{}:{}/{}", host, impl_->port, token);
}

}  // namespace whirl::monitor
