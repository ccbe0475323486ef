#include <CLI/CLI.hpp>
#include <charconv>
#include <csignal>
#include <iostream>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/units.hpp"
#include "whirl/monitor/server.hpp"

namespace {
volatile std::sig_atomic_t stopped = 0;

/// "x_mm=0.5" -> x, 0.5e-3.
std::pair<std::string, double> read_limit(const std::string& text) {
  const std::size_t equals = text.find('=');
  const whirl::NameWithUnit name = whirl::split_unit(text.substr(0, equals));
  double value = 0;
  const char* begin = text.data() + (equals == std::string::npos ? text.size() : equals + 1);
  const char* end = text.data() + text.size();
  if (name.unit == nullptr || begin == end || std::from_chars(begin, end, value).ptr != end) {
    throw whirl::Error::in_field("--limit", text, "a channel with its unit and a number, e.g. x_mm=0.5");
  }
  return {name.name, name.unit->to_si(value)};
}
}

int main(int argc, char** argv) {
  CLI::App app("Live view of rotor vibration in a browser: plays a record as if it were measured now.");
  std::string file;
  double speed = 1;
  bool loop = false, read_only = false;
  whirl::CsvOptions csv;
  double rate = 0;
  whirl::monitor::HubOptions hub_options;
  whirl::monitor::ServerOptions server_options;
  std::string record_folder;
  app.add_option("record", file, "CSV file with a header such as t_s,x_mm,y_mm,beta_rad")->required()->check(CLI::ExistingFile);
  app.add_option("--speed", speed, "times as fast as recorded, 0.01 to 10000")->capture_default_str();
  app.add_flag("--loop", loop, "start again at the end");
  app.add_option("--rate_hz", rate, "sample rate of a file without a time column");
  app.add_option("--port", server_options.port, "0 takes any free port")->capture_default_str();
  app.add_option("--address", server_options.address, "address to serve at; anything but loopback shows the data to the network")
      ->capture_default_str();
  app.add_option("--record-folder", record_folder, "allow recording into this folder");
  app.add_flag("--read-only", read_only, "no commands at all");
  std::vector<std::string> limits;
  app.add_option("--limit", limits, "largest value of a channel, with its unit, e.g. x_mm=0.5; crossings go to the log");
  CLI11_PARSE(app, argc, argv);
  try {
    if (rate > 0) csv.rate = rate;
    hub_options.recorder.folder = record_folder;
    for (const std::string& text : limits) hub_options.limits.insert(read_limit(text));
    if (!read_only) server_options.token = whirl::monitor::make_token();
    whirl::monitor::Hub hub(
        std::make_unique<whirl::monitor::PlaybackSource>(whirl::read_csv(file, csv), speed, loop), hub_options);
    whirl::monitor::Server server(hub, server_options);
    std::signal(SIGINT, [](int) { stopped = 1; });
    std::signal(SIGTERM, [](int) { stopped = 1; });
    hub.start();
    server.start();
    std::cout << "open " << server.url() << "  (Ctrl-C ends)" << std::endl;
    while (stopped == 0) std::this_thread::sleep_for(std::chrono::milliseconds(100));
    server.stop();
    hub.stop();
    return 0;
  } catch (const whirl::Error& e) {
    std::cerr << "whirl-monitor: " << e.what() << '\n';
    return 2;
  }
}
