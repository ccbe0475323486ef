// What the live view costs a loop: SECONDS of a loop at 10 kHz with 16 channels, alone and with 8 pages that read, one
// of them slowly. Usage: bench_monitor_load [seconds]
#include <fmt/format.h>

#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <optional>
#include <thread>
#include <vector>

#include "monitor_stream.hpp"
#include "whirl/monitor/server.hpp"

namespace {

using namespace whirl;
namespace beast = boost::beast;
using tcp = boost::asio::ip::tcp;

constexpr int kPages = 8;

double resident_megabytes() {
  std::ifstream in("/proc/self/statm");
  long pages = 0, resident = 0;
  in >> pages >> resident;
  return static_cast<double>(resident) * 4096e-6;
}

struct Page {
  std::atomic<long> frames{0}, missed{0}, bytes{0};
};

/// Reads frames until the server ends; a slow page rests between them.
void read_page(std::uint16_t port, std::chrono::milliseconds rest, Page& page) {
  boost::asio::io_context context;
  beast::websocket::stream<tcp::socket> stream(context);
  stream.next_layer().open(tcp::v4());
  if (rest.count() > 0) stream.next_layer().set_option(boost::asio::socket_base::receive_buffer_size(65536));
  stream.next_layer().connect({boost::asio::ip::make_address("127.0.0.1"), port});
  stream.handshake("127.0.0.1:" + std::to_string(port), "/stream");
  std::optional<std::uint32_t> next;
  beast::error_code failed;
  while (true) {
    beast::flat_buffer buffer;
    stream.read(buffer, failed);
    if (failed) return;
    page.bytes += static_cast<long>(buffer.size());
    if (stream.got_text()) continue;
    const monitor::FrameHeader h = monitor::decode_frame(beast::buffers_to_string(buffer.data()));
    if (next && h.seq > *next) page.missed += h.seq - *next;
    next = h.seq + 1;
    if (h.kind == monitor::FrameKind::samples) ++page.frames;
    std::this_thread::sleep_for(rest);
  }
}

void print(const char* what, const rt::LoopTiming& t) {
  fmt::print(
      "{:<12} {} cycles, {} ticks left out ({} late by work, {} by wake-up); latency p50 {:.0f} p99 {:.0f} p99.9 "
      "{:.0f} max {:.0f} us; "
      "execution p99.9 {:.1f} max {:.0f} us\n",
      what, t.executed, t.missed, t.late_work, t.late_wake, 1e6 * t.latency.quantile(0.5),
      1e6 * t.latency.quantile(0.99), 1e6 * t.latency.quantile(0.999), 1e6 * t.latency.max(),
      1e6 * t.execution.quantile(0.999), 1e6 * t.execution.max());
}

}  // namespace

int main(int argc, char** argv) {
  const double seconds = argc > 1 ? std::atof(argv[1]) : 20;
  rt::LoopTiming alone, watched;
  std::thread([&] { alone = bench::loop(seconds, nullptr); }).join();
  print("alone", alone);

  bench::Served served;
  std::vector<std::unique_ptr<Page>> pages;
  std::vector<std::thread> readers;
  for (int i = 0; i < kPages; ++i) {
    pages.push_back(std::make_unique<Page>());
    readers.emplace_back(read_page, served.server->port(), std::chrono::milliseconds(i == kPages - 1 ? 200 : 0),
                         std::ref(*pages.back()));
  }
  std::thread runner([&] { watched = bench::loop(seconds, &served.ring); });
  // From here on the memory is locked: what is mapped is resident.
  std::this_thread::sleep_for(std::chrono::duration<double>(0.2 * seconds));
  const double before = resident_megabytes();
  std::this_thread::sleep_for(std::chrono::duration<double>(0.75 * seconds));
  const double after = resident_megabytes();
  runner.join();
  print("8 pages", watched);
  fmt::print("rows refused by the ring {}; resident memory {:.1f} MB after a fifth of the time, {:.1f} MB at the end\n",
             served.ring.dropped(), before, after);
  served.stop();
  for (std::thread& reader : readers) reader.join();
  for (std::size_t i = 0; i < pages.size(); ++i) {
    fmt::print("page {}: {:.1f} frames of samples per second, {} frames missed, {:.2f} MB/s{}\n", i + 1,
               static_cast<double>(pages[i]->frames) / seconds, pages[i]->missed.load(),
               1e-6 * static_cast<double>(pages[i]->bytes) / seconds, i + 1 == pages.size() ? " (slow)" : "");
  }
  return 0;
}
