#include "whirl/shaft/control/design.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "control/closed_loop.hpp"
#include "control/laws/law.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/distrust.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

constexpr const Law* kLaws[] = {&kLqg, &kPid};

constexpr int kTurningSpeeds = 120;
constexpr double kCancelled = 1e-3;  // of a command: what is left of it

double speed_at(const ControlOptions& o, int k, int count) {
  return count < 2 ? o.to : o.from + (o.to - o.from) * k / (count - 1);
}

constexpr LoopChange kLoopChanges[] = {{}, {.gain = 0.8}, {.gain = 1.2}, {.delay = 1}};

const Law& law_of(const ControlOptions& o) {
  for (const Law* law : kLaws)
    if (law->name == o.law) return *law;
  throw Error::in_field("law", o.law, fmt::format("{}", fmt::join(control_laws(), ", ")));
}

class Designer {
 public:
  Designer(const Rotor& rotor, const ControlOptions& o) : o_(o), plants_(rotor, assemble(rotor), o.modes) {
    task_.sample_time = o.sample_time;
    task_.probes = rotor.probes;
    task_.actuators = rotor.actuators;
    const int count = o.from < o.to ? o.schedule : 1;
    for (int k = 0; k < count; ++k) {
      task_.speeds.push_back(speed_at(o, k, count));
      task_.plants.push_back(plants_.at(task_.speeds.back(), o.sample_time));
    }
  }

  /// Feedback by the gains of a law; false where these numbers have none.
  bool feedback(const LawGains& gains, const std::vector<double>& numbers, RotorController& c) const {
    c = {};
    c.sample_time = o_.sample_time;
    c.probes = task_.probes;
    c.actuators = task_.actuators;
    c.gains = gains(numbers);
    return !c.gains.empty();
  }

  /// The turning part: least squares of all readings, at speeds close enough for its changes.
  void turning(RotorController& c) const {
    const int count = o_.from < o_.to ? kTurningSpeeds : 1;
    c.adaptation = o_.adaptation;
    c.synchronous.clear();
    for (int k = 0; k < count; ++k) {
      const double speed = speed_at(o_, k, count);
      const ClosedLoop loop(plants_.at(speed, o_.sample_time), c, speed, {.synchronous = false});
      const LineResponse line = loop.line(speed);
      const MatrixXcd &influence = line.influence, &acting = line.of_commands;
      const Index p = influence.rows(), m = influence.cols();
      if (acting.norm() < kCancelled) {
        // The feedback takes away whatever is commanded, as an integral does at rest: nothing is to be learned.
        c.synchronous.push_back({speed, MatrixXcd::Zero(m, p), MatrixXcd::Zero(m, m), VectorXcd::Zero(m), limits(c)});
        continue;
      }
      // Near a speed at which the readings do not answer to some forces, those would grow without use.
      const double weight = o_.force_weight * influence.norm() / acting.norm();
      MatrixXcd both(p + m, m);
      both << influence, weight * acting;
      const MatrixXcd inverse =
          Eigen::PartialPivLU<MatrixXcd>(MatrixXcd(both.adjoint() * both)).solve(MatrixXcd(both.adjoint()));
      SynchronousGains g{speed, inverse.leftCols(p), weight * inverse.rightCols(m), VectorXcd::Zero(m), limits(c)};
      const VectorXcd open = plants_.unbalance_readings(speed);
      if (o_.unbalance_known)
        g.start = -g.correction * (line.output_sensitivity * open) - g.relief * (line.of_readings * open);
      for (Index j = 0; j < g.start.size(); ++j) {
        g.most[j] /= std::min(1.0, std::abs(acting(j, j)));
        if (std::abs(g.start[j]) > g.most[j]) g.start[j] *= g.most[j] / std::abs(g.start[j]);
      }
      c.synchronous.push_back(std::move(g));
    }
    // It must not learn faster than the loop settles.
    for (int halvings = 0; halvings < 12 && !learns(c); ++halvings) c.adaptation /= 2;
  }
  /// What the turning part may command where the feedback leaves it as it is, N.
  VectorXd limits(const RotorController& c) const {
    VectorXd most(static_cast<Index>(c.actuators.size()));
    for (Index j = 0; j < most.size(); ++j) most[j] = o_.share * c.actuators[static_cast<std::size_t>(j)].force_limit;
    return most;
  }
  bool learns(const RotorController& c) const {
    for (std::size_t k = 0; k < task_.plants.size(); ++k)
      for (const LoopChange& change : kLoopChanges)
        if (!ClosedLoop(task_.plants[k], c, task_.speeds[k], change).stable()) return false;
    return true;
  }

