#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>

#include "design_scenarios.hpp"
#include "robustness_parallel.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/times.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {
namespace {

constexpr int kMaxExtraDelay = 6;  // samples tried

/// Restoring acceleration per metre that the controller adds against a displacement held still, 1/s^2.
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

/// Largest value of a grown quantity that stays stable, by bisection between a stable and an unstable one.
double largest_stable(double stable, double unstable, int steps, const std::function<bool(double)>& is_stable) {
  for (int i = 0; i < steps; ++i) {
    const double middle = 0.5 * (stable + unstable);
    (is_stable(middle) ? stable : unstable) = middle;
  }
  return stable;
}

/// Why the design fails on the structure that may be there: signs that are not known, modes 1.5 times as strong; empty:
/// it holds for all of it.
std::string sign_refusals(const ControllerDesign& trial, const TuningScenario& nominal, const RotorModel& model,
                          const Hardware& hardware, std::uint64_t seed, int threads) {
  if (hardware.modes.empty()) return {};
  const std::vector<Hardware> cases = hardware.sign_cases();
  std::vector<std::string> text(2 * cases.size());
  parallel_for(static_cast<int>(text.size()), threads, [&](int i) {
    const auto index = static_cast<std::size_t>(i);
    const Hardware& h = cases[index / 2];
    TuningScenario s = nominal;
    s.modes = i % 2 == 0 ? 1 : 1.5;
    const Verdict verdict = scenario_plant(s, model, h, seed).run(trial).verdict;
    if (verdict.passed()) return;
    const std::string signs = hardware.signs_of(h);
    text[index] = fmt::format("{}{}: {}", signs.empty() ? "with the structural modes" : "with " + signs,
                              s.modes > 1 ? " 1.5 times as strong" : "", verdict.text());
  });
  std::string out;
  for (const std::string& reason : text) {
    if (!reason.empty()) out += (out.empty() ? "" : "; ") + reason;
  }
  return out;
}

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
      design.summary.warn(
          fmt::format("eq. 42 is not met: switching gain {:.3g} m/s^2 against a disturbance bound of {:.3g} "
                      "m/s^2; the sliding mode is a linear feedback inside its layer here",
                      rho, bound));
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

}  // namespace

void assess(ControllerDesign& design, const DesignOptions& options) {
  design.summary = {};
  design.margins.clear();
  for (const std::string& warning : control::design_warnings(design)) design.summary.warn(warning);

  const RotorModel& model = design.model;
  const Hardware hardware = tuning_hardware(design, options.hardware);
  const auto scenarios = tuning_scenarios(hardware, options.stiffness_uncertainty);
  const TuningScenario& nominal = scenarios[0];
  ControllerDesign trial = on_scenario(design, nominal);
  const std::uint64_t seed = options.seed + 1000;  // not the seed of the tuning
  const ClosedLoopMetrics run = scenario_plant(nominal, model, hardware, seed).run(trial);
  auto& margins = design.margins;
  margins["peak_m"] = run.closed.all;
  margins["open_peak_m"] = run.open.all;
  margins["excess_variation"] = trial.margins["excess_variation"] = run.excess_variation;
  margins["trip_displacement_m"] = std::min(std::max(0.5 * run.open.all, 4 * run.closed.all), 0.9 * run.open.all);
  const std::string refused = run.verdict.passed()
                                  ? sign_refusals(trial, nominal, model, hardware, seed, options.threads)
                                  : "on its own tuning plant: " + run.verdict.text();

  // Unknown delay, in whole samples, and gain.
  std::array<bool, kMaxExtraDelay + 1> stable{};
  parallel_for(kMaxExtraDelay + 1, options.threads, [&](int extra) {
    TuningScenario s = nominal;
    s.extra_delay = extra;
    stable[static_cast<std::size_t>(extra)] = scenario_plant(s, model, hardware, seed).run(trial).verdict.stable;
  });
  int delay = 0;
  while (delay < kMaxExtraDelay && stable[static_cast<std::size_t>(delay) + 1]) ++delay;
  margins["delay_margin_s"] = delay * design.sample_time;
  const auto gain_stable = [&](double factor) {
    Hardware h = hardware;
    h.actuator.gain_error = factor - 1;
    return scenario_plant(nominal, model, h, seed).run(trial).verdict.stable;
  };
  double low = 1, high = 1;
  while (high < 5 && gain_stable(high * 1.5)) low = high *= 1.5;
  margins["gain_margin"] = high >= 5 ? high : largest_stable(low, high * 1.5, 3, gain_stable);

  // Stiffness at its lower bound.
  const double left = (1 - options.stiffness_uncertainty) + static_control_stiffness(trial) / model.k1;
  margins["static_stiffness"] = left;
  TuningScenario soft = nominal;
  soft.stiffness = 1 - options.stiffness_uncertainty;
  const bool soft_stable = scenario_plant(soft, model, hardware, seed).run(trial).verdict.stable;
  const bool certified = refused.empty() && left > 0 && soft_stable;
  margins["certified"] = certified ? 1 : 0;
  const double percent = 100 * options.stiffness_uncertainty;
  if (left <= 0) {
    design.summary.warn(
        fmt::format("not certified: with the stiffness {:.0f} % lower the closed-loop stiffness is negative "
                    "({:.2f} of k1), the rotor would rest off centre; cancel less of it",
                    percent, left));
  } else if (!soft_stable) {
    design.summary.warn(fmt::format("not certified: unstable with the stiffness {:.0f} % lower", percent));
  }

  add_sliding_margins(design, run, nominal, hardware, options.stiffness_uncertainty);
  design.summary.residual = run.closed.all;
  design.summary.trust = certified
                             ? fmt::format(
                                   "stable on the tuning plant with {} unknown samples of delay, gain up to {:.2g} "
                                   "times and stiffness {:.0f} % lower; simulation only",
                                   delay, margins["gain_margin"], percent)
                             : "not certified: see the warnings";
  if (certified && !hardware.modes.empty()) {
    design.summary.trust += hardware.sign_cases().size() > 1
                                ? "; structural modes of either sign, up to 1.5 times as strong"
                                : "; structural modes of the sign found, up to 1.5 times as strong";
  }
  if (!refused.empty()) design.summary.fail("not certified: " + refused);
}

}  // namespace whirl::tuning
