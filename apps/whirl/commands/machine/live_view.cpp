#include "live_view.hpp"

#include <fmt/format.h>

#include <atomic>
#include <charconv>
#include <chrono>
#include <mutex>
#include <thread>

#include "live_columns.hpp"
#include "stop_signal.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/units.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::app {
namespace {

/// "x_mm=0.5" -> x, 0.5e-3.
std::pair<std::string, double> read_limit(const std::string& text) {
  const std::size_t equals = text.find('=');
  const io::NameWithUnit name = io::split_unit(text.substr(0, equals));
  double value = 0;
  const char* begin = text.data() + (equals == std::string::npos ? text.size() : equals + 1);
  const char* end = text.data() + text.size();
  if (name.unit == nullptr || begin == end || std::from_chars(begin, end, value) != std::from_chars_result{end, {}}) {
    throw Error::in_field("--limit", text, "a channel with its unit and a number, e.g. x_mm=0.5");
  }
  return {name.name, name.unit->to_si(value)};
}

}  // namespace

Recording read_opened(const std::filesystem::path& file,
                      const std::function<Recording(const std::filesystem::path&)>& read) {
  if (io::file_format(file) == io::FileFormat::atfx)
    throw Error::in_file(file.string(), 0,
                         "an ATFX file refers to others, which a page cannot send; name it on the command line");
  return read(file);
}

void ViewOptions::add_to(CommandLine* sub) {
  sub->add_option("--port", port, "of the page; 0 takes any free one")
      ->range(0, 65535)
      ->show_default()
      ->group("Live view");
  sub->add_option("--address", address, "to serve at; anything but loopback shows the data to the network")
      ->show_default()
      ->group("Live view");
  sub->add_option("--record-folder", record_folder, "allow the page to record into this folder")
      ->output_folder()
      ->group("Live view");
  sub->add_option("--reference", reference,
                  "record of another run, e.g. the open loop, whose 1X amplitude is drawn behind")
      ->input()
      ->group("Live view");
  sub->add_option("--limit", limits,
                  "largest value of a channel, with its unit, e.g. x_mm=0.5; crossings go to the log")
      ->group("Live view");
  sub->add_flag("--read-only", read_only, "the page shows and commands nothing")->group("Live view");
}

