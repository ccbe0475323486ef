#include "whirl/hardware/sensitivity.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>
#include <random>

#include "whirl/control/controller.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/hardware/at_rest.hpp"
#include "whirl/rt/loop.hpp"
#include "whirl/rt/realtime.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::hardware {
namespace {

using Complex = std::complex<double>;
constexpr double kPeriod = 2;         // s: lines 0.5 Hz apart
constexpr double kSpacing = 0.02;     // further apart at high frequency, relative: more force for each
constexpr double kHighest = 0.4;      // of the sampling rate
constexpr double kMostMissed = 1e-3;  // share of ticks

/// Numbers of the lines of both whirl directions, ascending.
std::vector<Eigen::Index> lines_of(Eigen::Index period) {
  std::vector<Eigen::Index> up;
  const auto last = static_cast<Eigen::Index>(kHighest * static_cast<double>(period));
  for (Eigen::Index k = 1; k <= last; k += std::max<Eigen::Index>(1, std::lround(kSpacing * static_cast<double>(k)))) {
    up.push_back(k);
  }
  std::vector<Eigen::Index> all;
  for (auto k = up.rbegin(); k != up.rend(); ++k) all.push_back(-*k);
  all.insert(all.end(), up.begin(), up.end());
  return all;
}

Eigen::Index slot(Eigen::Index line, Eigen::Index period) { return line < 0 ? line + period : line; }

/// Half of the time with those lines at random phase, the other half with the backward ones turned by 180 degrees: what
/// an uneven shaft passes on from one whirl direction to the other then leaves the mean.
Eigen::VectorXcd excitation_of(const std::vector<Eigen::Index>& lines, Eigen::Index period, long periods, double rms) {
  std::mt19937_64 random(1);
  std::array<Eigen::VectorXcd, 2> spectrum{Eigen::VectorXcd::Zero(period), Eigen::VectorXcd::Zero(period)};
  for (const Eigen::Index k : lines) {
    const Complex line = std::polar(1.0, 2 * std::numbers::pi * static_cast<double>(random() >> 11) * 0x1p-53);
    spectrum[0][slot(k, period)] = line;
    spectrum[1][slot(k, period)] = k < 0 ? -line : line;
  }
  Eigen::VectorXcd force(2 * periods * period);
  for (long p = 0; p < 2 * periods; ++p) {
    force.segment(p * period, period) = signal::inverse_fft(spectrum[p < periods ? 0 : 1]);
  }
  return force * (rms * std::sqrt(2.0 * static_cast<double>(force.size())) / force.norm());
}

/// The controller with a force beside its own, of which it knows nothing.
class Shaken {
 public:
  Shaken(control::Controller& controller, const Eigen::VectorXcd& force, Eigen::VectorXcd& answer, double h) noexcept
      : controller_(controller), force_(force), answer_(answer), h_(h) {}

  Expected<Command, Fault> step(const Measurement& m) noexcept {
    if (next_ == 0) begun_ = m.t;
    const auto u = controller_.step(m);
    if (!u) return u;
    const Eigen::Index k = std::max<Eigen::Index>(std::lround((m.t - begun_) / h_), next_);
    // Ticks left out: the force was held.
    for (; next_ <= k && next_ < answer_.size(); ++next_) answer_[next_] = {u->ux, u->uy};
    added_ = k < force_.size() ? force_[k] : 0;
    return Command{u->ux + added_.real(), u->uy + added_.imag()};
  }
  void applied(const Command& sent) noexcept {
    controller_.applied({sent.ux - added_.real(), sent.uy - added_.imag()});
  }
  bool done() const noexcept { return next_ >= answer_.size(); }

