#include "whirl/tuning/loop_margins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>
#include <numeric>
#include <optional>
#include <random>

#include "response_estimate.hpp"
#include "runs/design_scenarios.hpp"
#include "tried_loop.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/core/parallel.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/signal/fft.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {
namespace {

using Complex = std::complex<double>;

/// One period of a force with every line of both whirl directions at random phase.
Eigen::VectorXcd multisine(Eigen::Index samples, double rms, std::mt19937_64& random) {
  Eigen::VectorXcd lines(samples);
  for (Eigen::Index k = 0; k < samples; ++k) {
    lines[k] = std::polar(1.0, kTwoPi * static_cast<double>(random() >> 11) * 0x1p-53);
  }
  Eigen::VectorXcd force = signal::inverse_fft(lines);
  return force * (rms * std::sqrt(2.0 * static_cast<double>(samples)) / force.norm());
}

/// The loop that is looked at: alone, its forces without limit. mpc takes the limit as part of its law: far away, it is
/// the regulator.
ControllerDesign free_loop(ControllerDesign design) {
  design.force_limit = 0;
  design.parameters["supervise"] = 0;
  return design;
}

/// Margins of small motion, not held together yet; `free`: free_loop of the design.
SpeedMargins margins_at(const ControllerDesign& free, const rig::RigParameters& rig, double omega,
                        const MarginOptions& o, std::uint64_t seed) {
  const double h = free.sample_time;
  const Eigen::Index window = std::lround(o.window / h);
  const auto tables = rig::make_rig_tables(at_constant_speed(rig, omega, o.settle + o.window));
  const double force = o.force > 0 ? o.force : rig.rotor.stiffness * 1e-6;
  const ForceRun still = run_window(free, tables, seed, window, nullptr);
  const bool follows = gain_follows_motion(free);
  SpeedMargins out;
  out.margins.omega = omega;
  bool holds = still.holds;
  ResponseEstimate estimate(window);
  // The record before the window gave the period that the window repeats: excitation[k % window] begins anew with it.
  const Eigen::Index shift = (std::lround((o.settle + o.window) / h) - window) % window;
  std::mt19937_64 random(seed + 17);
  for (int n = 1; n <= o.repeats && holds; ++n) {
    const Eigen::VectorXcd excitation = multisine(window, force, random);
    const ForceRun shaken = run_window(free, tables, seed, window, &excitation);
    const Eigen::VectorXcd answer = shaken.force - still.force;
    const Eigen::Index third = window / 3;
    // What the excitation leaves must be as large at the end as at the beginning.
    holds = shaken.holds && (follows || !(answer.tail(third).norm() > 1.5 * answer.head(third).norm()));
    Eigen::VectorXcd given(window);
    for (Eigen::Index k = 0; k < window; ++k) given[k] = excitation[(k + shift) % window];
    estimate.add(signal::fft(answer), signal::fft(given));
    if (!std::has_single_bit(static_cast<unsigned>(n)) && n != o.repeats) continue;
    out.response = estimate.response(h);
    if (peak_is_certain(out.response)) break;
  }
  if (holds) {
    out.margins = margins_of(out.response);
    out.margins.omega = omega;
  } else {
    LoopMargins& m = out.margins;
    m.stable = false;
    out.response = {};
    m.gain_up = m.gain_down = 1;
    m.phase = m.delay = m.modulus = 0;
    m.peak_sensitivity = m.peak_complementary = kInfinity;
  }
  return out;
}

/// Further turn of L, rad in [0, 2 pi), by which a delay brings it onto -1 at frequency f.
double turn_to_critical(Complex loop, double f) {
  const double turn = f > 0 ? std::arg(loop) + std::numbers::pi : std::numbers::pi - std::arg(loop);
  return turn < 0 ? turn + kTwoPi : turn >= kTwoPi ? turn - kTwoPi : turn;
}

}  // namespace

bool gain_follows_motion(const ControllerDesign& design) {
  const auto values = control::resolve_parameters(design);
  for (const char* name : {"switching_gain", "gain_max", "twisting_rate", "derivative_rate"}) {
    if (values.contains(name)) return true;
  }
  return design.law == "pd_influence" || design.estimator == "kalman";
}

