#include "whirl/monitor/hub.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "whirl/core/error.hpp"
#include "whirl/report/format.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using json = nlohmann::json;

constexpr double kBackBelow = 1;  ///< s without an excess that end it
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

/// Names come from files: bytes that are no UTF-8 are replaced, not thrown about.
std::string dump(const json& j) { return j.dump(-1, ' ', false, json::error_handler_t::replace); }

std::string_view name(Averaging a) {
  return a == Averaging::linear ? "linear" : a == Averaging::exponential ? "exponential" : "peak hold";
}
std::string_view name(Window w) {
  return w == Window::hann ? "hann" : w == Window::flat_top ? "flat top" : "rectangular";
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
    s.averaging = choose(j.at("averaging"), "averaging", {Averaging::linear, Averaging::exponential, Averaging::peak_hold});
  }
  if (j.contains("window")) {
    s.window = choose(j.at("window"), "window", {Window::hann, Window::flat_top, Window::rectangular});
  }
  return s;
}

/// Smallest and largest of each group of rows, alternating; NaN for a group without a finite value.
MatrixXd min_max_groups(const Eigen::Ref<const MatrixXd>& rows, Index group) {
  const Index groups = (rows.rows() + group - 1) / group;
  MatrixXd out(2 * groups, rows.cols());
  for (Index c = 0; c < rows.cols(); ++c) {
    for (Index g = 0; g < groups; ++g) {
      double low = kNaN, high = kNaN;
      for (Index i = g * group; i < std::min(rows.rows(), (g + 1) * group); ++i) {
        if (std::isnan(rows(i, c))) continue;
        if (!(rows(i, c) >= low)) low = rows(i, c);
        if (!(rows(i, c) <= high)) high = rows(i, c);
      }
      out(2 * g, c) = low;
      out(2 * g + 1, c) = high;
    }
  }
  return out;
}

/// Rows of one pass: what the fastest playback delivers per frame, and two seconds of a stream.
Index block_rows(const StreamInfo& info) {
  return static_cast<Index>(std::clamp(2 * info.rate, 4096.0, 65536.0));
}

}  // namespace

Hub::Hub(std::unique_ptr<FrameSource> source, const HubOptions& options)
    : source_(std::move(source)),
      options_(options),
      spectrum_(static_cast<Index>(source_->info().channels.size()), source_->info().rate, options.spectrum),
      recorder_(options.recorder),
      block_(block_rows(source_->info()), static_cast<Index>(source_->info().channels.size())) {
  require_range("frame_rate", options.frame_rate, 1, 60, "Hz");
  require_range("frame_groups", static_cast<double>(options.frame_groups), 16, 16384);
  const auto& channels = source_->info().channels;
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c].name == "beta") beta_ = static_cast<Index>(c);
    if (channels[c].quantity == Quantity::displacement) tracked_.push_back(static_cast<Index>(c));
  }
  for (const auto& [channel, limit] : options.limits) {
    const auto found = std::find_if(channels.begin(), channels.end(), [&](const ChannelInfo& c) { return c.name == channel; });
    if (found == channels.end()) throw Error::in_field("limit", channel, "the name of a channel of the stream");
    if (!(limit > 0)) throw Error::in_field("limit of " + channel, fmt::format("{:g}", limit), "positive");
    watches_.push_back({found - channels.begin(), limit});
  }
  if (beta_ >= 0 && !tracked_.empty()) synchronous_.emplace(static_cast<Index>(tracked_.size()), source_->info().rate);
}

void Hub::start() {
  if (running_.exchange(true)) return;
  thread_ = std::thread([this] {
    const auto period = std::chrono::duration_cast<std::chrono::steady_clock::duration>(
        std::chrono::duration<double>(1 / options_.frame_rate));
    auto next = std::chrono::steady_clock::now();
    while (running_) {
      step();
      next = std::max(next + period, std::chrono::steady_clock::now());
      std::this_thread::sleep_until(next);
    }
  });
}

void Hub::stop() {
  running_ = false;
  if (thread_.joinable()) thread_.join();
}

void Hub::add(const std::shared_ptr<ClientQueue>& client) {
  auto hello = std::make_shared<Message>(Message{description(), true});
  const std::lock_guard lock(mutex_);
  client->push(std::move(hello));
  clients_.push_back(client);
}

