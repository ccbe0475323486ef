#include "whirl/monitor/loop_view.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <mutex>
#include <vector>

#include "whirl/control/supervisor.hpp"
#include "whirl/core/control_types.hpp"
#include "whirl/core/error.hpp"
#include "whirl/monitor/loop_columns.hpp"
#include "whirl/rt/realtime.hpp"

namespace whirl::monitor {

struct LoopView::State {
  explicit State(const About& about) : force_limit(about.force_limit), attended(about.attended) {
    info = {about.name, about.rate, {}};
    for (const auto& [name, quantity] : kLoopColumns) info.channels.push_back({std::string(name), quantity});
  }

  StreamInfo info;
  const double force_limit;
  const bool attended;
  SampleRing ring{kLoopColumns.size(), 1 << 15};
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

class LoopView::State::Source : public RingSource {
 public:
  Source(StreamInfo info, State& state) : RingSource(std::move(info), state.ring), state_(state) {}

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
  std::vector<Control> controls() const override {
    if (!state_.attended) return {};
    std::vector<Control> out{{.name = "trip"}, {.name = "disarm"}, {.name = "arm"}, {.name = "clear"}};
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

void LoopView::State::changes(const rt::LoopSample& s) {
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

LoopView::LoopView(const About& about) : state_(std::make_unique<State>(about)) {}

LoopView::~LoopView() = default;

std::unique_ptr<FrameSource> LoopView::source() { return std::make_unique<State::Source>(state_->info, *state_); }

rt::LoopControl* LoopView::control() { return state_->attended ? &state_->control : nullptr; }

void LoopView::take(const rt::LoopSample& s) {
  State& state = *state_;
  state.changes(s);
  state.flags = s.flags;
  state.trip = s.trip;
  state.missed += s.missed;
  state.lost += (s.flags & rt::kValid) == 0;
  const LoopRow row = loop_row(s, state.previous);
  state.previous = s.started;
  state.ring.push(static_cast<std::uint64_t>(s.tick), row.data());
}

void LoopView::note(const std::string& line) { state_->happened(line); }

void LoopView::ended(const std::string& reason) {
  state_->over = true;
  state_->happened("the run has ended: " + reason);
}

}  // namespace whirl::monitor
