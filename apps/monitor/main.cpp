#include <CLI/CLI.hpp>
#include <csignal>
#include <iostream>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/monitor/server.hpp"

namespace {
volatile std::sig_atomic_t stopped = 0;
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
  CLI11_PARSE(app, argc, argv);
  try {
    if (rate > 0) csv.rate = rate;
    hub_options.recorder.folder = record_folder;
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
