#include "whirl/monitor/server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "whirl/core/error.hpp"

namespace whirl::monitor {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
namespace asio = boost::asio;
using tcp = asio::ip::tcp;
using json = nlohmann::json;

Recording tone() {
  Recording r;
  r.dt = 1e-3;
  r.source = "tone.csv";
  r.add("x", Quantity::displacement, 1e-3 * Eigen::VectorXd::LinSpaced(4000, 0, 600).array().sin());
  return r;
}

class MonitorServer : public ::testing::Test {
 protected:
  explicit MonitorServer(double idle = 60)
      : hub_(std::make_unique<PlaybackSource>(tone(), 1, true), {}), server_(hub_, options(idle)) {
    server_.start();
    hub_.start();
  }
  ~MonitorServer() override {
    server_.stop();
    hub_.stop();
  }
  static ServerOptions options(double idle) {
    ServerOptions o;
    o.port = 0;
    o.token = "secret";
    o.max_clients = 3;
    o.queue = 8;
    o.idle = idle;
    return o;
  }
  std::string host() const { return "127.0.0.1:" + std::to_string(server_.port()); }
  tcp::socket connect() {
    tcp::socket socket(context_);
    socket.connect({asio::ip::make_address("127.0.0.1"), server_.port()});
    return socket;
  }
  http::response<http::string_body> request(http::verb verb, const std::string& target, const std::string& host_name,
                                            const std::string& origin = "") {
    tcp::socket socket = connect();
    http::request<http::string_body> r(verb, target, 11);
    r.set(http::field::host, host_name);
    if (!origin.empty()) r.set(http::field::origin, origin);
    http::write(socket, r);
    beast::flat_buffer buffer;
    http::response_parser<http::string_body> parser;
    parser.skip(verb == http::verb::head);
    http::read(socket, buffer, parser);
    return parser.release();
  }
  using Stream = websocket::stream<tcp::socket>;
  std::unique_ptr<Stream> open(const std::string& origin, beast::error_code& failed) {
    auto stream = std::make_unique<Stream>(connect());
    stream->set_option(websocket::stream_base::decorator([&](websocket::request_type& r) {
      if (!origin.empty()) r.set(http::field::origin, origin);
    }));
    stream->handshake(host(), "/stream", failed);
    return stream;
  }
  std::unique_ptr<Stream> open() {
    beast::error_code failed;
    auto stream = open("http://" + host(), failed);
    EXPECT_FALSE(failed) << failed.message();
    return stream;
  }
  static std::string next(Stream& stream) {
    beast::flat_buffer buffer;
    stream.read(buffer);
    return beast::buffers_to_string(buffer.data());
  }
  /// Reads until a text message of this type; fails the test after many messages.
  static json await(Stream& stream, const std::string& type) {
    for (int i = 0; i < 300; ++i) {
      const std::string data = next(stream);
      if (!stream.got_text()) continue;
      json message = json::parse(data);
      if (message["type"] == type) return message;
    }
    ADD_FAILURE() << "no message of type " << type;
    return {};
  }

