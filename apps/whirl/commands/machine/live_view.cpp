#include "live_view.hpp"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "stop_signal.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/signals.hpp"

namespace whirl::app {
Recording read_opened(const std::filesystem::path& file,
                      const std::function<Recording(const std::filesystem::path&)>& read) {
  if (io::file_format(file) == io::FileFormat::atfx)
    throw Error::in_file(file.string(), 0,
                         "an ATFX file refers to others, which a page cannot send; name it on the command line");
  return read(file);
}

void ViewOptions::add_to(CommandLine* sub) {
  sub->section("Live view");
  sub->add_option("--port", port, "of the page; 0 takes any free one")->range(0, 65535)->show_default();
  sub->add_option("--address", address, "to serve at; anything but loopback shows the data to the network")
      ->show_default();
  sub->add_option("--record-folder", record_folder, "allow the page to record into this folder")->output_folder();
  sub->add_option("--reference", reference,
                  "record of another run, e.g. the open loop, whose 1X amplitude is drawn behind")
      ->input();
  sub->add_option("--limit", limits,
                  "largest value of a channel, with its unit, e.g. x_mm=0.5; crossings go to the log");
  sub->add_flag("--read-only", read_only, "the page shows and commands nothing");
  sub->section();
}

monitor::HubOptions ViewOptions::hub(double rate) const {
  monitor::HubOptions options;
  options.spectrum.block = monitor::block_for(rate);
  options.recorder.folder = record_folder;
  for (const std::string& text : limits) options.limits.insert(monitor::read_limit(text));
  if (!read_only)
    options.read = [](const std::filesystem::path& file) {
      return read_opened(file, [](const std::filesystem::path& f) { return io::read_recording(f); });
    };
  if (!reference.empty()) options.reference = monitor::reference_of(io::read_recording(reference));
  return options;
}

monitor::ServerOptions ViewOptions::server() const {
  monitor::ServerOptions options;
  options.address = address;
  options.port = static_cast<std::uint16_t>(port);
  if (!read_only) options.token = monitor::make_token();
  return options;
}

Served::Served(const ViewOptions& options, std::unique_ptr<monitor::FrameSource> source, const monitor::HubOptions& hub)
    : hub_(std::move(source), hub), server_(hub_, options.server()) {
  hub_.start();
  server_.start();
  fmt::print(stderr, "whirl: open {}  (Ctrl-C ends)\n", server_.url());
}

Served::~Served() {
  server_.stop();
  hub_.stop();
}

void Served::until_stopped() const {
  while (stop_signal() == 0) std::this_thread::sleep_for(std::chrono::milliseconds(50));
}

LiveView::LiveView(const ViewOptions& options, const monitor::LoopView::About& about,
                   const std::optional<monitor::Reference>& reference)
    : LoopView({about.name, about.rate, about.force_limit, !options.read_only}) {
  monitor::HubOptions hub = options.hub(about.rate);
  if (!hub.reference) hub.reference = reference;
  served_.emplace(options, source(), hub);
}

}  // namespace whirl::app
