// What the hub says and is told, as JSON: description of the stream, status, commands.
#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "whirl/core/error.hpp"
#include "whirl/monitor/hub.hpp"
#include "whirl/report/format.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using json = nlohmann::json;

constexpr std::size_t kLongestMarker = 200;  // characters
constexpr std::size_t kHistory = 200;        // lines

/// Names come from files: bytes that are no UTF-8 are replaced, not thrown about.
std::string dump(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

std::string_view name(Averaging a) {
  return a == Averaging::linear ? "linear" : a == Averaging::exponential ? "exponential" : "peak hold";
}
std::string_view name(signal::Window w) {
  return w == signal::Window::hann ? "hann" : w == signal::Window::flat_top ? "flat top" : "rectangular";
}

template <class T>
T choose(const json& value, std::string_view field, std::initializer_list<T> choices) {
  std::string allowed;
  for (const T choice : choices) {
    if (value == name(choice)) return choice;
    allowed += (allowed.empty() ? "" : ", ") + std::string(name(choice));
  }
  throw Error::in_field(field, value.dump(), allowed);
}

SpectrumSettings read_settings(SpectrumSettings s, const json& j) {
  if (j.contains("block")) s.block = j.at("block").get<Index>();
  if (j.contains("averages")) s.averages = j.at("averages").get<int>();
  if (j.contains("averaging")) {
    s.averaging =
        choose(j.at("averaging"), "averaging", {Averaging::linear, Averaging::exponential, Averaging::peak_hold});
  }
  if (j.contains("window")) {
    s.window =
        choose(j.at("window"), "window", {signal::Window::hann, signal::Window::flat_top, signal::Window::rectangular});
  }
  return s;
}

/// Text of a user as one line of the log.
std::string one_line(std::string text) {
  if (text.size() > kLongestMarker) text.resize(kLongestMarker);
  for (char& c : text) {
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = ' ';
  }
  return text;
}

json controls_json(const FrameSource& source) {
  json out = json::array();
  for (const Control& c : source.controls()) {
    json control{{"name", c.name}};
    if (c.takes_value) control.update({{"low", c.low}, {"high", c.high}, {"value", c.value}, {"unit", c.unit}});
    out.push_back(std::move(control));
  }
  return out;
}

json reference_json(const Reference& r) {
  const auto list = [](const Eigen::VectorXd& v) { return std::vector<double>(v.begin(), v.end()); };
  json amplitude = json::object(), phase = json::object();
  for (std::size_t k = 0; k < r.channels.size(); ++k) {
    amplitude[r.channels[k]] = list(r.amplitude.col(static_cast<Index>(k)));
    if (r.phase.size() > 0) phase[r.channels[k]] = list(r.phase.col(static_cast<Index>(k)));
  }
  return {
      {"name", r.name}, {"speed", list(r.speed)}, {"time", list(r.time)}, {"amplitude", amplitude}, {"phase", phase}};
}

/// Counts per octave of nanoseconds.
json histogram_json(const std::string& what, const rt::Histogram& h) {
  json octaves = json::array();
  for (int k = 0; k < 40; ++k) {
    if (const std::uint64_t n = h.in_octave(k); n > 0) octaves.push_back({std::ldexp(1e-9, k), n});
  }
  return {{"name", what},
          {"total", h.total()},
          {"p50", h.quantile(0.5)},
          {"p99", h.quantile(0.99)},
          {"p999", h.quantile(0.999)},
          {"max", h.max()},
          {"octaves", octaves}};
}

}  // namespace

void Hub::submit(std::string text) {
  const json request = json::parse(text, nullptr, false);
  Asked asked{std::move(text)};
  std::shared_ptr<FrameSource> source;
  {
    const std::lock_guard lock(mutex_);
    source = source_;
  }
  if (request.is_object() && request.contains("command") && request["command"].is_string() &&
      source->urgent(request["command"].get<std::string>())) {
    asked.kind = Asked::done;
  }
  const std::lock_guard lock(mutex_);
  asked_.push_back(std::move(asked));
}

void Hub::report(std::string line) {
  const std::lock_guard lock(mutex_);
  asked_.push_back({std::move(line), Asked::line});
}