char sensitivity_zone(double s) { return s < 3 ? 'A' : s < 4 ? 'B' : s < 5 ? 'C' : 'D'; }

namespace {

/// The loop between three lines as a resonance beside a constant: L(f) = (a f + b) / (f + d) through all three. Nothing
/// where they are no such arc, or where its pole stands nearer to the axis than the lines can tell.
struct Arc {
  Complex a, b, d;
  double from = 0;  // Hz, of the middle line: f counts from it
  Complex at(double f) const { return (a * (f - from) + b) / (f - from + d); }
};
std::optional<Arc> arc_through(const LoopResponse& r, std::size_t middle) {
  constexpr double kNearest = 0.05;  // of the spacing of the lines
  if (middle == 0 || middle + 1 >= r.loop.size()) return {};
  const double f0 = r.frequency[middle - 1] - r.frequency[middle], f2 = r.frequency[middle + 1] - r.frequency[middle];
  const Complex l0 = r.loop[middle - 1], l1 = r.loop[middle], l2 = r.loop[middle + 1];
  // From L (f + d) = a f + b at the three lines: b = d l1, and two linear equations in a and d.
  const Complex determinant = f0 * (l2 - l1) - f2 * (l0 - l1);
  if (std::abs(determinant) < 1e-12 * (std::abs(f0) + std::abs(f2)) * std::abs(l1)) return {};
  const Complex d = (f0 * f2 * (l0 - l2)) / determinant;
  const Complex a = (l0 * f0 + d * (l0 - l1)) / f0;
  if (!(std::abs(d.imag()) > kNearest * std::max(std::abs(f0), std::abs(f2))) && std::abs(d.real()) < 2 * std::abs(f2))
    return {};
  return Arc{a, d * l1, d, r.frequency[middle]};
}

/// Standard deviation of a part of the difference of a line and the one before it. Where it is not known, from the
/// second differences about it: their median knows no narrow resonance.
double noise_of_difference(const LoopResponse& r, std::size_t at) {
  if (!r.deviation.empty()) return std::hypot(r.deviation[at - 1], r.deviation[at]);
  constexpr std::size_t kReach = 8;
  constexpr double kMedian = 2.88;  // of |l0 - 2 l1 + l2| for noise of 1 in each part: sqrt(6) sqrt(2 ln 2)
  std::vector<double> bends;
  for (std::size_t i = at > kReach ? at - kReach : 1; i <= at + kReach && i + 1 < r.loop.size(); ++i)
    bends.push_back(std::abs(r.loop[i - 1] - 2.0 * r.loop[i] + r.loop[i + 1]));
  if (bends.size() < kReach) return 0;
  const auto middle = bends.begin() + std::ssize(bends) / 2;
  std::nth_element(bends.begin(), middle, bends.end());
  return std::numbers::sqrt2 * *middle / kMedian;
}

/// Between two lines: straight in L, or straight in the sensitivity where both are outside the unit circle: there a
/// plant without damping has poles of L, which are zeros of S.
Complex between(Complex l0, Complex l1, double part) {
  if (std::abs(l0) > 1 && std::abs(l1) > 1) return 1.0 / ((1 - part) / (1.0 + l0) + part / (1.0 + l1)) - 1.0;
  return (1 - part) * l0 + part * l1;
}
/// The part of the way at which it is real: S is real where L is.
double real_part_at(Complex l0, Complex l1) {
  const bool outside = std::abs(l0) > 1 && std::abs(l1) > 1;
  const double from = outside ? (1.0 / (1.0 + l0)).imag() : l0.imag(),
               to = outside ? (1.0 / (1.0 + l1)).imag() : l1.imag();
  return from / (from - to);
}

/// The response on finer lines: where neighbouring lines differ as much as they lie from -1, on the arc of the stronger
/// of the two with its neighbours, else straight.
LoopResponse refined(const LoopResponse& r) {
  constexpr int kParts = 24;
  constexpr double kFar = 0.1;
  // Standard deviations: noise passes them once in 3e5 differences. Through lines that differ by noise an arc would go
  // anywhere.
  constexpr double kClear = 5;
  LoopResponse fine;
  for (std::size_t i = 0; i < r.loop.size(); ++i) {
    if (i > 0 && r.frequency[i] * r.frequency[i - 1] > 0) {
      const Complex l0 = r.loop[i - 1], l1 = r.loop[i];
      if (std::abs(l1 - l0) > kFar * std::min(std::abs(1.0 + l0), std::abs(1.0 + l1))) {
        const bool clear = std::abs(l1 - l0) > kClear * noise_of_difference(r, i);
        const std::optional<Arc> arc = clear ? arc_through(r, std::abs(l1) > std::abs(l0) ? i : i - 1) : std::nullopt;
        for (int k = 1; k < kParts; ++k) {
          const double part = static_cast<double>(k) / kParts,
                       f = (1 - part) * r.frequency[i - 1] + part * r.frequency[i];
          fine.frequency.push_back(f);
          fine.loop.push_back(arc ? arc->at(f) : between(l0, l1, part));
          if (!r.deviation.empty()) fine.deviation.push_back(std::max(r.deviation[i - 1], r.deviation[i]));
        }
      }
    }
    fine.frequency.push_back(r.frequency[i]);
    fine.loop.push_back(r.loop[i]);
    if (!r.deviation.empty()) fine.deviation.push_back(r.deviation[i]);
  }
  return fine;
}

}  // namespace