  /// Least damping ratio over the schedule where the loop is allowed, as far as it is of use, less a hundredth for
  /// every decade of force that noise of the probes makes; below -1 elsewhere, the less the better. Where it falls
  /// below `least`, a bound of it that does too.
  double score(const RotorController& c, double least) const {
    constexpr double kEnough = 0.2;
    for (std::size_t k = 0; k < task_.plants.size(); ++k)
      for (LoopChange change : kLoopChanges) {
        change.synchronous = false;
        if (!ClosedLoop(task_.plants[k], c, task_.speeds[k], change).decays()) return -1e9;
      }
    double damping = kEnough, peak = 0, noise = 0;
    const auto so_far = [&] { return peak < 0.97 * o_.sensitivity ? damping - 0.01 * std::log10(noise) : -1 - peak; };
    for (std::size_t k = 0; k < task_.plants.size(); ++k) {
      const ClosedLoop loop(task_.plants[k], c, task_.speeds[k], {.synchronous = false});
      damping = std::min(damping, least_damping(loop.poles()));
      noise = std::max(noise, loop.force_noise().maxCoeff());
      if (so_far() < least) break;
      peak = std::max(peak, loop.sensitivity_peak().maxCoeff());
      if (so_far() < least) break;
    }
    return so_far();
  }

  double least_damping(const auto& poles) const {
    double least = 1;
    for (const std::complex<double> p : poles)
      if (std::abs(p) < 1.2 * o_.to && p.imag() >= 0) least = std::min(least, -p.real() / std::abs(p));
    return least;
  }
  const PlantFamily& plants() const { return plants_; }
  const LawTask& task() const { return task_; }

 private:
  ControlOptions o_;
  PlantFamily plants_;
  LawTask task_;
};

void require_options(const Rotor& rotor, const ControlOptions& o) {
  if (rotor.actuators.empty()) throw Error("no [[actuator]] in the rotor file: a controller needs at least one");
  if (rotor.probes.empty()) throw Error("no [[probe]] in the rotor file: a controller needs at least one");
  require_range("sample time", o.sample_time, 1e-6, 1, "s");
  require_range("modes", o.modes, 1, 100);
  require_range("speeds of the schedule", o.schedule, 1, 1000);
  require_range("highest speed", o.to, 1e-6, 0.5 * kPi / o.sample_time, "rad/s");
  require_range("lowest speed", o.from, 0, o.to, "rad/s");
}

struct Checked {
  ControlCase with;
  LoopChange change;
  double rotating = 1;
  bool full = false;
};
constexpr Checked kCases[] = {{ControlCase::nominal, {}},
                              {ControlCase::rotating_damping, {}, 2},
                              {ControlCase::gain_low, {.gain = 0.8}},
                              {ControlCase::gain_high, {.gain = 1.2}},
                              {ControlCase::delay, {.delay = 1}},
                              {ControlCase::full_model, {}, 1, true}};

/// What acts at one turn after the start, feedback and turning part together.
VectorXd turning_force(const PlantFamily& plants, const ClosedLoop& loop, const RotorController& c, double speed) {
  const VectorXcd start = c.synchronous_at(speed).start, open = plants.unbalance_readings(speed);
  const LineResponse line = loop.line(speed);
  return (line.of_commands * start + line.of_readings * open).cwiseAbs();
}

void look(const ControlOptions& o, const Designer& designer, ControlDesign& d) {
  const RotorController& c = d.controller;
  for (int k = 0; k < o.checked; ++k) {
    const double speed = speed_at(o, k, o.checked);
    const SampledPlant plant = designer.plants().at(speed, c.sample_time);
    const ClosedLoop loop(plant, c, speed, {.synchronous = false}), all(plant, c, speed);
    ControlPoint p;
    p.speed = speed;
    p.open_damping = designer.least_damping(designer.plants().poles(speed));
    p.closed_damping = designer.least_damping(loop.poles());
    p.growth = all.growth();
    p.sensitivity = loop.sensitivity_peak();
    p.turning_force = turning_force(designer.plants(), loop, c, speed);
    d.force_noise = std::max(d.force_noise, loop.force_noise().maxCoeff());
    d.worst_sensitivity = std::max(d.worst_sensitivity, p.sensitivity.maxCoeff());
    d.points.push_back(std::move(p));
  }
}

