#include "whirl/tuning/loop_margins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "design_scenarios.hpp"
#include "robustness_parallel.hpp"
#include "tried_loop.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"
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

SpeedMargins margins_at(const ControllerDesign& design, const rig::RigParameters& rig, double omega,
                        const MarginOptions& o, std::uint64_t seed) {
  const double h = design.sample_time;
  const Eigen::Index window = std::lround(o.window / h);
  const auto tables = rig::make_rig_tables(at_constant_speed(rig, omega, o.settle + o.window));
  ControllerDesign free = design;
  free.force_limit = 0;
  free.parameters["supervise"] = 0;
  // mpc takes the limit as part of its law: far away, it is the regulator
  const double force = o.force > 0 ? o.force : rig.rotor.stiffness * 1e-6;
  const ForceRun still = run_window(free, tables, seed, window, nullptr);
  const bool follows = gain_follows_motion(design);
  SpeedMargins out;
  out.margins.omega = omega;
  bool holds = still.holds;
  Eigen::VectorXcd cross = Eigen::VectorXcd::Zero(window);
  Eigen::VectorXd power = Eigen::VectorXd::Zero(window);
  std::mt19937_64 random(seed + 17);
  for (int i = 0; i < o.repeats && holds; ++i) {
    const Eigen::VectorXcd excitation = multisine(window, force, random);
    const ForceRun shaken = run_window(free, tables, seed, window, &excitation);
    const Eigen::VectorXcd answer = shaken.force - still.force;
    const Eigen::Index third = window / 3;
    // What the excitation leaves must be as large at the end as at the beginning.
    holds = shaken.holds && (follows || !(answer.tail(third).norm() > 1.5 * answer.head(third).norm()));
    // The record before the window gave the period that the window repeats: excitation[k % window] begins anew with it.
    const Eigen::Index shift = (std::lround((o.settle + o.window) / h) - window) % window;
    Eigen::VectorXcd acting(window);
    for (Eigen::Index k = 0; k < window; ++k) acting[k] = answer[k] + excitation[(k + shift) % window];
    const Eigen::VectorXcd u = signal::fft(answer), sum = signal::fft(acting);
    cross -= (u.array() * sum.array().conjugate()).matrix();
    power += sum.cwiseAbs2();
  }
  if (holds) {
    for (Eigen::Index k = 0; k < window; ++k) {
      const Eigen::Index line = (k + window - window / 2) % window;  // from the lowest frequency on
      const Eigen::Index number = k - window / 2;
      if (line == 0) continue;
      out.response.frequency.push_back(static_cast<double>(number) / (static_cast<double>(window) * h));
      out.response.loop.push_back(cross[line] / power[line]);
    }
    out.margins = margins_of(out.response);
    out.margins.omega = omega;
    if (o.verify) TriedLoop(free, rig, omega, o, seed).verify(out.margins, follows);
  } else {
    LoopMargins& m = out.margins;
    m.stable = false;
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

LoopMargins margins_of(const LoopResponse& r) {
  LoopMargins m;
  m.gain_up = m.delay = kInfinity;
  m.gain_down = 0;
  m.phase = std::numbers::pi;
  double nearest = kInfinity;
  const auto at_unit_gain = [&](Complex loop, double f) {
    const double phase = std::abs(std::arg(-loop));
    if (phase < m.phase) m.phase = phase, m.phase_frequency = f;
    const double delay = turn_to_critical(loop, f) / (kTwoPi * std::abs(f));
    if (delay < m.delay) m.delay = delay, m.delay_frequency = f;
  };
  for (std::size_t i = 0; i < r.loop.size(); ++i) {
    const Complex l = r.loop[i];
    const double f = r.frequency[i], s = 1 / std::abs(1.0 + l);
    if (s > m.peak_sensitivity) m.peak_sensitivity = s, m.peak_frequency = f;
    m.peak_complementary = std::max(m.peak_complementary, std::abs(l) * s);
    if (i == 0 || r.frequency[i] * r.frequency[i - 1] < 0) continue;
    const Complex before = r.loop[i - 1];
    // Between two lines L is taken as a straight stroke.
    const double g0 = std::log(std::abs(before)), g1 = std::log(std::abs(l));
    if ((g0 > 0) != (g1 > 0)) {
      const double part = g0 / (g0 - g1);
      at_unit_gain(before + part * (l - before), r.frequency[i - 1] + part * (f - r.frequency[i - 1]));
    }
    if ((before.imag() > 0) != (l.imag() > 0)) {
      const double part = before.imag() / (before.imag() - l.imag());
      const double real = before.real() + part * (l.real() - before.real());
      // Where L is large it is that of a resonance, an arc through zero: there 1/L is the straight stroke.
      const Complex i0 = 1.0 / before, i1 = 1.0 / l;
      const double inverse = -(i0 + i0.imag() / (i0.imag() - i1.imag()) * (i1 - i0)).real();
      const double factor = inverse > 0 && inverse < 1 ? inverse : -1 / real;
      if (!(factor > 0)) continue;
      if (factor >= 1) m.gain_up = std::min(m.gain_up, factor);
      if (factor < 1) m.gain_down = std::max(m.gain_down, factor);
      if (std::abs(std::log(factor)) < nearest) nearest = std::abs(std::log(factor)), m.gain_frequency = f;
    }
  }
  m.modulus = 1 / m.peak_sensitivity;
  return m;
}

std::vector<SpeedMargins> loop_margins(const ControllerDesign& design, const rig::RigParameters& rig,
                                       const MarginOptions& options) {
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
  const double top = std::max(std::abs(rig.profile.omega_start), std::abs(rig.profile.omega_end));
  std::vector<SpeedMargins> out(static_cast<std::size_t>(options.speeds));
  parallel_for(options.speeds, options.threads, [&](int i) {
    const double omega = options.speeds > 1 ? top * i / (options.speeds - 1) : top;
    out[static_cast<std::size_t>(i)] =
        margins_at(design, rig, omega, options, options.seed + static_cast<std::uint64_t>(i));
  });
  return out;
}

std::string margin_failure(const std::vector<SpeedMargins>& speeds, double sample_time) {
  for (const SpeedMargins& s : speeds) {
    if (!s.margins.stable) return fmt::format("the loop is not stable at {:.1f} Hz", s.margins.omega / kTwoPi);
  }
  const LoopMargins worst = worst_margins(speeds);
  if (std::string low = margin_shortfall(true, worst.gain_up, worst.delay, sample_time); !low.empty()) return low;
  if (worst.zone() != 'D') return {};
  return fmt::format("peak sensitivity {:.1f} at {:.0f} Hz and a speed of {:.1f} Hz: zone D of ISO 14839-3 (above 5)",
                     worst.peak_sensitivity, worst.peak_frequency, worst.omega / kTwoPi);
}

std::vector<MarginStudy> margin_studies(const ControllerDesign& design, const IdentifiedModel& model,
                                        const DesignOptions& plant, const MarginOptions& options) {
  if (!model.rotor) throw Error("margins: the model is no rotor");
  RotorModel rotor = *model.rotor;
  if (plant.gain > 0) rotor.gain = plant.gain;
  if (!(rotor.gain > 0)) rotor.gain = design.model.gain;
  if (!(rotor.gain > 0)) throw Error("margins: the input gain of the model is not known");
  const ControllerDesign trial = on_scenario(design, {});
  std::vector<MarginStudy> out;
  for (const Hardware& chosen : with_forces(plant.hardware, model).sign_cases()) {
    const Hardware hardware = tuning_hardware(design, chosen);
    out.push_back({plant.hardware.signs_of(chosen), loop_margins(trial, tuning_plant(rotor, hardware), options)});
  }
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
    if (m.phase < worst.phase) worst.phase = m.phase, worst.phase_frequency = m.phase_frequency;
    if (m.delay < worst.delay) worst.delay = m.delay, worst.delay_frequency = m.delay_frequency;
    worst.peak_complementary = std::max(worst.peak_complementary, m.peak_complementary);
    if (m.peak_sensitivity > worst.peak_sensitivity) {
      worst.peak_sensitivity = m.peak_sensitivity;
      worst.modulus = m.modulus;
      worst.peak_frequency = m.peak_frequency;
      worst.omega = m.omega;
    }
  }
  return worst;
}

}  // namespace whirl::tuning
