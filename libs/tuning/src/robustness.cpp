#include "whirl/tuning/robustness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

struct DrawnCondition {
  std::string name;
  std::function<void(rig::RigParameters&, ControllerDesign&, rig::RigRun&)> change;
};

/// Time at which the profile passes the natural frequency, s.
double critical_time(const rig::RigParameters& rig) {
  const double w = rig.natural_frequency(), end = rig.profile.duration();
  double best = 0, distance = 1e99;
  for (double t = 0; t < end; t += 0.01) {
    const double gap = std::abs(rig.profile.at(t).omega - w);
    if (gap < distance) distance = gap, best = t;
  }
  return best;
}

std::vector<DrawnCondition> conditions(const rig::RigParameters& nominal) {
  using P = rig::RigParameters;
  using D = ControllerDesign;
  const auto stiffness = [](double f) { return [f](P& p, D&, rig::RigRun&) { p.rotor.stiffness *= f; }; };
  const auto damping = [](double f) { return [f](P& p, D&, rig::RigRun&) { p.rotor.damping *= f; }; };
  const auto delay = [](int n, bool told) {
    return [n, told](P& p, D& d, rig::RigRun&) {
      p.actuator.extra_delay_samples += n;
      if (told) d.delay += n * d.sample_time;
    };
  };
  const auto modes = [](double f) {
    return [f](P& p, D&, rig::RigRun&) {
      for (rig::RigMode& mode : p.modes) mode.participation *= f;
    };
  };
  const auto limit = [](double f) {
    return [f](P& p, D& d, rig::RigRun&) {
      p.actuator.voltage_limit *= f;
      d.force_limit = p.actuator.force_limit();
    };
  };
  std::vector<DrawnCondition> all{
      {"nominal", [](P&, D&, rig::RigRun&) {}},
      {"K1 +30 %", stiffness(1.3)},
      {"K1 -30 %", stiffness(0.7)},
      {"C +50 %", damping(1.5)},
      {"C -50 %", damping(0.5)},
      {"2x unbalance",
       [](P& p, D&, rig::RigRun&) {
         p.rotor.residual_eccentricity *= 2;
         p.rotor.added_mass *= 2;
       }},
  };
  for (int n = 1; n <= 3; ++n) all.push_back({fmt::format("delay +{}, known", n), delay(n, true)});
  for (int n = 1; n <= 3; ++n) all.push_back({fmt::format("delay +{}, unknown", n), delay(n, false)});
  all.push_back({"modes x3", modes(3)});
  all.push_back({"modes x15", modes(15)});
  all.push_back({"force / 2", limit(0.5)});
  all.push_back({"force / 8", limit(0.125)});
  const double t = critical_time(nominal);
  all.push_back({"50 ms sensor loss", [t](P&, D&, rig::RigRun& r) {
                   r.faults.push_back({rig::RigFault::sensor_loss, t, t + 0.05, rig::RigAxis::both, 0});
                 }});
  all.push_back({"profile angle", [](P& p, D&, rig::RigRun&) { p.encoder.profile_angle = true; }});
  all.push_back({"speed ripple x5", [](P& p, D&, rig::RigRun&) { p.profile.ripple *= 5; }});
  all.push_back({"sensor noise x10", [](P& p, D&, rig::RigRun&) { p.laser.noise *= 10; }});
  all.push_back({"run-up", [](P& p, D&, rig::RigRun&) { p = p.run_up(); }});
  return all;
}

}  // namespace

std::vector<RobustnessCase> robustness_matrix(const ControllerDesign& design, const rig::RigParameters& rig,
                                              std::uint64_t seed, int threads) {
  const auto all = conditions(rig);
  std::vector<RobustnessCase> out(all.size());
  parallel_for(static_cast<int>(all.size()), threads, [&](int i) {
    const DrawnCondition& c = all[static_cast<std::size_t>(i)];
    rig::RigParameters p = rig;
    ControllerDesign d = design;
    ClosedLoopOptions options;
    options.run.seed = seed;
    c.change(p, d, options.run);
    // With less force than the task needs, saturation is the condition and no sign of instability.
    if (d.force_limit < design.force_limit) options.verdict.saturated = 1;
    out[static_cast<std::size_t>(i)] = {c.name, ClosedLoopPlant(p, options).run(d)};
  });
  return out;
}

}  // namespace whirl::tuning