/// Plants that a loop must hold on. They do not depend on the controller, and a design tries several: each is made
/// once.
class Trials {
 public:
  Trials(const Rotor& rotor, const ControlOptions& o) : rotor_(rotor), o_(o), system_(assemble(rotor)) {}

  /// Cases in which the loop is unstable, with the first speed of each; the `first` of them alone where that is enough.
  std::vector<ControlRefusal> refusals(const RotorController& c, bool first = false) {
    std::vector<ControlRefusal> refused;
    for (const Checked& check : kCases) {
      const int count = check.full ? std::min(o_.checked, 2 * o_.schedule - 1) : o_.checked;
      for (int k = 0; k < count; ++k) {
        const double speed = speed_at(o_, k, count);
        if (ClosedLoop(plant(check, k, speed, c.sample_time), c, speed, check.change).stable()) continue;
        refused.push_back({check.with, speed});
        if (first) return refused;
        break;
      }
    }
    return refused;
  }

 private:
  const SampledPlant& plant(const Checked& check, int k, double speed, double sample_time) {
    const std::pair kind(check.full, check.rotating);
    auto family = families_.find(kind);
    if (family == families_.end()) {
      family = families_.emplace(kind, PlantFamily(rotor_, system_, check.full ? 0 : o_.modes)).first;
      family->second.scale_rotating(check.rotating);
    }
    const std::pair at(kind, k);
    auto found = plants_.find(at);
    if (found == plants_.end()) found = plants_.emplace(at, family->second.at(speed, sample_time)).first;
    return found->second;
  }

  using Kind = std::pair<bool, double>;  // all modes; factor of the damping that turns
  const Rotor& rotor_;
  const ControlOptions& o_;
  System system_;
  std::map<Kind, PlantFamily> families_;
  std::map<std::pair<Kind, int>, SampledPlant> plants_;
};

void judge(const Rotor& rotor, const ControlOptions& o, ControlDesign& d) {
  const RotorController& c = d.controller;
  carry_distrust(rotor, Consequence::unusable, d.summary);
  for (const ControlRefusal& r : d.refused)
    d.summary.add({FindingCode::requirement_missed,
                   Consequence::unusable,
                   {{"speed", r.speed, "rad/s"}},
                   fmt::format("unstable at {:.0f} rpm {}", r.speed * kRpmPerRadPerSec, to_text(r.with))});
  for (std::size_t j = 0; j < c.actuators.size(); ++j) {
    const auto most = std::ranges::max_element(
        d.points, {}, [&](const ControlPoint& p) { return p.turning_force[static_cast<Index>(j)]; });
    const double force = most->turning_force[static_cast<Index>(j)], limit = c.actuators[j].force_limit;
    if (force > limit)
      d.summary.add({FindingCode::requirement_missed,
                     Consequence::warning,
                     {{"value", force, "N"}, {"most", limit, "N"}},
                     fmt::format("turning force of actuator {} at {:.0f} rpm", c.actuators[j].name,
                                 most->speed * kRpmPerRadPerSec)});
  }
  Index worst = 0;
  for (const ControlPoint& p : d.points) {
    p.sensitivity.maxCoeff(&worst);
    if (p.sensitivity[worst] != d.worst_sensitivity || !(d.worst_sensitivity > o.sensitivity)) continue;
    d.summary.add({FindingCode::requirement_missed,
                   d.worst_sensitivity < 5 ? Consequence::warning : Consequence::unusable,
                   {{"value", d.worst_sensitivity}, {"most", o.sensitivity}},
                   "peak of the sensitivity of actuator " + c.actuators[static_cast<std::size_t>(worst)].name});
    break;
  }
}

}  // namespace

char sensitivity_zone(double peak) { return peak < 3 ? 'A' : peak < 4 ? 'B' : peak < 5 ? 'C' : 'D'; }

namespace {

struct CaseText {
  ControlCase with;
  std::string_view name, words;
};
constexpr CaseText kCaseTexts[] = {
    {ControlCase::nominal, "nominal", "as designed"},
    {ControlCase::rotating_damping, "rotating_damping", "with twice the damping that turns with the shaft"},
    {ControlCase::full_model, "full_model", "with all modes in place of the reduced model"},
    {ControlCase::gain_low, "gain_low", "with 20 % less gain"},
    {ControlCase::gain_high, "gain_high", "with 20 % more gain"},
    {ControlCase::delay, "delay", "with one sample more delay"}};

}  // namespace