std::string Hub::description() const {
  const std::lock_guard lock(mutex_);
  const StreamInfo& info = source_->info();
  json channels = json::array();
  for (const ChannelInfo& c : info.channels) {
    channels.push_back({{"name", c.name}, {"quantity", to_string(c.quantity)}, {"unit", si_unit(c.quantity)}});
  }
  json tracked = json::array(), orbit = json::array();
  for (const Index c : tracked_)
    (synchronous_ ? tracked : orbit).push_back(info.channels[static_cast<std::size_t>(c)].name);
  if (synchronous_) orbit = tracked;
  json out{{"type", "stream"},
           {"name", info.name},
           {"opened", streams_},
           {"opens", {{"play", takes(Opened::played)}, {"compare", takes(Opened::compared)}}},
           {"rate", info.rate},
           {"channels", channels},
           {"orbit", orbit},
           {"tracked", tracked},
           {"recording_allowed", !options_.recorder.folder.empty()},
           {"controls", json::parse(controls_)}};
  if (options_.reference) out["reference"] = reference_json(*options_.reference);
  const SpectrumSettings& s = options_.spectrum;
  out["spectrum"] = {{"block", s.block},         {"spacing_hz", info.rate / static_cast<double>(s.block)},
                     {"window", name(s.window)}, {"averaging", name(s.averaging)},
                     {"averages", s.averages},   {"amplitude", "peak"},
                     {"overlap", s.overlap}};
  return dump(out);
}

std::string Hub::controls_of(const FrameSource& source) { return dump(controls_json(source)); }

void Hub::publish_status() {
  json items = json::array();
  for (const auto& [key, value] : source_->status()) items.push_back({key, value});
  json limits = json::array();
  for (const LimitWatch::State& l : limits_.states()) {
    limits.push_back({{"channel", source_->info().channels[static_cast<std::size_t>(l.channel)].name},
                      {"limit", l.limit},
                      {"largest", l.largest},
                      {"crossings", l.crossings},
                      {"over", l.over}});
  }
  json times = json::array();
  for (const Times& t : times_) times.push_back(histogram_json(t.name, t.histogram));
  json status{{"type", "status"},
              {"time", last_time_},
              {"items", items},
              {"trend", name(trend_.trend())},
              {"limits", limits},
              {"times", times},
              {"averages", spectrum_.count()},
              {"blocks_skipped", spectrum_.skipped()},
              {"blocks_bridged", spectrum_.bridged()},
              {"recording", recorder_.active()},
              {"record_samples", recorder_.samples()},
              {"record_lost", recorder_.lost()},
              {"record_folder", recorder_.folder().string()},
              {"log", log_}};
  const MessagePtr message = std::make_shared<Message>(Message{dump(status), true});
  const std::lock_guard lock(mutex_);
  for (std::string& line : log_) history_.push_back(std::move(line));
  while (history_.size() > kHistory) history_.pop_front();
  log_.clear();
  for (const auto& client : clients_) {
    client->push(message);
    // Events that the client missed: the whole log takes the place of what it shows.
    if (client->take_text_lost()) client->push(history());
  }
}

MessagePtr Hub::history() const {
  return std::make_shared<Message>(Message{dump({{"type", "history"}, {"log", history_}}), true});
}

void Hub::execute(const std::string& text, bool done) {
  try {
    const json request = json::parse(text);
    const std::string command = request.at("command").get<std::string>();
    const double value = request.value("value", 0.0);
    if (done) {
      note("command: " + command);
    } else if (command == "record") {
      if (value != 0) {
        recorder_.start(source_->info(), description());
        note("record started: " + recorder_.folder().string());
      } else {
        const bool active = recorder_.active();
        if (active) note("record stopped by the user");
        recorder_.stop("by the user");
        if (active)
          note(fmt::format("{}: {} samples, {} lost", recorder_.folder().string(), recorder_.samples(),
                           recorder_.lost()));
      }
    } else if (command == "reset") {
      spectrum_.reset();
      limits_.reset();
      for (Times& t : times_) t.histogram = {};
      if (synchronous_) synchronous_->reset();
      note("averages, extremes and histograms reset");
    } else if (command == "marker") {
      note("marker: " + one_line(request.value("text", std::string())));
    } else if (command == "limit") {
      const std::string channel = request.at("channel").get<std::string>();
      limits_.set(channel, value);
      note(fmt::format("limit of {} set to {:g} (SI)", channel, value));
    } else if (command == "spectrum") {
      const SpectrumSettings settings = read_settings(options_.spectrum, request);
      spectrum_ = make_spectrum(settings);
      {
        const std::lock_guard lock(mutex_);
        options_.spectrum = settings;
      }
      publish(std::make_shared<Message>(Message{description(), true}));
      note(fmt::format("spectrum: block {}, {} window, {} average of {}", settings.block, name(settings.window),
                       name(settings.averaging), settings.averages));
    } else if (source_->command(command, value)) {
      note(request.contains("value") ? fmt::format("{} {:g}", command, value) : "command: " + command);
    } else {
      note("refused: unknown command '" + one_line(command) + "'");
    }
  } catch (const Error& e) {
    note(std::string("refused: ") + e.what());
  } catch (const json::exception&) {
    note("refused: not a valid command");
  }
}

}  // namespace whirl::monitor
