#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "certificate/certificate_runs.hpp"
#include "certificate/design_peak.hpp"
#include "design_parts.hpp"
#include "runs/design_scenarios.hpp"
#include "tried_loop.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/times.hpp"
#include "whirl/core/parallel.hpp"
#include "whirl/tuning/delivered_delay.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/loop_margins.hpp"
#include "whirl/tuning/verdict.hpp"

namespace whirl::tuning {

double static_control_stiffness(const ControllerDesign& design) {
  control::Controller controller = control::make_controller(design);
  Measurement m;
  m.x = design.model.offset.real();
  m.y = design.model.offset.imag();
  // 1 mm: outside the boundary layer's and the terminal surface's steep inside, where buckling would start to
  // grow.
  constexpr double kDeflection = 1e-3;
  std::array<double, 2> force{};
  for (int side = 0; side < 2; ++side) {
    controller.reset();
    m.x = design.model.offset.real() + (side == 0 ? -kDeflection : kDeflection);
    for (int k = 0; k < 2000; ++k) {
      const auto out = controller.step(m);
      if (!out) return 0;
      force[static_cast<std::size_t>(side)] = out->ux;
    }
  }
  return -design.model.gain * (force[1] - force[0]) / (2 * kDeflection);
}

namespace {

/// The worst of what `whirl margins` finds with its own settings, on every case of the signs that are not known.
std::vector<SpeedMargins> margins_on(const ControllerDesign& trial, const RotorModel& model, const Hardware& hardware,
                                     int threads) {
  MarginOptions o;
  o.threads = threads;
  std::vector<SpeedMargins> all;
  for (const Hardware& h : hardware.sign_cases()) {
    const std::vector<SpeedMargins> found = worst_loop_margins(trial, tuning_plant(model, h), o);
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

void put_margins(std::map<std::string, double>& margins, const LoopMargins& m, double sample_time) {
  // Where none was found up to here, that is what is known.
  constexpr double kMostGain = 8;
  const auto bounded = [](double value, double most) { return std::isfinite(value) ? std::min(value, most) : most; };
  margins["delay_margin_s"] = m.stable ? stated_delay(m.delay, sample_time) : 0;
  margins["gain_margin"] = m.stable ? bounded(m.gain_up, kMostGain) : 1;
  margins["gain_margin_down"] = m.gain_down;
  margins["phase_margin_deg"] = m.phase * 180 / std::numbers::pi;
  margins["modulus_margin"] = m.modulus;
  margins["peak_sensitivity"] = bounded(m.peak_sensitivity, 1e3);
}

/// A design as the certificate has it: what it runs on, and the runs' seed, which is not that of the tuning.
struct Certified {
  Certified(const ControllerDesign& design, const DesignOptions& options)
      : hardware(tuning_hardware(design, options.hardware)),
        ringing(tuning_scenarios(hardware, options.stiffness_uncertainty).front()),
        nominal(ringing),
        seed(options.seed + 1000) {
    nominal.ringing = 0;  // what stands is then the loop's own
  }
  Hardware hardware;
  TuningScenario ringing, nominal;
  std::uint64_t seed;
};

/// Largest level that the supervision sees in the nominal run, m rms.
double watched_level(const ControllerDesign& design, const Certified& as) {
  ControllerDesign trial = on_scenario(design, as.nominal);
  trial.parameters["supervise"] = 1;
  trial.parameters["watch_level"] = 1;
  return scenario_plant(as.ringing, design.model, as.hardware, as.seed).run(trial).watched_level;
}

/// A correction that is wrong by all it may be stays inside what the certificate states.
void bound_reidentification(ControllerDesign& design, double stiffness_uncertainty) {
  auto values = control::resolve_parameters(design);
  if (std::lround(values.at("reidentify")) == 0) return;
  const double up = design.margins.at("gain_margin"), down = design.margins.at("gain_margin_down");
  const double gain = std::min(1 - 1 / up, down > 0 ? 1 / down - 1 : 1);
  design.parameters["reidentify_gain"] = std::clamp(values.at("reidentify_gain"), 0.01, std::max(gain, 0.01));
  design.parameters["reidentify_stiffness"] =
      std::clamp(values.at("reidentify_stiffness"), 0.01, std::max(stiffness_uncertainty, 0.01));
}

}  // namespace

void add_supervision(ControllerDesign& design, const DesignOptions& options, const rig::SegmentPeaks& open) {
  constexpr double kAbove = 4, kLeast = 60e-6, kShare = 0.2;
  const double level = watched_level(design, {design, options});
  double smallest = open.all;
  for (const double peak : open.segment) {
    if (peak > 0) smallest = std::min(smallest, peak);
  }
  design.parameters["supervise"] = 1;
  design.parameters["watch_level"] = std::min(std::max({kAbove * level, kShare * smallest, kLeast}), 1.0);
  for (const auto& [name, value] : options.fixed) {
    if (name == "supervise" || name.starts_with("watch_")) design.parameters[name] = value;
  }
  bound_reidentification(design, options.stiffness_uncertainty);
}
void add_supervision(ControllerDesign& design, const DesignOptions& options) {
  const Certified as(design, options);
  add_supervision(design, options, scenario_plant(as.nominal, design.model, as.hardware, as.seed).open());
}

namespace {

/// Paper eq. 42, rho > |Delta| + kappa: what the model may have wrong, at the amplitudes of the nominal run, and the
/// times of reaching and sliding that follow.
void add_sliding_margins(ControllerDesign& design, const ClosedLoopMetrics& run, const TuningScenario& nominal,
                         const Hardware& hardware, double stiffness_uncertainty) {
  const RotorModel& model = design.model;
  auto& margins = design.margins;
  const double top = std::max(hardware.profile.omega_start, hardware.profile.omega_end);
  const double unbalance_error = std::abs(nominal.unbalance - 1.0) * std::abs(model.eps) * top * top;
  const double stiffness_error = stiffness_uncertainty * model.k1 * run.closed.all;
  const double gain_error = 0.05 * model.gain * run.force_peak;
  margins["disturbance_bound"] = unbalance_error + stiffness_error + gain_error;
  const auto values = control::resolve_parameters(design);
  if (values.count("switching_gain") || values.count("gain_max")) {
    const double rho = values.count("switching_gain") ? values.at("switching_gain") : values.at("gain_max");
    const double bound = margins["disturbance_bound"];
    margins["kappa"] = rho - bound;
    if (rho <= bound) {
      design.summary.add({FindingCode::sliding_bound_missed,
                          Consequence::warning,
                          {{"switching gain", rho, "m/s^2"}, {"disturbance", bound, "m/s^2"}},
                          ""},
                         "; the law is a linear feedback inside its layer, and the certificate rests on its margins");
    }
    // Start of the record: whirl at the open-loop amplitude of the first segment.
    const double x0 = run.open.segment[0], c = values.at("surface_gain");
    const double r = values.count("exponent") ? values.at("exponent") : 1;
    const double scale = values.count("length_scale") ? values.at("length_scale") : 1e-3;
    const double linear = values.count("linear_gain") ? values.at("linear_gain") : 0;
    const double s0 = top * x0 + linear * x0 + c * scale * std::pow(x0 / scale, r);
    const double reach = control::reach_time(s0, rho, bound),
                 slide = control::slide_time_fast_terminal(x0, linear, c, r, scale);
    if (std::isfinite(reach)) margins["reach_time_s"] = reach;
    if (r < 1 && std::isfinite(slide)) margins["slide_time_s"] = slide;
  }
}

void put_delay(std::map<std::string, double>& margins, const DeliveredDelay& found) {
  margins["delay_margin_s"] = found.delay;
  margins["delay_limit"] = static_cast<int>(found.limit);
}

std::string limited_by(const std::map<std::string, double>& margins) {
  const auto limit = margins.find("delay_limit");
  if (limit == margins.end()) return {};
  return fmt::format(" (limited by: {})", name_of(static_cast<DelayLimit>(static_cast<int>(limit->second))));
}

/// What a design that is certified may be trusted for.
std::string trust_in(const std::map<std::string, double>& margins, const LoopMargins& loop, const Hardware& hardware,
                     double stiffness_uncertainty) {
  std::string text = fmt::format(
      "stable on the tuning plant with {:.1f} ms more delay{}, gain up to {:.2g} times and "
      "stiffness {:.0f} % lower; peak sensitivity {:.1f}, zone {}; peak at most {:.3f} mm with forces "
      "{:.0f} % stronger or weaker, axes {:.1f} degrees off, the profile reversed and the critical speed "
      "held; "
      "simulation only",
      1e3 * margins.at("delay_margin_s"), limited_by(margins), margins.at("gain_margin"), 100 * stiffness_uncertainty,
      loop.peak_sensitivity, loop.zone(), 1e3 * margins.at("peak_m"), 100 * kGainTolerance,
      kAxisTolerance * 180 / std::numbers::pi);
  if (!hardware.modes.empty()) {
    text += hardware.sign_cases().size() > 1
                ? "; structural modes of either sign, up to 1.5 times as strong and 0.2 % off in frequency"
                : "; structural modes of the sign found, up to 1.5 times as strong and 0.2 % off in frequency";
  }
  return text;
}

/// The assessment; not `whole`: it ends, uncertified, at the first requirement that is missed.
void assess_by(ControllerDesign& design, const DesignOptions& options, bool whole) {
  design.summary = {};
  design.margins.clear();
  for (const std::string& warning : control::design_warnings(design)) design.summary.warn(warning);

  const RotorModel& model = design.model;
  const auto [hardware, ringing, nominal, seed] = Certified(design, options);
  ControllerDesign trial = on_scenario(design, nominal);
  trial.parameters["supervise"] = 0;  // the certificate is that of the loop alone
  const ClosedLoopMetrics run = scenario_plant(nominal, model, hardware, seed).run(trial);
  auto& margins = design.margins;
  margins["certified"] = 0;
  margins["nominal_peak_m"] = run.closed.all;
  margins["open_peak_m"] = run.open.all;
  margins["excess_variation"] = trial.margins["excess_variation"] = run.excess_variation;
  CertificateRuns runs{"on its own tuning plant: " + run.verdict.text(), run.closed.all};
  if (run.verdict.passed())
    runs = certificate_runs(trial, ringing, run.closed.all, model, hardware, seed, options.threads);
  const std::string& refused = runs.refused;
  margins["peak_m"] = std::max(run.closed.all, runs.peak);
  margins["trip_displacement_m"] = trip_displacement(run.open.all, margins["peak_m"]);

  // Stiffness at its lower bound.
  const double left = (1 - options.stiffness_uncertainty) + static_control_stiffness(trial) / model.k1;
  margins["static_stiffness"] = left;
  TuningScenario soft = nominal;
  soft.stiffness = 1 - options.stiffness_uncertainty;
  const bool soft_stable = scenario_plant(soft, model, hardware, seed).run(trial).verdict.stable;
  if (!whole && (!refused.empty() || left <= 0 || !soft_stable)) return;

  const std::vector<SpeedMargins> speeds = margins_on(on_scenario(design, {}), model, hardware, options.threads);
  const LoopMargins loop = worst_margins(speeds);
  put_margins(margins, loop, design.sample_time);
  const std::optional<Finding> no_margin = margin_failure(speeds, trial);
  if (!whole && no_margin) return;

  add_supervision(design, options, run.open);
  ControllerDesign watched = on_scenario(design, ringing);
  watched.margins.clear();
  const std::string alarm = nominal_alarm(watched, ringing, model, hardware, seed, options.threads);
  if (!whole && !alarm.empty()) return;
  if (alarm.empty() && loop.stable)
    put_delay(margins, delivered_delay(design, loop.delay, model, hardware, seed, options.threads));
  const bool certified = refused.empty() && alarm.empty() && !no_margin && left > 0 && soft_stable;
  margins["certified"] = certified ? 1 : 0;
  add_sliding_margins(design, run, nominal, hardware, options.stiffness_uncertainty);
  design.summary.residual = run.closed.all;
  design.summary.trust =
      certified ? trust_in(margins, loop, hardware, options.stiffness_uncertainty) : "not certified: see the warnings";
  const double percent = 100 * options.stiffness_uncertainty;
  const auto missed = [&](std::string what, std::vector<Amount> amounts = {}) {
    design.summary.add({FindingCode::requirement_missed, Consequence::unusable, std::move(amounts), std::move(what)});
  };
  if (left <= 0) {
    missed(
        fmt::format("not certified: with the stiffness {:.0f} % lower the closed-loop stiffness is negative "
                    "({:.2f} of k1), the rotor would rest off centre; cancel less of it",
                    percent, left));
  } else if (!soft_stable) {
    missed(fmt::format("not certified: unstable with the stiffness {:.0f} % lower", percent));
  }
  if (!refused.empty()) missed("not certified: " + refused);
  if (no_margin) missed("not certified, " + no_margin->where, no_margin->amounts);
  if (!alarm.empty()) missed("not certified: " + alarm);
}

}  // namespace

void assess(ControllerDesign& design, const DesignOptions& options) { assess_by(design, options, true); }
void assess_until_missed(ControllerDesign& design, const DesignOptions& options) { assess_by(design, options, false); }

}  // namespace whirl::tuning
