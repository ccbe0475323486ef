// Faults of the force on the default rig: both actuators or one lost, of the wrong sign, 8 ms late; at top speed,
// above, near and below resonance; three noises each: 84 faults a design. Usage: bench_tuning_faults controller.json
// ...
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "whirl/control/controller.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace {

using namespace whirl;
using rig::RigAxis;
using rig::RigFault;

struct Kind {
  const char* name;
  double sign_x = 1, sign_y = 1;
  std::vector<rig::ScriptedFault> script = {};
};

std::vector<Kind> kinds(double t) {
  return {{"both lost", 1, 1, {{RigFault::actuator_loss, t, 1e9, RigAxis::both}}},
          {"x lost", 1, 1, {{RigFault::actuator_loss, t, 1e9, RigAxis::x}}},
          {"y lost", 1, 1, {{RigFault::actuator_loss, t, 1e9, RigAxis::y}}},
          {"8 ms late", 1, 1, {{RigFault::extra_delay, t, 1e9, RigAxis::both, 8}}},
          {"wrong sign of both", -1, -1},
          {"wrong sign of x", -1, 1},
          {"wrong sign of y", 1, -1}};
}

struct Found {
  double after = -1, motion = 0, largest = 0;  // s, m at the trip, m
};

Found run(const ControllerDesign& d, const std::shared_ptr<const rig::RigTables>& tables, const Kind& kind, double t,
          std::uint64_t seed) {
  control::Controller controller = control::make_controller(d);
  rig::VirtualRig rig(tables, {seed, kind.script});
  const rig::RigTruth truth(rig);
  Found out;
  for (; !rig.done(); rig.advance()) {
    const Measurement m = rig.read();
    if (m.t > t + 0.3) break;
    const auto u = controller.step(m);
    const bool wrong = m.t >= t;
    rig.write(u ? Command{(wrong ? kind.sign_x : 1) * u->ux, (wrong ? kind.sign_y : 1) * u->uy} : Command{});
    if (wrong) out.largest = std::max(out.largest, std::abs(truth.z()));
    if (!u) {
      out.after = m.t - t, out.motion = std::abs(truth.z());
      break;
    }
  }
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  rig::RigParameters p;
  const double peak = tuning::ClosedLoopPlant(p).open().all;
  const auto tables = rig::make_rig_tables(p);
  int faults = 0, missed = 0, late = 0, large = 0;
  double slowest = 0, largest = 0;
  for (int i = 1; i < argc; ++i) {
    const auto d = io::load<ControllerDesign>(argv[i]);
    const std::string name = d.law + ", " + d.estimator + (d.feedforward ? "" : ", no feedforward");
    for (const double t : {0.5123, 3.0123, 4.8371, 5.9117}) {
      for (const Kind& kind : kinds(t)) {
        for (std::uint64_t seed = 11; seed < 14; ++seed) {
          const Found f = run(d, tables, kind, t, seed);
          ++faults;
          const bool slow = f.after > 0.05, far = f.motion > 0.25 * peak;
          missed += f.after < 0, late += slow, large += far;
          slowest = std::max(slowest, f.after), largest = std::max(largest, f.motion);
          if (f.after < 0 || slow || far) {
            fmt::print("{:30} {:18} at {:.1f} s: {}, {:.2f} mm ({:.0f} %)\n", name, kind.name, t,
                       f.after < 0 ? "not found" : fmt::format("{:.0f} ms", 1e3 * f.after),
                       1e3 * (f.after < 0 ? f.largest : f.motion), 100 * (f.after < 0 ? f.largest : f.motion) / peak);
          }
        }
      }
    }
  }
  fmt::print(
      "{} faults of {} designs: {} not found, {} after more than 50 ms, {} above a quarter of {:.2f} mm; slowest "
      "{:.0f} "
      "ms, largest {:.2f} mm ({:.0f} %)\n",
      faults, argc - 1, missed, late, large, 1e3 * peak, 1e3 * slowest, 1e3 * largest, 100 * largest / peak);
}
