// What a browser shows of 16 channels at 10 kHz: pictures per second of one page in a headless Chromium that draws
// without a graphics processor. Usage: bench_monitor_page [seconds per view] [folder for pictures]
#include <fmt/format.h>

#include <cstdlib>
#include <filesystem>
#include <thread>

#include "../../tests/monitor/browser.hpp"
#include "monitor_stream.hpp"
#include "whirl/monitor/server.hpp"

int main(int argc, char** argv) {
  using namespace whirl;
  using testing::Browser;
  if (Browser::program().empty()) {
    fmt::print("no Chromium here\n");
    return 0;
  }
  const double seconds = argc > 1 ? std::atof(argv[1]) : 15;
  struct View {
    const char* what;
    int width, height;
  };
  const View views[] = {{"a screen", 1400, 900}, {"every panel at once", 1400, 2200}, {"a tablet", 820, 1180}};

  bench::Served served;
  const std::uint16_t port = served.server->port();
  std::thread runner([&] { bench::loop(std::size(views) * (seconds + 15), &served.ring); });
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / fmt::format("whirl-page-{}", port);
  const auto said = [](Browser& browser) {
    return browser
        .evaluate(
            "document.getElementById('rate').textContent + '; ' + [...document.querySelectorAll('#status dt')]"
            ".filter((t) => t.textContent.startsWith('frames')).map((t) => `${t.textContent}: "
            "${t.nextSibling.textContent}`).join('; ')")
        .get<std::string>();
  };
  for (const View& view : views) {
    Browser browser(folder / std::to_string(view.height), view.width, view.height);
    browser.open(fmt::format("http://127.0.0.1:{}/", port));
    std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
    // The page counts itself, each second anew.
    fmt::print("{} ({} x {}): {}\n", view.what, view.width, view.height, said(browser));
    if (argc > 2)
      browser.screenshot(std::filesystem::path(argv[2]) / fmt::format("page-{}x{}.png", view.width, view.height));
    if (&view != std::end(views) - 1) continue;
    browser.evaluate("(() => { const end = performance.now() + 1e4; while (performance.now() < end); })()");
    std::this_thread::sleep_for(std::chrono::seconds(3));
    fmt::print("after it stood still for 10 s: {}\n", said(browser));
  }
  runner.join();
  std::filesystem::remove_all(folder);
  return 0;
}
