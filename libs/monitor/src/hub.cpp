#include "whirl/monitor/hub.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/report/format.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

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
Index block_rows(const StreamInfo& info) { return static_cast<Index>(std::clamp(2 * info.rate, 4096.0, 65536.0)); }

}  // namespace

Hub::Hub(std::unique_ptr<FrameSource> source, const HubOptions& options)
    : source_(std::move(source)),
      controls_(controls_of(*source_)),
      options_(options),
      tracked_(tracked_channels(source_->info().channels)),
      limits_(source_->info(), options.limits),
      spectrum_(make_spectrum(options.spectrum)),
      recorder_(options.recorder) {
  require_range("frame_rate", options.frame_rate, 1, 60, "Hz");
  require_range("frame_groups", static_cast<double>(options.frame_groups), 16, 16384);
  set_up();
}

/// What follows from the channels.
void Hub::set_up() {
  const auto& channels = source_->info().channels;
  block_.resize(block_rows(source_->info()), static_cast<Index>(channels.size()));
  beta_ = -1;
  times_.clear();
  synchronous_.reset();
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (channels[c].name == "beta") beta_ = static_cast<Index>(c);
    if (channels[c].name == "latency" || channels[c].name == "period")
      times_.push_back({channels[c].name, static_cast<Index>(c), {}});
  }
  if (beta_ >= 0 && !tracked_.empty()) synchronous_.emplace(static_cast<Index>(tracked_.size()), source_->info().rate);
}

SpectrumAverage Hub::make_spectrum(const SpectrumSettings& settings) const {
  // An orbit has two axes; more displacements are probes of their own.
  const bool orbit = tracked_.size() == 2;
  return {static_cast<Index>(source_->info().channels.size()), source_->info().rate, settings,
          orbit ? std::pair(tracked_[0], tracked_[1]) : std::pair<Index, Index>(-1, -1)};
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
  if (!history_.empty()) client->push(history());
  clients_.push_back(client);
}

void Hub::remove(const std::shared_ptr<ClientQueue>& client) {
  const std::lock_guard lock(mutex_);
  std::erase(clients_, client);
}

void Hub::publish(MessagePtr message) {
  const std::lock_guard lock(mutex_);
  for (const auto& client : clients_) client->push(message);
}

void Hub::publish_frame(FrameKind kind, unsigned log2_group, double t, const Eigen::Ref<const MatrixXd>& values) {
  publish(std::make_shared<Message>(Message{encode_frame(kind, log2_group, seq_++, t, values), false}));
}

void Hub::publish_samples(double t_first, const Eigen::Ref<const MatrixXd>& rows) {
  const auto groups =
      static_cast<std::uint64_t>(std::max<Index>(1, (rows.rows() + options_.frame_groups - 1) / options_.frame_groups));
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
  MatrixXd values(static_cast<Index>(turns.size()), 2 + 2 * displacement.cols());
  for (Index i = 0; i < values.rows(); ++i) {
    const auto& turn = turns[static_cast<std::size_t>(i)];
    values(i, 0) = turn.speed;
    values(i, 1) = turn.end;
    for (Index k = 0; k < displacement.cols(); ++k) {
      values(i, 2 + 2 * k) = turn.vector(k).real();
      values(i, 3 + 2 * k) = turn.vector(k).imag();
    }
  }
  publish_frame(FrameKind::synchronous, 0, t_first, values);
  take_turns(t_first, values);
}

void Hub::take_turns(double t_first, const MatrixXd& turns) {
  speed_ = turns(turns.rows() - 1, 0);
  std::vector<double> amplitude(tracked_.size());
  for (Index i = 0; i < turns.rows(); ++i) {
    for (std::size_t k = 0; k < amplitude.size(); ++k) {
      const Index c = 2 + 2 * static_cast<Index>(k);
      amplitude[k] = std::hypot(turns(i, c), turns(i, c + 1));
    }
    const Trend before = trend_.trend();
    if (const auto run = trend_.turn(t_first + turns(i, 1), turns(i, 0), amplitude)) note_run(*run);
    if (before == Trend::steady && trend_.trend() != before) {
      note(fmt::format("{} begins near {:.0f} rpm", name(trend_.trend()), std::abs(turns(i, 0)) * kRpmPerRadPerSec));
    }
  }
}