 private:
  control::Controller& controller_;
  const Eigen::VectorXcd& force_;
  Eigen::VectorXcd& answer_;
  double h_, begun_ = 0;
  Eigen::Index next_ = 0;
  Complex added_;
};

template <class Clock>
void run(const IoSettings& io, rt::HardwareRig& rig, Clock& clock, control::Controller& controller,
         const Eigen::VectorXcd& force, Eigen::VectorXcd& answer, StopRequest stop, LoopSensitivity& out) {
  Shaken law(controller, force, answer, 1 / io.rate);
  rt::Loop loop(rig, law, clock, io.limits(), io.loop());
  Idle idle(io, rig, stop);
  idle.settle(io, loop);
  idle.watch_rest(loop);
  if (idle.stopped()) out.trip = Fault::requested;
  if (idle.silent()) throw Error::in_file(io.source, 0, "the board does not answer");
  if (!idle.goes_on()) return;
  if (const std::string why = idle.rest().refusal(); !why.empty()) throw Error("sensitivity: " + why);
  rig.stay_at_rest();
  loop.arm();
  while (!law.done() && out.trip == Fault::none) {
    if (stop()) loop.stop();
    const rt::CycleRecord r = loop.cycle();
    out.missed += r.missed;
    out.limited += r.limited || controller.state().saturated;
    out.trip = r.trip;
  }
}

void analyse(const Eigen::VectorXcd& force, const Eigen::VectorXcd& answer, Eigen::Index period,
             const std::vector<Eigen::Index>& lines, double rate, LoopSensitivity& out) {
  std::vector<Eigen::VectorXcd> spectra, given;
  const Eigen::Index half = force.size() / (2 * period);
  for (Eigen::Index p = 0; p < 2 * half; ++p) {
    if (p % half == 0) continue;  // settling
    given.push_back(signal::fft(Eigen::VectorXcd(force.segment(p * period, period))));
    spectra.push_back(signal::fft(Eigen::VectorXcd(answer.segment(p * period, period))));
  }
  const auto n = static_cast<double>(out.periods);
  for (const Eigen::Index line : lines) {
    const Eigen::Index at = slot(line, period);
    // The mean of both halves; the scatter is that within each.
    std::array<Complex, 2> mean{};
    double scatter = 0;
    const std::size_t each = spectra.size() / 2;
    for (std::size_t i = 0; i < spectra.size(); ++i) {
      mean[i / each] += spectra[i][at] / given[i][at] / static_cast<double>(each);
    }
    for (std::size_t i = 0; i < spectra.size(); ++i) {
      scatter += std::norm(spectra[i][at] / given[i][at] - mean[i / each]);
    }
    const Complex answered = 0.5 * (mean[0] + mean[1]);
    // S = 1 + T with T the controller's answer; L = -T / S. Half of the scatter is along S.
    const Complex s = 1.0 + answered;
    out.response.frequency.push_back(static_cast<double>(line) * rate / static_cast<double>(period));
    out.response.loop.push_back(-answered / s);
    out.deviation.push_back(std::sqrt(0.5 * scatter / (n * (n - 2))));
  }
  out.margins = tuning::margins_of(out.response);
  // The peak is read between two lines: the less certain of them counts.
  const std::vector<double>& f = out.response.frequency;
  const auto above = std::ranges::lower_bound(f, out.margins.peak_frequency) - f.begin();
  const auto last = std::ssize(f) - 1;
  out.peak_deviation = std::max(out.deviation[static_cast<std::size_t>(std::clamp(above - 1, 0L, last))],
                                out.deviation[static_cast<std::size_t>(std::clamp(above, 0L, last))]);
}

}  // namespace

LoopSensitivity measure_sensitivity(const IoSettings& io, const ControllerDesign& design, double seconds,
                                    double excitation, StopRequest stop) {
  std::optional<rt::HardwareRig> rig;
  const auto open = [&]() -> rt::HardwareRig& { return rig.emplace(io.hardware, io.board()); };
  return measure_sensitivity(io, open, design, seconds, excitation, stop);
}