LoopMargins margins_of(const LoopResponse& lines) {
  const LoopResponse r = refined(lines);
  LoopMargins m;
  m.gain_up = m.delay = kInfinity;
  m.gain_down = 0;
  m.phase = std::numbers::pi;
  double nearest = kInfinity;
  const auto deviation = [&](std::size_t i) { return r.deviation.empty() ? 0 : r.deviation[i]; };
  // Whatever is read between two lines counts for the sensitivity too: a gain margin g allows a modulus of |1 - 1/g| at
  // most, a phase margin p one of 2 sin(p/2).
  const auto near = [&](double distance, double f, double noise) {
    const double s = 1 / distance;
    if (s > m.peak_sensitivity) m.peak_sensitivity = s, m.peak_frequency = f, m.peak_deviation = s * s * noise;
  };
  const auto at_unit_gain = [&](Complex loop, double f, double noise) {
    const double phase = std::abs(std::arg(-loop));
    near(2 * std::sin(0.5 * phase), f, noise);
    if (phase < m.phase) m.phase = phase, m.phase_frequency = f, m.phase_deviation = noise;
    const double delay = turn_to_critical(loop, f) / (kTwoPi * std::abs(f));
    if (delay < m.delay) m.delay = delay, m.delay_frequency = f;
  };
  for (std::size_t i = 0; i < r.loop.size(); ++i) {
    const Complex l = r.loop[i];
    const double f = r.frequency[i], noise = deviation(i);
    near(std::abs(1.0 + l), f, noise);
    m.peak_complementary = std::max(m.peak_complementary, std::abs(l) / std::abs(1.0 + l));
    if (i == 0 || r.frequency[i] * r.frequency[i - 1] < 0) continue;
    const Complex before = r.loop[i - 1];
    const double g0 = std::log(std::abs(before)), g1 = std::log(std::abs(l));
    if ((g0 > 0) != (g1 > 0)) {
      const double part = g0 / (g0 - g1);
      at_unit_gain(before + part * (l - before), r.frequency[i - 1] + part * (f - r.frequency[i - 1]), noise);
    }
    if ((before.imag() > 0) != (l.imag() > 0)) {
      const double factor = -1 / between(before, l, real_part_at(before, l)).real();
      if (!(factor > 0)) continue;
      near(std::abs(1 - 1 / factor), f, noise);
      if (factor >= 1) m.gain_up = std::min(m.gain_up, factor);
      if (factor < 1) m.gain_down = std::max(m.gain_down, factor);
      if (std::abs(std::log(factor)) < nearest) nearest = std::abs(std::log(factor)), m.gain_frequency = f;
    }
  }
  m.modulus = 1 / m.peak_sensitivity;
  return m;
}

