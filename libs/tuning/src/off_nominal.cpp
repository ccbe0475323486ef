#include "whirl/tuning/off_nominal.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "whirl/control/controller.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

constexpr double kChange = 4;  // s into the run: above the critical speed of the default profile

struct Condition {
  std::string name;
  std::function<void(rig::RigParameters&, rig::RigRun&)> change;
  double time = 0;
};

std::vector<Condition> conditions() {
  using P = rig::RigParameters;
  using R = rig::RigRun;
  std::vector<Condition> all;
  all.push_back({"balanced rotor", [](P& p, R&) { p.rotor.added_mass = 0; }});
  const auto unbalance = [](double factor) {
    return [factor](P& p, R&) { p.rotor.residual_eccentricity *= factor, p.rotor.added_mass *= factor; };
  };
  all.push_back({"half the unbalance", unbalance(0.5)});
  all.push_back({"twice the unbalance", unbalance(2)});
  all.push_back({"unbalance turned by 180 deg",
                 [](P& p, R&) { p.rotor.residual_phase += 3.14159265, p.rotor.added_phase += 3.14159265; }});
  all.push_back({"5 g lost in mid-run",
                 [](P& p, R& r) {
                   const std::complex<double> before = p.eccentricity();
                   P without = p;
                   without.rotor.added_mass = 0;
                   rig::ScriptedFault f{rig::RigFault::unbalance, kChange, 1e9};
                   f.factor = before != 0.0 ? without.eccentricity() / before : 1.0;
                   r.faults.push_back(f);
                 },
                 kChange});
  for (const double error : {-0.3, -0.15, 0.15, 0.3}) {
    all.push_back(
        {fmt::format("actuator gain {:+.0f} %", 100 * error), [error](P& p, R&) { p.actuator.gain_error = error; }});
  }
  for (const int n : {1, 2, 3}) {
    all.push_back({fmt::format("delay +{}", n), [n](P& p, R&) { p.actuator.extra_delay_samples += n; }});
  }
  all.push_back({"modes of the other sign, x3", [](P& p, R&) {
                   for (rig::RigMode& m : p.modes) m.sensor_sign = -m.sensor_sign, m.participation *= 3;
                 }});
  all.push_back({"stiffness -30 %", [](P& p, R&) { p.rotor.stiffness *= 0.7; }});
  all.push_back({"stiffness +30 %", [](P& p, R&) { p.rotor.stiffness *= 1.3; }});
  all.push_back({"sensor lost for 50 ms",
                 [](P&, R& r) {
                   r.faults.push_back({rig::RigFault::sensor_loss, kChange, kChange + 0.05});
                 },
                 kChange});
  all.push_back({"sensor lost",
                 [](P&, R& r) {
                   r.faults.push_back({rig::RigFault::sensor_loss, kChange, 1e9});
                 },
                 kChange});
  all.push_back({"encoder slipped by 90 deg",
                 [](P&, R& r) {
                   rig::ScriptedFault f{rig::RigFault::encoder_slip, kChange, 1e9};
                   f.angle = 1.5707963267948966;
                   r.faults.push_back(f);
                 },
                 kChange});
  return all;
}

double worst(const ClosedLoopMetrics& m) {
  constexpr double kSmall = 50e-6;
  double ratio = 0;
  for (std::size_t i = 0; i < m.open.segment.size(); ++i) {
    if (m.open.segment[i] > kSmall) ratio = std::max(ratio, m.closed.segment[i] / m.open.segment[i]);
  }
  return ratio;
}

}  // namespace

std::vector<OffNominalCase> off_nominal(const ControllerDesign& design, const rig::RigParameters& rig,
                                        std::uint64_t seed, int threads) {
  const auto all = conditions();
  std::vector<OffNominalCase> out(all.size());
  parallel_for(static_cast<int>(all.size()), threads, [&](int i) {
    const Condition& c = all[static_cast<std::size_t>(i)];
    rig::RigParameters p = rig;
    ClosedLoopOptions options;
    options.run.seed = seed;
    options.skip = 0.3;
    c.change(p, options.run);
    const ClosedLoopPlant plant(p, options);
    OffNominalCase& r = out[static_cast<std::size_t>(i)];
    r.name = c.name;
    r.change = c.time;
    ControllerDesign d = design;
    d.parameters["supervise"] = 0;
    r.without = plant.run(d);
    d.parameters["supervise"] = 1;
    r.with = plant.run(d);
    r.worst_without = worst(r.without);
    r.worst_with = worst(r.with);
    r.word = r.with.supervision;
    if (r.with.supervised >= 0) r.detected = r.with.supervised - c.time;
  });
  return out;
}

}  // namespace whirl::tuning