std::string to_string(ControlCase c) { return std::string(kCaseTexts[static_cast<std::size_t>(c)].name); }
std::string to_text(ControlCase c) { return std::string(kCaseTexts[static_cast<std::size_t>(c)].words); }

namespace {

/// The controller's probes or actuators are those of the rotor, in the same order.
template <class Part>
void require_same(const char* what, const std::vector<Part>& of_rotor, const std::vector<Part>& of_controller) {
  const auto names = [](const std::vector<Part>& parts) {
    std::string list;
    for (const Part& p : parts) list += (list.empty() ? "" : ", ") + p.name;
    return list;
  };
  if (names(of_rotor) != names(of_controller))
    throw Error::in_field(fmt::format("{}s of the controller", what), names(of_controller),
                          "those of the rotor file, in its order: " + names(of_rotor));
}

}  // namespace

ControlDesign check_rotor_control(const Rotor& rotor, const RotorController& controller, const ControlOptions& o) {
  require_options(rotor, o);
  check(controller);
  require_same("probe", rotor.probes, controller.probes);
  require_same("actuator", rotor.actuators, controller.actuators);
  ControlDesign d;
  d.controller = controller;
  look(o, Designer(rotor, o), d);
  d.refused = Trials(rotor, o).refusals(controller);
  judge(rotor, o, d);
  return d;
}

namespace {

/// Every combination of the numbers of a law.
std::vector<std::vector<double>> tried(const Law& law, const ControlOptions& o) {
  std::vector<std::vector<double>> all{{}};
  for (const LawNumber& number : law.numbers) {
    const double low = number.low * (number.unit == "1/s" ? 1 / o.sample_time : 1);
    std::vector<std::vector<double>> longer;
    for (const std::vector<double>& before : all)
      for (int k = 0; k < number.count; ++k) {
        longer.push_back(before);
        longer.back().push_back(low * std::pow(number.high / number.low, k / (number.count - 1.0)));
      }
    all = std::move(longer);
  }
  return all;
}

}  // namespace

std::vector<std::string> control_laws() {
  std::vector<std::string> names;
  for (const Law* law : kLaws) names.emplace_back(law->name);
  return names;
}

ControlDesign design_rotor_control(const Rotor& rotor, const ControlOptions& o) {
  constexpr int kTried = 8;
  require_options(rotor, o);
  const Law& law = law_of(o);
  const Designer designer(rotor, o);
  const LawGains gains = law.gains_on(designer.task());
  std::vector<std::pair<double, std::vector<double>>> ranked;
  std::vector<double> best_scores;  // of the first kTried, descending
  for (const std::vector<double>& numbers : tried(law, o)) {
    RotorController c;
    if (!designer.feedback(gains, numbers, c)) continue;
    const double score = designer.score(c, best_scores.size() < kTried ? -1e300 : best_scores.back());
    ranked.emplace_back(score, numbers);
    best_scores.insert(std::ranges::upper_bound(best_scores, score, std::ranges::greater()), score);
    if (best_scores.size() > kTried) best_scores.pop_back();
  }
  if (ranked.empty())
    throw Error("no controller: an unstable or undamped mode is out of reach of the actuators or the probes");
  std::ranges::stable_sort(ranked, std::ranges::greater(), [](const auto& one) { return one.first; });
  ControlDesign best;
  Trials trials(rotor, o);
  for (std::size_t k = 0; k < std::min<std::size_t>(kTried, ranked.size()); ++k) {
    const std::vector<double>& numbers = ranked[k].second;
    ControlDesign d;
    designer.feedback(gains, numbers, d.controller);
    designer.turning(d.controller);
    d.refused = trials.refusals(d.controller, k > 0);  // of those tried later only one without counts
    d.law = law.name;
    for (std::size_t i = 0; i < numbers.size(); ++i)
      d.numbers.push_back({std::string(law.numbers[i].name), numbers[i], std::string(law.numbers[i].unit)});
    const bool allowed = d.refused.empty();
    if (k == 0 || allowed) best = std::move(d);
    if (allowed) break;
  }
  look(o, designer, best);
  judge(rotor, o, best);
  return best;
}

}  // namespace whirl::shaft
