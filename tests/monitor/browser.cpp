#include "browser.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>

#include "whirl/testing/loop/await.hpp"

namespace whirl::testing {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using nlohmann::json;
using std::chrono_literals::operator""ms;
using std::chrono_literals::operator""s;

std::string decode_base64(const std::string& text) {
  std::string out;
  unsigned bits = 0;
  int have = 0;
  for (const char c : text) {
    const int v = c >= 'A' && c <= 'Z'   ? c - 'A'
                  : c >= 'a' && c <= 'z' ? c - 'a' + 26
                  : c >= '0' && c <= '9' ? c - '0' + 52
                  : c == '+'             ? 62
                  : c == '/'             ? 63
                                         : -1;
    if (v < 0) break;
    bits = bits << 6 | static_cast<unsigned>(v);
    if ((have += 6) >= 8) out += static_cast<char>(bits >> (have -= 8) & 0xFF);
  }
  return out;
}

}  // namespace

/// The browser and the connection to it.
struct Browser::Process {
  explicit Process(const std::filesystem::path& folder, int width, int height) {
    const std::string data = "--user-data-dir=" + (folder / "browser").string();
    const std::string size = "--window-size=" + std::to_string(width) + "," + std::to_string(height);
    const std::string name = program().string();
    pid = fork();
    if (pid == 0) {
      setpgid(0, 0);  // its helpers end with it
      const int null = ::open("/dev/null", O_RDWR | O_CLOEXEC);
      for (const int fd : {0, 1, 2}) dup2(null, fd);
      execl(name.c_str(), name.c_str(), "--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage",
            "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync",
            "--disable-extensions", "--hide-scrollbars", "--remote-debugging-port=0", data.c_str(), size.c_str(),
            "about:blank", static_cast<char*>(nullptr));
      _exit(127);
    }
    watchdog = std::jthread([this](std::stop_token stop) {
      std::unique_lock lock(mutex);
      for (int seen = -1; seen != calls && !stop.stop_requested();) {
        seen = calls;
        over.wait_for(lock, stop, 120s, [] { return false; });
      }
      if (!stop.stop_requested()) kill(-pid, SIGKILL);
    });
    const std::filesystem::path port_file = folder / "browser" / "DevToolsActivePort";
    std::string port, path;
    const auto written = [&] {
      std::ifstream in(port_file);
      return static_cast<bool>(in >> port >> path);
    };
    if (!await(written)) throw std::runtime_error("the browser does not answer");
    socket.next_layer().connect({asio::ip::make_address("127.0.0.1"), static_cast<std::uint16_t>(std::stoi(port))});
    socket.read_message_max(std::size_t{1} << 28);
    socket.handshake("127.0.0.1:" + port, path);
  }
  ~Process() {
    watchdog.request_stop();
    kill(-pid, SIGKILL);
    waitpid(pid, nullptr, 0);
  }

  pid_t pid = -1;
  std::atomic<int> calls{0};
  std::mutex mutex;
  std::condition_variable_any over;
  std::jthread watchdog;
  asio::io_context context;
  beast::websocket::stream<asio::ip::tcp::socket> socket{context};
};

std::filesystem::path Browser::program() {
  for (const char* name : {"/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"}) {
    if (std::filesystem::exists(name)) return name;
  }
  return {};
}

Browser::Browser(const std::filesystem::path& folder, int width, int height)
    : process_(std::make_unique<Process>(folder, width, height)) {
  const std::string target = call("Target.createTarget", {{"url", "about:blank"}})["targetId"];
  session_ = call("Target.attachToTarget", {{"targetId", target}, {"flatten", true}})["sessionId"];
  for (const char* part : {"Page", "Runtime", "Network", "Log"}) call(std::string(part) + ".enable");
}

Browser::~Browser() = default;