void Hub::remove(const std::shared_ptr<ClientQueue>& client) {
  const std::lock_guard lock(mutex_);
  std::erase(clients_, client);
}

void Hub::submit(std::string text) {
  const std::lock_guard lock(mutex_);
  commands_.push_back(std::move(text));
}

std::string Hub::description() const {
  const StreamInfo& info = source_->info();
  json channels = json::array();
  for (const ChannelInfo& c : info.channels) {
    json channel{{"name", c.name}, {"quantity", to_string(c.quantity)}, {"unit", si_unit(c.quantity)}};
    if (const auto limit = options_.limits.find(c.name); limit != options_.limits.end()) channel["limit"] = limit->second;
    channels.push_back(std::move(channel));
  }
  json tracked = json::array();
  for (const Index c : tracked_) tracked.push_back(info.channels[static_cast<std::size_t>(c)].name);
  const std::lock_guard lock(mutex_);
  const SpectrumSettings& s = options_.spectrum;
  return dump({{"type", "stream"},
              {"name", info.name},
              {"rate", info.rate},
              {"channels", channels},
              {"tracked", synchronous_ ? tracked : json::array()},
              {"recording_allowed", !options_.recorder.folder.empty()},
              {"spectrum",
               {{"block", s.block}, {"spacing_hz", info.rate / static_cast<double>(s.block)}, {"window", name(s.window)},
                {"averaging", name(s.averaging)}, {"averages", s.averages}, {"amplitude", "peak"},
                {"overlap", s.overlap}}}});
}

void Hub::publish(MessagePtr message) {
  const std::lock_guard lock(mutex_);
  for (const auto& client : clients_) client->push(message);
}

void Hub::publish_frame(FrameKind kind, unsigned log2_group, double t, const Eigen::Ref<const MatrixXd>& values) {
  publish(std::make_shared<Message>(Message{encode_frame(kind, log2_group, seq_++, t, values), false}));
}

void Hub::publish_samples(double t_first, const Eigen::Ref<const MatrixXd>& rows) {
  const auto groups = static_cast<std::uint64_t>(std::max<Index>(1, (rows.rows() + options_.frame_groups - 1) / options_.frame_groups));
  const auto log2_group = static_cast<unsigned>(std::bit_width(std::bit_ceil(groups)) - 1);
  if (log2_group == 0) return publish_frame(FrameKind::samples, 0, t_first, rows);
  const Index group = Index{1} << log2_group;
  publish_frame(FrameKind::min_max, log2_group, t_first, min_max_groups(rows, group));
  MatrixXd decimated((rows.rows() + group - 1) / group, rows.cols());
  for (Index g = 0; g < decimated.rows(); ++g) decimated.row(g) = rows.row(g * group);
  publish_frame(FrameKind::decimated, log2_group, t_first, decimated);
}

void Hub::publish_synchronous(double t_first, const Eigen::Ref<const MatrixXd>& rows) {
  if (!synchronous_) return;
  MatrixXd displacement(rows.rows(), static_cast<Index>(tracked_.size()));
  for (std::size_t k = 0; k < tracked_.size(); ++k) displacement.col(static_cast<Index>(k)) = rows.col(tracked_[k]);
  const auto turns = synchronous_->push(rows.col(beta_), displacement);
  if (turns.empty()) return;
  speed_ = turns.back().speed;
  MatrixXd values(static_cast<Index>(turns.size()), 1 + 2 * displacement.cols());
  for (Index i = 0; i < values.rows(); ++i) {
    const auto& turn = turns[static_cast<std::size_t>(i)];
    values(i, 0) = turn.speed;
    for (Index k = 0; k < displacement.cols(); ++k) {
      values(i, 1 + 2 * k) = turn.vector(k).real();
      values(i, 2 + 2 * k) = turn.vector(k).imag();
    }
  }
  publish_frame(FrameKind::synchronous, 0, t_first, values);
}

