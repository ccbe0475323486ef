#include "whirl/shaft/control/passages.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>

#include "control/sampled_plant.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/shaft/control/plant_rows.hpp"
#include "whirl/shaft/modes.hpp"

namespace whirl::shaft {

using Eigen::Index;

namespace {

/// The entry of that name; throws Error with those that there are.
template <class Part>
const Part& named(const std::vector<Part>& parts, const std::string& name, const char* table) {
  std::string known;
  for (const Part& p : parts) {
    if (p.name == name) return p;
    known += (known.empty() ? "" : ", ") + p.name;
  }
  throw Error::in_field(table, name, "one of the rotor file: " + (known.empty() ? "it has none" : known));
}

double largest(const RotorRun& run, const std::vector<Index>& nodes, const ControlledPassage& p) {
  double size = 0;
  for (Index k = 0; k < run.time.size(); ++k) {
    if (run.speed[k] < p.from || run.speed[k] > p.to) continue;
    for (const Index node : nodes) size = std::max(size, std::hypot(run.x(node, k), run.y(node, k)));
  }
  return size;
}

}  // namespace

SampledForces sampled_forces(const Rotor& rotor, const System& system, const RotorController& controller, double noise,
                             std::uint64_t seed) {
  Rotor used = rotor;
  System pushed = system;
  used.probes.clear();
  used.actuators.clear();
  pushed.actuators.resize(static_cast<Index>(controller.actuators.size()), system.size());
  for (const Probe& p : controller.probes)
    used.probes.push_back(named(rotor.probes, p.name, "probe of the controller"));
  for (const Actuator& a : controller.actuators) {
    const Actuator& found = named(rotor.actuators, a.name, "actuator of the controller");
    pushed.actuators.row(static_cast<Index>(used.actuators.size())) =
        system.actuators.row(&found - rotor.actuators.data());
    used.actuators.push_back(found);
  }
  SampledForces forces;
  forces.period = controller.sample_time;
  forces.columns = actuator_columns(used, pushed);
  forces.bandwidth.resize(static_cast<Index>(used.actuators.size()));
  for (std::size_t k = 0; k < used.actuators.size(); ++k)
    forces.bandwidth[static_cast<Index>(k)] = used.actuators[k].bandwidth;
  forces.rows = probe_rows(used, system);
  // The machine's own limits hold, whatever the controller was designed for.
  RotorController limited = controller;
  for (std::size_t k = 0; k < used.actuators.size(); ++k) {
    Actuator& a = limited.actuators[k];
    a.force_limit = std::min(a.force_limit, used.actuators[k].force_limit);
    if (const double slew = used.actuators[k].slew; slew > 0) a.slew = a.slew > 0 ? std::min(a.slew, slew) : slew;
  }
  forces.start = [controller = limited, probes = used.probes, noise, seed]() -> SampledForces::Step {
    auto control = std::make_shared<RotorControl>(controller);
    return [control, probes, random = std::mt19937_64(seed), spread = std::normal_distribution<double>(0, noise),
            noise](Eigen::VectorXd y, double angle, double speed) mutable -> Eigen::VectorXd {
      for (std::size_t k = 0; k < probes.size(); ++k) y[static_cast<Index>(k)] += probes[k].runout_at(angle);
      if (noise > 0)
        for (double& reading : y) reading += spread(random);
      return control->step(y, angle, speed);
    };
  };
  return forces;
}

std::vector<ControlledPassage> passages(const System& system, const RotorRun* open, const RotorRun& closed,
                                        const std::vector<Index>& nodes) {
  System held = system;
  std::erase_if(held.supports, [](const Attachment& a) { return a.law.at(0).stiffness.trace() < 0; });
  const double low = closed.speed.minCoeff(), high = closed.speed.maxCoeff();
  std::vector<double> speeds;
  for (const Critical& c : criticals(held, 1.5 * high))
    if (c.direction > 0 && c.speed > 1e-3 * high && (speeds.empty() || c.speed > speeds.back() * (1 + 1e-6)))
      speeds.push_back(c.speed);
  std::vector<ControlledPassage> list;
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    if (speeds[k] < low || speeds[k] > high) continue;
    ControlledPassage p;
    p.speed = speeds[k];
    p.from = std::max(0.75 * p.speed, k > 0 ? (speeds[k - 1] + p.speed) / 2 : 0);
    p.to = std::min(1.25 * p.speed, k + 1 < speeds.size() ? (speeds[k + 1] + p.speed) / 2 : 1e300);
    p.open = open != nullptr ? largest(*open, nodes, p) : kNaN;
    p.closed = largest(closed, nodes, p);
    p.force = Eigen::VectorXd::Zero(closed.forces.rows());
    for (Index i = 0; i < closed.time.size(); ++i)
      if (closed.speed[i] >= p.from && closed.speed[i] <= p.to)
        p.force = p.force.cwiseMax(closed.forces.col(i).cwiseAbs()).eval();
    list.push_back(std::move(p));
  }
  return list;
}

}  // namespace whirl::shaft