void hold_together(LoopMargins& m) {
  double most = std::min(m.modulus, 2 * std::sin(0.5 * m.phase));
  if (std::isfinite(m.gain_up)) most = std::min(most, 1 - 1 / m.gain_up);
  if (m.gain_down > 0) most = std::min(most, 1 / m.gain_down - 1);
  if (most >= m.modulus) return;
  m.modulus = std::max(most, 1e-6);
  m.peak_sensitivity = 1 / m.modulus;
  m.peak_frequency = m.gain_frequency;
}

namespace {

/// `worst_only`: as of worst_loop_margins.
std::vector<SpeedMargins> margins_over_speeds(const ControllerDesign& design, const rig::RigParameters& rig,
                                              const MarginOptions& options, bool worst_only) {
  require_range("speeds", options.speeds, 1, 1000);
  require_range("settle", options.settle, 0.1, 1000, "s");
  require_range("window", options.window, 0.5, 1000, "s");
  require_range("repeats", options.repeats, 1, 1000);
  require_range("force", options.force, 0, 1e6, "N");
  if (std::abs(design.sample_time * rig.timing.rate - 1) > 1e-9) {
    throw Error::in_field("sample_time", fmt::format("{:g} s", design.sample_time),
                          fmt::format("that of the rig, {:g} s", 1 / rig.timing.rate));
  }
  control::make_controller(design);  // throws for whatever is wrong
  rig.check();
  const ControllerDesign free = free_loop(design);
  const double top = std::max(std::abs(rig.profile.omega_start), std::abs(rig.profile.omega_end));
  const auto omega = [&](int i) { return options.speeds > 1 ? top * i / (options.speeds - 1) : top; };
  const auto seed = [&](int i) { return options.seed + static_cast<std::uint64_t>(i); };
  std::vector<SpeedMargins> out(static_cast<std::size_t>(options.speeds));
  parallel_for(options.speeds, options.threads,
               [&](int i) { out[static_cast<std::size_t>(i)] = margins_at(free, rig, omega(i), options, seed(i)); });
  // The speed that looks nearest to its limit first: it bounds what has to be tried at the others.
  std::vector<int> order(out.size());
  std::iota(order.begin(), order.end(), 0);
  std::ranges::stable_sort(order, {}, [&](int i) { return out[static_cast<std::size_t>(i)].margins.gain_up; });
  const bool follows = gain_follows_motion(design);
  Reach reach;
  parallel_for(options.speeds, options.threads, [&](int k) {
    const int i = order[static_cast<std::size_t>(k)];
    LoopMargins& m = out[static_cast<std::size_t>(i)].margins;
    if (m.stable && options.verify)
      TriedLoop(free, rig, omega(i), options, seed(i)).verify(m, follows, worst_only ? &reach : nullptr);
    reach.found(m);
    if (m.stable) hold_together(m);
  });
  return out;
}

}  // namespace

std::vector<SpeedMargins> loop_margins(const ControllerDesign& design, const rig::RigParameters& rig,
                                       const MarginOptions& options) {
  return margins_over_speeds(design, rig, options, false);
}
std::vector<SpeedMargins> worst_loop_margins(const ControllerDesign& design, const rig::RigParameters& rig,
                                             const MarginOptions& options) {
  return margins_over_speeds(design, rig, options, true);
}