void Hub::step() {
  std::vector<std::string> commands;
  {
    const std::lock_guard lock(mutex_);
    commands.swap(commands_);
  }
  for (const std::string& command : commands) execute(command);

  double t_first = 0;
  if (const Index rows = source_->read(block_, t_first); rows > 0) {
    const auto fresh = block_.topRows(rows);
    last_time_ = t_first + static_cast<double>(rows) / source_->info().rate;
    const bool was_recording = recorder_.active();
    recorder_.write(t_first, fresh);
    if (was_recording && !recorder_.active()) note("record stopped: " + recorder_.stopped_because());
    publish_samples(t_first, fresh);
    publish_synchronous(t_first, fresh);
    watch_limits(t_first, fresh);
    if (spectrum_.push(fresh) > 0 && spectrum_.count() > 0) publish_frame(FrameKind::spectrum, 0, last_time_, spectrum_.amplitude());
  }
  if (steps_++ % std::max(1L, std::lround(options_.frame_rate / 2)) == 0 || !log_.empty()) publish_status();
}

void Hub::watch_limits(double t_first, const Eigen::Ref<const MatrixXd>& rows) {
  const double rate = source_->info().rate;
  const std::string speed = std::isfinite(speed_) ? fmt::format(" at {:.0f} rpm", speed_ * 30 / 3.141592653589793) : "";
  for (Watch& w : watches_) {
    const ChannelInfo& channel = source_->info().channels[static_cast<std::size_t>(w.channel)];
    for (Index i = 0; i < rows.rows(); ++i) {
      const double size = std::abs(rows(i, w.channel)), t = t_first + static_cast<double>(i) / rate;
      if (size > w.limit) {
        if (!w.over) {
          note(fmt::format("{} above its limit of {} since {:.3f} s{}", channel.name,
                           report::format_amplitude(w.limit, AmplitudeKind::peak, channel.quantity), t, speed));
        }
        w.largest = w.over ? std::max(w.largest, size) : size;
        w.over = true;
        w.last_over = t;
      } else if (w.over && t - w.last_over > kBackBelow) {
        // A vibration passes zero twice per cycle: it is below its limit when it has stayed there for a while.
        w.over = false;
        note(fmt::format("{} below its limit again since {:.3f} s{}, largest {}", channel.name, w.last_over, speed,
                         report::format_amplitude(w.largest, AmplitudeKind::peak, channel.quantity)));
      }
    }
  }
}

void Hub::publish_status() {
  json items = json::array();
  for (const auto& [key, value] : source_->status()) items.push_back({key, value});
  json status{{"type", "status"},
              {"time", last_time_},
              {"items", items},
              {"averages", spectrum_.count()},
              {"blocks_skipped", spectrum_.skipped()},
              {"recording", recorder_.active()},
              {"record_samples", recorder_.samples()},
              {"record_lost", recorder_.lost()},
              {"record_folder", recorder_.folder().string()},
              {"log", log_}};
  log_.clear();
  publish(std::make_shared<Message>(Message{dump(status), true}));
}

void Hub::execute(const std::string& text) {
  try {
    const json request = json::parse(text);
    const std::string command = request.at("command").get<std::string>();
    const double value = request.value("value", 0.0);
    if (command == "record") {
      if (value != 0) {
        recorder_.start(source_->info(), description());
        note("record started: " + recorder_.folder().string());
      } else {
        recorder_.stop("by the user");
        note(fmt::format("record stopped: {} samples, {} lost", recorder_.samples(), recorder_.lost()));
      }
    } else if (command == "reset") {
      spectrum_.reset();
      if (synchronous_) synchronous_->reset();
      note("averages reset");
    } else if (command == "spectrum") {
      const SpectrumSettings settings = read_settings(options_.spectrum, request);
      spectrum_ = SpectrumAverage(block_.cols(), source_->info().rate, settings);
      {
        const std::lock_guard lock(mutex_);
        options_.spectrum = settings;
      }
      publish(std::make_shared<Message>(Message{description(), true}));
      note(fmt::format("spectrum: block {}, {} window, {} average of {}", settings.block, name(settings.window),
                       name(settings.averaging), settings.averages));
    } else if (source_->command(command, value)) {
      note(request.contains("value") ? fmt::format("{} {:g}", command, value) : command);
    } else {
      note("refused: unknown command '" + command + "'");
    }
  } catch (const Error& e) {
    note(std::string("refused: ") + e.what());
  } catch (const json::exception&) {
    note("refused: not a valid command");
  }
}

void Hub::note(const std::string& line) { log_.push_back(fmt::format("{:.3f} s  {}", last_time_, line)); }

}  // namespace whirl::monitor
