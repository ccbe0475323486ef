#include "whirl/tuning/delivered_delay.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "runs/design_scenarios.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

constexpr int kTried = 12;  // samples

/// When the delay begins, s: with the run, soon after it, and on the way through the profile.
std::vector<double> onsets(const rotor::SpeedProfile& profile) {
  constexpr double kSoon = 0.5, kSteps = 7;
  std::vector<double> out{0, kSoon};
  for (int k = 1; k <= 3; ++k) out.push_back(std::max(kSoon, k * profile.ramp_time / kSteps));
  return out;
}

DelayLimit limit_of(const ClosedLoopMetrics& run, double bound) {
  if ((run.supervision & control::kUnheld) != 0) return DelayLimit::supervision;
  if (run.closed.all > bound) return DelayLimit::bound;
  return run.verdict.stable ? DelayLimit::none : DelayLimit::stability;
}

}  // namespace

std::string_view name_of(DelayLimit limit) {
  switch (limit) {
    case DelayLimit::none:
      return "no delay that was tried";
    case DelayLimit::stability:
      return "stability";
    case DelayLimit::supervision:
      return "supervision";
    case DelayLimit::bound:
      return "bound";
  }
  return {};
}

double stated_delay(double stability, double sample_time) { return std::min(stability, kTried * sample_time); }

DeliveredDelay delivered_delay(const ControllerDesign& delivered, double stability, const RotorModel& model,
                               const Hardware& hardware, std::uint64_t seed, int threads) {
  const double h = delivered.sample_time, most = stated_delay(stability, h);
  // No stiffness of that scenario is another.
  const TuningScenario ringing = tuning_scenarios(hardware, 0).front();
  ControllerDesign design = on_scenario(delivered, ringing);
  const auto stated = design.margins.find("trip_displacement_m");
  const double bound = stated != design.margins.end() ? stated->second : std::numeric_limits<double>::infinity();
  design.margins.clear();  // its own margins are not judged here
  const ClosedLoopPlant plant = scenario_plant(ringing, model, hardware, seed);
  const std::vector<double> from = onsets(hardware.profile);
  for (int n = 1; n * h <= most; ++n) {
    std::vector<DelayLimit> found(from.size());
    parallel_for(static_cast<int>(from.size()), threads, [&](int i) {
      const auto at = static_cast<std::size_t>(i);
      rig::ScriptedFault late{rig::RigFault::extra_delay, from[at], std::numeric_limits<double>::max()};
      late.delay_samples = n;
      found[at] = limit_of(plant.run(design, nullptr, 0, {late}), bound);
    });
    for (const DelayLimit limit : {DelayLimit::supervision, DelayLimit::bound, DelayLimit::stability}) {
      if (std::ranges::find(found, limit) != found.end()) return {(n - 0.5) * h, limit};
    }
  }
  return {most, most < stability ? DelayLimit::none : DelayLimit::stability};
}

std::optional<DeliveredDelay> delivered_delay(const ControllerDesign& design, const std::vector<MarginStudy>& studies,
                                              const IdentifiedModel& model, const DesignOptions& plant) {
  double least = std::numeric_limits<double>::infinity();
  for (const MarginStudy& study : studies) {
    const LoopMargins worst = worst_margins(study.speeds);
    least = std::min(least, worst.stable ? worst.delay : 0);
  }
  if (!(least > 0)) return std::nullopt;
  RotorModel rotor = *model.rotor;
  if (plant.gain > 0) rotor.gain = plant.gain;
  if (!(rotor.gain > 0)) rotor.gain = design.model.gain;
  const Hardware hardware = tuning_hardware(design, with_forces(plant.hardware, model));
  return delivered_delay(design, least, rotor, hardware, plant.seed + 1000, plant.threads);
}

}  // namespace whirl::tuning