void Browser::note(const json& event) {
  const std::string method = event.value("method", "");
  if (event.value("sessionId", "") != session_ || session_.empty()) return;
  const json& p = event["params"];
  if (method == "Network.requestWillBeSent") requests_.push_back(p["request"]["url"]);
  if (method == "Network.webSocketCreated") requests_.push_back(p["url"]);
  if (method == "Runtime.exceptionThrown") complaints_.push_back(p["exceptionDetails"].dump());
  if (method == "Log.entryAdded" && p["entry"]["level"] == "error") complaints_.push_back(p["entry"].dump());
  if (method == "Runtime.consoleAPICalled" && p["type"] == "error") complaints_.push_back(p["args"].dump());
}

json Browser::call(const std::string& method, const json& parameters) {
  json request{{"id", next_++}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) request["sessionId"] = session_;
  ++process_->calls;
  process_->socket.write(asio::buffer(request.dump()));
  while (true) {
    beast::flat_buffer buffer;
    process_->socket.read(buffer);
    const json answer = json::parse(beast::buffers_to_string(buffer.data()));
    if (!answer.contains("id")) {
      note(answer);
      continue;
    }
    if (answer["id"] != request["id"]) continue;
    if (answer.contains("error")) throw std::runtime_error(method + ": " + answer["error"].dump());
    return answer["result"];
  }
}

void Browser::open(const std::string& url) {
  requests_.clear();
  complaints_.clear();
  call("Page.navigate", {{"url", url}});
}

json Browser::evaluate(const std::string& expression) {
  const json answer =
      call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}, {"awaitPromise", true}});
  if (answer.contains("exceptionDetails"))
    throw std::runtime_error(expression + ": " + answer["exceptionDetails"].dump());
  return answer["result"].contains("value") ? answer["result"]["value"] : json();
}

bool Browser::wait(const std::string& expression) {
  // A page that is still loading has not all its elements.
  const std::string careful = "(() => { try { return Boolean(" + expression + "); } catch { return false; } })()";
  return await([&] { return evaluate(careful) == true; });
}

void Browser::key(const std::string& key) {
  for (const char* type : {"keyDown", "keyUp"}) {
    json event{{"type", type}, {"key", key}};
    if (key.size() == 1 && std::string(type) == "keyDown") event["text"] = key;
    call("Input.dispatchKeyEvent", event);
  }
}

void Browser::click(const std::string& selector) {
  // A live page moves: the element may be elsewhere by the time the button goes down. Then it is clicked again, as a
  // user would.
  evaluate("{ const e = document.querySelector('" + selector +
           "'); e.clicked = false; e.addEventListener('click', () => { e.clicked = true; }, {once: true, capture: "
           "true}); }");
  for (int attempt = 0; attempt < 20; ++attempt) {
    const json at =
        evaluate("(() => { const e = document.querySelector('" + selector +
                 "'); e.scrollIntoView({block: 'center'}); const r = e.getBoundingClientRect(); return [r.x "
                 "+ r.width / 2, r.y + r.height / 2]; })()");
    for (const char* type : {"mousePressed", "mouseReleased"}) {
      call("Input.dispatchMouseEvent",
           {{"type", type}, {"x", at[0]}, {"y", at[1]}, {"button", "left"}, {"clickCount", 1}});
    }
    // An element that the click took away was hit.
    if (evaluate("(document.querySelector('" + selector + "') || {clicked: true}).clicked !== false") == true) return;
  }
  throw std::runtime_error("no click reaches " + selector);
}

void Browser::dark(bool on) {
  call("Emulation.setEmulatedMedia",
       {{"features", {{{"name", "prefers-color-scheme"}, {"value", on ? "dark" : "light"}}}}});
}

void Browser::on_paper(int width) {
  call("Emulation.setEmulatedMedia", {{"media", "print"}});
  resize(width, 1000, false);
}

void Browser::resize(int width, int height, bool touch) {
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", touch}});
  call("Emulation.setTouchEmulationEnabled", {{"enabled", touch}});
}

void Browser::screenshot(const std::filesystem::path& file) {
  const std::string data = call("Page.captureScreenshot", {{"format", "png"}})["data"];
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << decode_base64(data);
}

}  // namespace whirl::testing