  asio::io_context context_;
  Hub hub_;
  Server server_;
};

TEST_F(MonitorServer, ServesThePageWithNothingFromOutside) {
  const auto page = request(http::verb::get, "/", host());
  EXPECT_EQ(page.result(), http::status::ok);
  EXPECT_THAT(std::string(page["Content-Security-Policy"]), HasSubstr("default-src 'none'"));
  for (const char* target : {"/", "/main.js", "/store.js", "/transport.js", "/style.css"}) {
    const auto part = request(http::verb::get, target, host());
    EXPECT_EQ(part.result(), http::status::ok) << target;
    EXPECT_GT(part.body().size(), 500U);
    EXPECT_THAT(part.body(), Not(HasSubstr("http://"))) << target;
    EXPECT_THAT(part.body(), Not(HasSubstr("https://"))) << target;
  }
  EXPECT_EQ(request(http::verb::get, "/etc/passwd", host()).result(), http::status::not_found);
  EXPECT_EQ(request(http::verb::get, "/../main.cpp", host()).result(), http::status::not_found);
  EXPECT_EQ(request(http::verb::post, "/", host()).result(), http::status::method_not_allowed);
  EXPECT_EQ(request(http::verb::head, "/", host()).result(), http::status::ok);
}

TEST_F(MonitorServer, RefusesForeignHostsAndPages) {
  EXPECT_EQ(request(http::verb::get, "/", "evil.example").result(), http::status::forbidden);
  EXPECT_EQ(request(http::verb::get, "/", host(), "http://evil.example").result(), http::status::forbidden);
  beast::error_code failed;
  open("http://evil.example", failed);
  EXPECT_TRUE(failed);
  open("null", failed);
  EXPECT_TRUE(failed);
  open("http://" + host(), failed);
  EXPECT_FALSE(failed);
}

TEST_F(MonitorServer, StreamsDescriptionThenFrames) {
  auto stream = open();
  const json description = json::parse(next(*stream));
  EXPECT_EQ(description["type"], "stream");
  EXPECT_EQ(description["name"], "tone.csv");
  bool samples = false;
  for (int i = 0; i < 100 && !samples; ++i) {
    const std::string data = next(*stream);
    samples = !stream->got_text() && decode_frame(data).kind == FrameKind::samples && decode_frame(data).n > 0;
  }
  EXPECT_TRUE(samples);
}

TEST_F(MonitorServer, CommandsNeedTheToken) {
  auto stream = open();
  stream->write(asio::buffer(std::string(R"({"command":"pause"})")));
  EXPECT_THAT(await(*stream, "refused")["reason"].get<std::string>(), HasSubstr("token"));
  stream->write(asio::buffer(std::string(R"({"command":"pause","token":"secre"})")));
  await(*stream, "refused");
  stream->write(asio::buffer(std::string(R"({"command":"pause","token":"secret"})")));
  for (int i = 0; i < 5; ++i) {
    const json status = await(*stream, "status");
    if (status["items"][0][1] == "paused") {
      EXPECT_THAT(status.dump(), Not(HasSubstr("secret")));
      return;
    }
  }
  FAIL() << "not paused";
}

TEST_F(MonitorServer, GuessingTokensEndsTheConnection) {
  auto stream = open();
  beast::error_code failed;
  for (int i = 0; i < 30 && !failed; ++i)
    stream->write(asio::buffer(std::string(R"({"command":"play","token":"x"})")), failed);
  for (int i = 0; i < 300 && !failed; ++i) {
    beast::flat_buffer buffer;
    stream->read(buffer, failed);
  }
  EXPECT_TRUE(failed);
}

TEST_F(MonitorServer, FragmentedMessageIsJoinedAndOversizeCloses) {
  auto stream = open();
  stream->write_some(false, asio::buffer(std::string(R"({"command":"pause",)")));
  stream->write_some(true, asio::buffer(std::string(R"("token":"wrong"})")));
  EXPECT_THAT(await(*stream, "refused")["reason"].get<std::string>(), HasSubstr("token"));
  beast::error_code failed;
  stream->write(asio::buffer(std::string(100'000, 'x')), failed);
  for (int i = 0; i < 300 && !failed; ++i) {
    beast::flat_buffer buffer;
    stream->read(buffer, failed);
  }
  EXPECT_TRUE(failed);
  EXPECT_EQ(next(*open()).front(), '{');  // others are served on
}

TEST_F(MonitorServer, ViewersNeverTakeThePlaceOfTheTokensHolder) {
  std::vector<std::unique_ptr<Stream>> viewers;
  beast::error_code failed;
  for (int i = 0; i < 20 && !failed; ++i) {
    auto stream = open("http://" + host(), failed);
    if (!failed) viewers.push_back(std::move(stream));
  }
  EXPECT_TRUE(failed) << "viewers are limited";
  Stream wrong(connect());
  wrong.handshake(host(), "/stream?token=secre", failed);
  EXPECT_TRUE(failed);
  Stream holder(connect());
  holder.handshake(host(), "/stream?token=secret", failed);
  ASSERT_FALSE(failed) << failed.message();
  holder.write(asio::buffer(std::string(R"({"command":"pause","token":"secret"})")));
  for (int i = 0; i < 5; ++i) {
    if (await(holder, "status")["items"][0][1] == "paused") return;
  }
  FAIL() << "not paused";
}

// Thousands of connections that say nothing do not keep out who does.
TEST_F(MonitorServer, SilentConnectionsMakeRoomForAPersonWhoAsks) {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  rlimit usual = before;
  usual.rlim_cur = std::min<rlim_t>(1024, before.rlim_max);
  setrlimit(RLIMIT_NOFILE, &usual);
  std::vector<tcp::socket> silent;
  for (int i = 0; i < 600; ++i) {
    silent.push_back(connect());
    if (i % 2 == 0) asio::write(silent.back(), asio::buffer("GET / HT", 8));
    if (i % 100 != 99) continue;
    const auto start = std::chrono::steady_clock::now();
    EXPECT_EQ(request(http::verb::get, "/", host()).result(), http::status::ok) << i;
    EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(1)) << i;
  }
  int ended = 0;
  for (tcp::socket& socket : silent) {
    beast::error_code failed;
    char byte = 0;
    socket.non_blocking(true);
    socket.read_some(asio::buffer(&byte, 1), failed);
    ended += failed != asio::error::would_block;
  }
  EXPECT_GE(ended, 600 - 128);
  setrlimit(RLIMIT_NOFILE, &before);
}

// Half a request of a slow person stays, whatever another address opens.
TEST_F(MonitorServer, AStormOfOneAddressClosesNobodyElsesConnection) {
  tcp::socket slow = connect();
  const std::string whole = "GET / HTTP/1.1\r\nHost: " + host() + "\r\n\r\n";
  asio::write(slow, asio::buffer(whole.data(), 10));
  std::vector<tcp::socket> storm;
  for (int i = 0; i < 300; ++i) {
    storm.emplace_back(context_, tcp::endpoint(asio::ip::make_address("127.0.0.2"), 0));
    storm.back().connect({asio::ip::make_address("127.0.0.1"), server_.port()});
  }
  EXPECT_EQ(request(http::verb::get, "/", host()).result(), http::status::ok) << "so that the storm has been taken";
  beast::error_code failed;
  asio::write(slow, asio::buffer(whole.data() + 10, whole.size() - 10), failed);
  beast::flat_buffer buffer;
  http::response<http::string_body> answer;
  http::read(slow, buffer, answer, failed);
  EXPECT_FALSE(failed) << failed.message();
  EXPECT_EQ(answer.result(), http::status::ok);
}

// The process has no descriptor left: the one kept for it takes the next connection.
TEST_F(MonitorServer, AReservedDescriptorServesWhenThereIsNoOther) {
  EXPECT_EQ(request(http::verb::get, "/", host()).result(), http::status::ok);
  tcp::socket socket(context_, tcp::v4());
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  std::vector<int> all;
  for (int fd; (fd = ::dup(0)) >= 0 && all.size() < 100;) all.push_back(fd);  // numbers below the limit to come
  rlimit none = before;
  none.rlim_cur = static_cast<rlim_t>(all.back()) + 1;
  setrlimit(RLIMIT_NOFILE, &none);
  socket.connect({asio::ip::make_address("127.0.0.1"), server_.port()});
  http::request<http::string_body> r(http::verb::get, "/", 11);
  r.set(http::field::host, host());
  http::write(socket, r);
  beast::flat_buffer buffer;
  http::response<http::string_body> answer;
  beast::error_code failed;
  http::read(socket, buffer, answer, failed);
  EXPECT_FALSE(failed) << failed.message();
  EXPECT_EQ(answer.result(), http::status::ok);
  setrlimit(RLIMIT_NOFILE, &before);
  for (const int fd : all) ::close(fd);
}

TEST_F(MonitorServer, RefusedCommandsAreToldOnceAndDoNotFillTheLog) {
  int sent = 0;
  for (int connection = 0; connection < 20; ++connection) {
    beast::error_code failed;
    auto stream = open("http://" + host(), failed);
    if (failed) {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      continue;
    }
    for (int i = 0; i < 10 && !failed; ++i, ++sent) {
      stream->write(asio::buffer(std::string(R"({"command":"trip","token":"x"})")), failed);
      if (!failed) await(*stream, "refused");
    }
  }
  ASSERT_GT(sent, 50);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  auto viewer = open();
  const json history = await(*viewer, "history");
  int lines = 0;
  for (const auto& line : history["log"]) lines += line.get<std::string>().find("refused") != std::string::npos;
  EXPECT_EQ(lines, 1) << history.dump();
}

TEST_F(MonitorServer, ClientsAreLimitedAndLeaveRoomAgain) {
  std::vector<std::unique_ptr<Stream>> streams;
  for (int i = 0; i < 3; ++i) streams.push_back(open());
  beast::error_code failed;
  open("http://" + host(), failed);
  EXPECT_TRUE(failed);
  streams.clear();
  for (int i = 0; i < 50; ++i) {
    open("http://" + host(), failed);
    if (!failed) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  FAIL() << "no room again";
}

struct ImpatientServer : MonitorServer {
  ImpatientServer() : MonitorServer(3) {}
};

TEST_F(ImpatientServer, IdleViewersMakeRoomAndThoseWhoLookStay) {
  std::vector<std::unique_ptr<Stream>> viewers;
  for (int i = 0; i < 3; ++i) {
    viewers.push_back(open());
    await(*viewers.back(), "stream");
  }
  beast::error_code failed;
  (void)open("", failed);
  EXPECT_TRUE(failed) << "all have just come";
  std::this_thread::sleep_for(std::chrono::milliseconds(3100));
  for (const int i : {0, 2}) viewers[static_cast<std::size_t>(i)]->write(asio::buffer(std::string(R"({"here":true})")));
  for (const int i : {0, 2}) await(*viewers[static_cast<std::size_t>(i)], "status");
  const auto late = open();
  await(*late, "stream");
  (void)open("", failed);
  EXPECT_TRUE(failed) << "the others are in use";
  EXPECT_THROW(
      {
        for (int i = 0; i < 10000; ++i) next(*viewers[1]);
      },
      beast::system_error)
      << "the silent one has lost its place";
  for (const int i : {0, 2}) EXPECT_NO_THROW(await(*viewers[static_cast<std::size_t>(i)], "status"));
}

TEST_F(MonitorServer, BlockedReaderLosesFramesWhileOthersAreServed) {
  // A socket with a small window that never reads: its frames pile up and are dropped; the other client keeps every
  // one.
  tcp::socket socket(context_);
  socket.open(tcp::v4());
  socket.set_option(asio::socket_base::receive_buffer_size(4096));
  socket.connect({asio::ip::make_address("127.0.0.1"), server_.port()});
  Stream blocked(std::move(socket));
  blocked.handshake(host(), "/stream");

  auto reader = open();
  next(*reader);
  std::uint32_t expected = 0;
  bool first = true;
  int frames = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(600);
  while (std::chrono::steady_clock::now() < end) {
    const std::string data = next(*reader);
    if (reader->got_text()) continue;
    const FrameHeader h = decode_frame(data);
    if (first) expected = h.seq;
    EXPECT_EQ(h.seq, expected);
    first = false;
    expected = h.seq + 1;
    ++frames;
  }
  EXPECT_GT(frames, 8);
}

TEST(MonitorServerOptions, AddressAndTokenAreChecked) {
  Hub hub(std::make_unique<PlaybackSource>(tone()), {});
  ServerOptions o;
  o.address = "not an address";
  EXPECT_THROW(Server(hub, o), Error);
  o.address = "127.0.0.1";
  o.port = 0;
  const Server server(hub, o);
  o.port = server.port();
  EXPECT_EQ(server.url(), "http://127.0.0.1:" + std::to_string(o.port) + "/");
  EXPECT_EQ(make_token().size(), 32U);
  EXPECT_NE(make_token(), make_token());
}

}  // namespace
}  // namespace whirl::monitor