void Hub::note_run(const SpeedTrend::Run& run) {
  std::string line = fmt::format("{} from {:.0f} to {:.0f} rpm in {:.2f} s ({:.0f} rpm/s)", name(run.trend),
                                 run.speed_begin * kRpmPerRadPerSec, run.speed_end * kRpmPerRadPerSec,
                                 run.end - run.begin, run.rate() * kRpmPerRadPerSec);
  for (std::size_t k = 0; k < run.largest.size(); ++k) {
    line += fmt::format(", largest 1X {} {} at {:.0f} rpm",
                        source_->info().channels[static_cast<std::size_t>(tracked_[k])].name,
                        report::format_amplitude(run.largest[k].amplitude, AmplitudeKind::peak),
                        run.largest[k].speed * kRpmPerRadPerSec);
  }
  note(line);
}

void Hub::time_cycles(const Eigen::Ref<const MatrixXd>& rows) {
  for (Index i = 0; i < rows.rows(); ++i, ++cycles_) {
    for (Times& t : times_) {
      if (rows(i, t.channel) > 0) t.histogram.add(std::llround(1e9 * rows(i, t.channel)), cycles_);
    }
  }
}

void Hub::publish_spectra() {
  publish_frame(FrameKind::spectrum, 0, last_time_, spectrum_.amplitude());
  if (const Eigen::VectorXd full = spectrum_.full_amplitude(); full.size() > 0) {
    publish_frame(FrameKind::full_spectrum, 0, last_time_, full);
  }
  if (spectrum_.latest().size() > 0) {
    const double half = 0.5 * static_cast<double>(spectrum_.settings().block) / source_->info().rate;
    publish_frame(FrameKind::waterfall, 0, last_time_ - half,
                  spectrum_.latest().col(tracked_.empty() ? 0 : tracked_[0]));
  }
}

void Hub::step() {
  std::vector<Asked> asked;
  {
    const std::lock_guard lock(mutex_);
    asked.swap(asked_);
  }
  for (const Asked& a : asked) {
    if (a.kind == Asked::line) {
      note(a.text);
    } else {
      execute(a.text, a.kind == Asked::done);
    }
  }
  take_opened();
  for (const std::string& line : source_->events()) note(line);

  double t_first = 0;
  if (const Index rows = source_->read(block_, t_first); rows > 0) {
    const auto fresh = block_.topRows(rows);
    if (source_->jumped()) {
      if (synchronous_) synchronous_->reset();
      if (const auto run = trend_.interrupt()) note_run(*run);
    }
    last_time_ = t_first + static_cast<double>(rows) / source_->info().rate;
    const bool was_recording = recorder_.active();
    recorder_.write(t_first, fresh);
    if (was_recording && !recorder_.active()) note("record stopped: " + recorder_.stopped_because());
    publish_samples(t_first, fresh);
    publish_synchronous(t_first, fresh);
    const std::string where = std::isfinite(speed_) ? fmt::format(" at {:.0f} rpm", speed_ * kRpmPerRadPerSec) : "";
    for (const std::string& line : limits_.look(t_first, fresh, where)) note(line);
    time_cycles(fresh);
    if (spectrum_.push(fresh) > 0 && spectrum_.count() > 0) publish_spectra();
  }
  if (const auto run = trend_.stopped(last_time_)) note_run(*run);
  if (steps_++ % std::max(1L, std::lround(options_.frame_rate / 2)) == 0 || !log_.empty()) publish_status();
}

void Hub::note(const std::string& line) {
  log_.push_back(fmt::format("{:.3f} s  {}", last_time_, line));
  recorder_.event(last_time_, line);
}

}  // namespace whirl::monitor