std::optional<Finding> missed_margin(const LoopMargins& m, double sample_time, const VerdictLimits& limits) {
  const auto missed = [](const char* what, std::vector<Amount> amounts = {}) {
    return Finding{FindingCode::requirement_missed, Consequence::unusable, std::move(amounts), what};
  };
  constexpr double kDegree = std::numbers::pi / 180;
  if (!m.stable) return missed("the loop is not stable at every constant speed");
  if (m.gain_up < limits.gain_up()) return missed("gain margin", {{"value", m.gain_up}, {"least", limits.gain_up()}});
  if (m.gain_down > limits.gain_down())
    return missed("gain margin downwards", {{"value", m.gain_down}, {"most", limits.gain_down()}});
  if (const double least = limits.delay_samples * sample_time; m.delay < least)
    return missed("delay margin", {{"value", 1e3 * m.delay, "ms"}, {"least", 1e3 * least, "ms"}});
  if (m.phase < limits.phase())
    return missed("phase margin", {{"value", m.phase / kDegree, "deg"}, {"least", limits.phase() / kDegree, "deg"}});
  if (m.peak_sensitivity > limits.peak_sensitivity)
    return missed("peak sensitivity", {{"value", m.peak_sensitivity}, {"most", limits.peak_sensitivity}});
  return {};
}

std::optional<Finding> margin_failure(const std::vector<SpeedMargins>& speeds, const ControllerDesign& design) {
  for (const SpeedMargins& s : speeds) {
    if (std::optional<Finding> missed = missed_margin(s.margins, design.sample_time)) {
      missed->where = fmt::format("at a speed of {:.1f} Hz: {}", s.margins.omega / kTwoPi, missed->where);
      return missed;
    }
  }
  return {};
}

std::vector<MarginStudy> margin_studies(const ControllerDesign& design, const IdentifiedModel& model,
                                        const DesignOptions& plant, const MarginOptions& options) {
  if (!model.rotor) throw Error("margins: the model is no rotor");
  double gain = plant.gain > 0 ? plant.gain : model.rotor->gain;
  if (!(gain > 0)) gain = design.model.gain;
  if (!(gain > 0)) throw Error("margins: the input gain of the model is not known");
  const ControllerDesign trial = on_scenario(design, {});
  std::vector<MarginStudy> out;
  const auto study = [&](const IdentifiedModel& reading, const std::string& name) {
    RotorModel rotor = *reading.rotor;
    rotor.gain = gain;
    for (const Hardware& chosen : with_forces(plant.hardware, reading).sign_cases()) {
      const Hardware hardware = tuning_hardware(design, chosen);
      const std::string signs = plant.hardware.signs_of(chosen);
      out.push_back({name.empty() ? signs : name + (signs.empty() ? "" : ", " + signs),
                     loop_margins(trial, tuning_plant(rotor, hardware), options)});
    }
  };
  study(model, "");
  for (const identification::ModelReading& other : identification::other_readings(model))
    study(other.model, other.reading);
  return out;
}

LoopMargins worst_margins(const std::vector<SpeedMargins>& speeds) {
  LoopMargins worst;
  worst.gain_up = worst.delay = kInfinity;
  worst.phase = std::numbers::pi;
  double gain = kInfinity;
  for (const SpeedMargins& s : speeds) {
    const LoopMargins& m = s.margins;
    worst.stable = worst.stable && m.stable;
    worst.simulated = worst.simulated || m.simulated;
    worst.gain_up = std::min(worst.gain_up, m.gain_up);
    worst.gain_down = std::max(worst.gain_down, m.gain_down);
    const double nearer = std::min(std::log(m.gain_up), m.gain_down > 0 ? -std::log(m.gain_down) : kInfinity);
    if (nearer < gain) gain = nearer, worst.gain_frequency = m.gain_frequency;
    if (m.phase < worst.phase) {
      worst.phase = m.phase, worst.phase_frequency = m.phase_frequency, worst.phase_deviation = m.phase_deviation;
    }
    if (m.delay < worst.delay) worst.delay = m.delay, worst.delay_frequency = m.delay_frequency;
    worst.peak_complementary = std::max(worst.peak_complementary, m.peak_complementary);
    if (m.peak_sensitivity > worst.peak_sensitivity) {
      worst.peak_sensitivity = m.peak_sensitivity;
      worst.modulus = m.modulus;
      worst.peak_deviation = m.peak_deviation;
      worst.peak_frequency = m.peak_frequency;
      worst.omega = m.omega;
    }
  }
  return worst;
}

}  // namespace whirl::tuning