LoopSensitivity measure_sensitivity(const IoSettings& io, const OpenRig& open, const ControllerDesign& design,
                                    double seconds, double excitation, StopRequest stop) {
  require_range("--seconds", seconds, 6 * kPeriod, 600, "s");
  require_range("--excite-N", excitation, 1e-9, 1e4, "N");
  if (std::abs(design.sample_time * io.rate - 1) > 1e-6) {
    throw Error::in_file(
        io.source, 0,
        fmt::format("loop.rate_hz = {:g}: the controller was designed for {:g} Hz", io.rate, 1 / design.sample_time));
  }
  IoSettings settings = io;
  settings.release = 0;
  double& limit = settings.safety.displacement;
  if (const auto trip = design.margins.find("trip_displacement_m"); trip != design.margins.end()) {
    limit = limit > 0 ? std::min(limit, trip->second) : trip->second;
  }
  if (limit <= 0) {
    throw Error::in_file(io.source, 0, "safety.displacement_mm = 0: an excitation needs a displacement that trips");
  }
  ControllerDesign free = design;
  free.parameters["supervise"] = 0;
  control::Controller controller = control::make_controller(free);
  LoopSensitivity out;
  out.excitation = excitation;
  const auto period = static_cast<Eigen::Index>(std::lround(kPeriod * io.rate));
  const long half = static_cast<long>(std::floor(seconds / (2 * kPeriod)));
  out.periods = 2 * (half - 1);
  const std::vector<Eigen::Index> lines = lines_of(period);
  const Eigen::VectorXcd force = excitation_of(lines, period, half, excitation);
  Eigen::VectorXcd answer = Eigen::VectorXcd::Zero(force.size());

  rt::HardwareRig& rig = open();
  const rt::RealtimeThread realtime(settings.realtime);
  rt::WallTime time;
  if (settings.clock == "wall") {
    rt::PacedClock clock(time, settings.pace());
    run(settings, rig, clock, controller, force, answer, stop, out);
  } else {
    rt::SampleClock clock(rig, time, settings.pace(), settings.watchdog_ns());
    run(settings, rig, clock, controller, force, answer, stop, out);
  }
  if (out.trip == Fault::requested) {
    out.summary.warn("stopped by a signal: the sensitivity was not measured");
    return out;
  }
  if (out.trip != Fault::none) {
    out.summary.fail("the loop tripped: " + std::string(to_string(out.trip)));
    return out;
  }
  analyse(force, answer, period, lines, io.rate, out);
  const auto ticks = static_cast<double>(answer.size());
  if (static_cast<double>(out.missed) > kMostMissed * ticks) {
    out.summary.warn(fmt::format("{} of {:.0f} ticks were left out", out.missed, ticks));
  }
  if (out.limited > 0) {
    out.summary.warn(fmt::format("the force was at its limit in {}: excite less", counted(out.limited, "tick")));
  }
  const double peak = out.margins.peak_sensitivity, two = 2 * out.peak_deviation;
  if (tuning::sensitivity_zone(peak - two) != tuning::sensitivity_zone(peak + two)) {
    out.summary.warn(
        fmt::format("peak {:.2f} +- {:.2f} (two standard deviations) leaves the zone open: excite more or "
                    "longer",
                    peak, two));
  }
  if (out.margins.zone() == 'D') out.summary.fail(fmt::format("peak sensitivity {:.1f}: zone D of ISO 14839-3", peak));
  return out;
}

io::Json to_json(const LoopSensitivity& m) {
  io::Json json = io::start_document("whirl.loop-sensitivity", 1);
  json.set("excitation", m.excitation)
      .set("periods", m.periods)
      .set("missed", m.missed)
      .set("limited", m.limited)
      .set("trip", std::string(to_string(m.trip)));
  if (m.trip != Fault::none) return json;
  std::vector<double> real, imag;
  for (const Complex& l : m.response.loop) real.push_back(l.real()), imag.push_back(l.imag());
  json.set("peak_sensitivity", m.margins.peak_sensitivity)
      .set("peak_deviation", m.peak_deviation)
      .set("peak_frequency", m.margins.peak_frequency)
      .set("zone", std::string(1, m.margins.zone()))
      .set("modulus_margin", m.margins.modulus)
      .set("phase_margin", m.margins.phase)
      .set("frequency", m.response.frequency)
      .set("loop_real", real)
      .set("loop_imag", imag)
      .set("deviation", m.deviation)
      .set("problems", m.summary.warnings);
  if (std::isfinite(m.margins.gain_up)) json.set("gain_margin", m.margins.gain_up);
  if (std::isfinite(m.margins.delay)) json.set("delay_margin", m.margins.delay);
  return json;
}

}  // namespace whirl::hardware
