#include "upload.hpp"

#include <fmt/format.h>

#include <boost/asio/post.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "whirl/core/error.hpp"
#include "whirl/io/temporary.hpp"

namespace whirl::monitor {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace fs = std::filesystem;
using std::chrono_literals::operator""s;

constexpr std::string_view kPlayed = "/open/played", kCompared = "/open/compared";
constexpr std::size_t kLongestName = 120;  // characters

/// What the user called the file, without folders and control characters; empty: not said.
std::string name_of(std::string_view encoded) {
  std::string name;
  for (std::size_t i = 0; i < encoded.size(); ++i) {
    int code = 0;
    if (encoded[i] == '%' && i + 2 < encoded.size() &&
        std::from_chars(encoded.data() + i + 1, encoded.data() + i + 3, code, 16).ptr == encoded.data() + i + 3) {
      name += static_cast<char>(code);
      i += 2;
    } else {
      name += encoded[i];
    }
  }
  name.erase(0, name.find_last_of("/\\") + 1);
  std::erase_if(name, [](char c) { return static_cast<unsigned char>(c) < 32 || c == 127; });
  return name.size() > kLongestName ? name.substr(name.size() - kLongestName) : name;
}

/// The end of a name, which says what kind of file it is, as a plain file name: ".csv.gz" of "run 7.csv.gz".
std::string file_name(const std::string& name) {
  std::string out = "recording";
  const std::size_t dot = name.find('.', name.size() > 12 ? name.size() - 12 : 0);
  for (const char c : dot == std::string::npos ? std::string(".csv") : name.substr(dot)) {
    if (c == '.' || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z')) out += c;
  }
  return out;
}

}  // namespace

class Uploads::Session : public std::enable_shared_from_this<Session> {
 public:
  Session(Uploads& uploads, beast::tcp_stream stream, beast::flat_buffer buffer, Parser& header)
      : uploads_(uploads), stream_(std::move(stream)), buffer_(std::move(buffer)) {
    const auto& request = header.get();
    const beast::string_view name = request["X-Whirl-Name"], target = request.target();
    as_ = std::string_view(target.data(), target.size()) == kPlayed ? Opened::played : Opened::compared;
    name_ = name_of({name.data(), name.size()});
    if (name_.empty()) name_ = "recording.csv";
    parser_.emplace(std::move(header));
  }
  ~Session() {
    if (owner_) uploads_.busy_ = false;
  }

  void receive() {
    uploads_.busy_ = owner_ = true;
    beast::error_code failed;
    try {
      folder_.emplace("open");
      file_ = folder_->path() / file_name(name_);
      parser_->get().body().open(file_.c_str(), beast::file_mode::write_new, failed);
      if (failed) throw Error("cannot write " + file_.string() + ": " + failed.message());
    } catch (const std::exception& e) {
      return answer(http::status::insufficient_storage, e.what());
    }
    parser_->body_limit(uploads_.largest_);
    stream_.expires_after(300s);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](beast::error_code ended, std::size_t) {
      if (ended == http::error::body_limit) return self->too_large();
      if (!ended) self->open();
    });
  }
  void too_large() {
    answer(http::status::payload_too_large,
           fmt::format("{} has more than {} MB; open it with `whirl monitor FILE`", name_, uploads_.largest_ >> 20));
  }
  void answer(http::status status, std::string text) {
    response_.result(status);
    response_.version(11);
    response_.set(http::field::content_type, "text/plain; charset=utf-8");
    response_.set(http::field::cache_control, "no-store");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.keep_alive(false);
    response_.body() = std::move(text);
    response_.prepare_payload();
    stream_.expires_after(10s);
    http::async_write(stream_, response_, [self = shared_from_this()](beast::error_code, std::size_t) {
      beast::error_code ignored;
      self->stream_.socket().shutdown(boost::asio::ip::tcp::socket::shutdown_send, ignored);
    });
  }

 private:
  void open() {
    parser_->get().body().close();
    uploads_.wait();  // of the one before, which has posted its answer
    uploads_.reader_ = std::thread([self = shared_from_this(), &context = uploads_.context_]() mutable {
      std::string refused;
      try {
        self->uploads_.hub_.open(self->file_, self->name_, self->as_);
      } catch (const std::bad_alloc&) {
        refused = self->name_ + ": does not fit into the memory of this program";
      } catch (const std::exception& e) {
        refused = e.what();
      }
      self->folder_.reset();
      boost::asio::post(context, [self = std::move(self), refused = std::move(refused)] {
        if (!refused.empty()) self->uploads_.hub_.report("refused: " + refused);
        self->answer(refused.empty() ? http::status::ok : http::status::unprocessable_entity,
                     refused.empty() ? "opened " + self->name_ : refused);
      });
    });
  }

  Uploads& uploads_;
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::file_body>> parser_;
  http::response<http::string_body> response_;
  std::optional<io::TemporaryFolder> folder_;
  fs::path file_;
  std::string name_;
  Opened as_ = Opened::compared;
  bool owner_ = false;
};

bool Uploads::is_one(const Request& request) {
  const std::string_view target(request.target().data(), request.target().size());
  return request.method() == http::verb::post && (target == kPlayed || target == kCompared);
}

void Uploads::take(beast::tcp_stream stream, beast::flat_buffer buffer, Parser& header, bool allowed) {
  const bool large = header.content_length().value_or(0) > largest_;
  const auto session = std::make_shared<Session>(*this, std::move(stream), std::move(buffer), header);
  if (!allowed) {
    session->answer(http::status::forbidden, "this needs the token that the monitor printed at its start");
  } else if (large) {
    session->too_large();
  } else if (busy_) {
    session->answer(http::status::service_unavailable, "another recording is being opened; try again when it is there");
  } else {
    session->receive();
  }
}

void Uploads::wait() {
  if (reader_.joinable()) reader_.join();
}

}  // namespace whirl::monitor