monitor::HubOptions ViewOptions::hub(double rate) const {
  monitor::HubOptions options;
  options.spectrum.block = monitor::block_for(rate);
  options.recorder.folder = record_folder;
  for (const std::string& text : limits) options.limits.insert(read_limit(text));
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

struct LiveView::State {
  State(const About& about, bool has_token) : force_limit(about.force_limit), attended(has_token) {}

  const double force_limit;
  const bool attended;
  monitor::SampleRing ring{kLiveColumns.size(), 1 << 15};
  rt::LoopControl control;
  std::atomic<std::int32_t> flags{0}, trip{0};
  std::atomic<std::int64_t> missed{0}, lost{0};
  /// When a trip was asked for and, a moment later, stood where the loop looks; ns, 0: never.
  std::atomic<std::int64_t> commanded{0}, placed{0};
  std::atomic<bool> over{false};
  double previous = 0;
  long after_command = 0;  ///< cycles begun after a trip was asked for that the controller still had
  std::mutex mutex;
  std::vector<std::string> events;

  void happened(std::string line) {
    const std::lock_guard lock(mutex);
    events.push_back(std::move(line));
  }
  bool armed() const { return (flags & rt::kArmed) != 0; }
  bool tripped() const { return trip != 0 || control.tripped(); }
  void changes(const rt::LoopSample& s);

  /// What the page sees of the loop.
  class Source;
};

class LiveView::State::Source : public monitor::RingSource {
 public:
  Source(monitor::StreamInfo info, State& state) : RingSource(std::move(info), state.ring), state_(state) {}

  std::vector<std::pair<std::string, std::string>> status() const override {
    const auto fault = static_cast<Fault>(state_.trip.load());
    std::vector<std::pair<std::string, std::string>> items{
        {"state", state_.over            ? "ended"
                  : fault != Fault::none ? "tripped: " + std::string(to_string(fault))
                  : state_.tripped()     ? "tripped"
                  : state_.armed()       ? "armed"
                                         : "disarmed"},
        {"ticks left out", std::to_string(state_.missed.load())},
        {"samples without a valid reading", std::to_string(state_.lost.load())}};
    if (state_.force_limit > 0) {
      items.emplace_back("force limit",
                         fmt::format("{:g} N", std::min(state_.force_limit, state_.control.force_limit())));
    }
    for (auto& item : RingSource::status()) items.push_back(std::move(item));
    return items;
  }
  std::vector<monitor::Control> controls() const override {
    if (!state_.attended) return {};
    std::vector<monitor::Control> out{{.name = "trip"}, {.name = "disarm"}, {.name = "arm"}, {.name = "clear"}};
    const double limit = state_.force_limit;
    if (limit > 0)
      out.push_back({.name = "force_limit", .takes_value = true, .low = 0, .high = limit, .value = limit, .unit = "N"});
    return out;
  }
  bool urgent(const std::string& name) override {
    if (!state_.attended || (name != "trip" && name != "disarm")) return false;
    if (name == "disarm") {
      state_.control.disarm();
    } else {
      const bool first = !state_.control.tripped();
      if (first) state_.commanded = rt::WallTime{}.now();
      state_.control.trip();
      if (first) state_.placed = rt::WallTime{}.now();
    }
    return true;
  }
  bool command(const std::string& name, double value) override {
    const bool known = name == "arm" || name == "clear" || (name == "force_limit" && state_.force_limit > 0);
    if (!state_.attended || !known) return false;
    if (state_.over) throw Error(name + ": the run has ended");
    if (name == "arm") {
      if (state_.tripped()) throw Error("arm: a trip is latched; clear it first");
      state_.control.arm();
    } else if (name == "clear") {
      state_.commanded = state_.placed = 0;
      state_.control.clear();
    } else {
      require_range("force_limit", value, 0, state_.force_limit, "N");
      state_.control.set_force_limit(value);
    }
    return true;
  }
  std::vector<std::string> events() override {
    const std::lock_guard lock(state_.mutex);
    return std::exchange(state_.events, {});
  }

 private:
  State& state_;
};

void LiveView::State::changes(const rt::LoopSample& s) {
  const double asked = 1e-9 * static_cast<double>(commanded.load()), stood = 1e-9 * static_cast<double>(placed.load());
  if (stood > 0 && s.trip == 0 && s.started > stood && (s.flags & rt::kArmed) != 0) ++after_command;
  if (s.trip != 0 && trip == 0) {
    std::string line = fmt::format("trip at tick {}: {}", s.tick, to_string(static_cast<Fault>(s.trip)));
    if (asked > 0 && static_cast<Fault>(s.trip) == Fault::requested) {
      line += fmt::format(
          "; safe output from the cycle on that began {:.3f} ms after the command, {} controlled cycles between",
          1e3 * std::max(0.0, s.started - asked), after_command);
    }
    happened(std::move(line));
  }
  if (s.trip == 0 && trip != 0) {
    happened("trip cleared");
    after_command = 0;
  }
  if (((s.flags ^ flags) & rt::kArmed) != 0) happened((s.flags & rt::kArmed) != 0 ? "armed" : "disarmed");
  const auto word = [](std::int32_t f) { return static_cast<std::uint32_t>(f) >> rt::kSupervisionShift; };
  if (word(s.flags) != word(flags)) {
    happened(word(s.flags) != 0 ? "supervision: " + control::supervision_text(word(s.flags)) : "supervision: all well");
  }
}

LiveView::LiveView(const ViewOptions& options, const About& about)
    : state_(std::make_unique<State>(about, !options.read_only)) {
  monitor::StreamInfo info{about.name, about.rate, {}};
  for (const auto& [name, quantity] : kLiveColumns) info.channels.push_back({std::string(name), quantity});
  monitor::HubOptions hub = options.hub(about.rate);
  if (!hub.reference) hub.reference = about.reference;
  served_ = std::make_unique<Served>(options, std::make_unique<State::Source>(std::move(info), *state_), hub);
}

LiveView::~LiveView() = default;

rt::LoopControl* LiveView::control() { return state_->attended ? &state_->control : nullptr; }

void LiveView::take(const rt::LoopSample& s) {
  State& state = *state_;
  state.changes(s);
  state.flags = s.flags;
  state.trip = s.trip;
  state.missed += s.missed;
  state.lost += (s.flags & rt::kValid) == 0;
  const LiveRow row = live_row(s, state.previous);
  state.previous = s.started;
  state.ring.push(static_cast<std::uint64_t>(s.tick), row.data());
}

void LiveView::note(const std::string& line) { state_->happened(line); }

void LiveView::ended(const std::string& reason) {
  state_->over = true;
  state_->happened("the run has ended: " + reason);
}

}  // namespace whirl::app
