#include "whirl/shaft/centrifuge/passage_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/transient.hpp"

namespace whirl::shaft {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr int kHalvings = 12;    // of the logarithm of the acceleration
constexpr double kClose = 0.03;  // of an acceleration
constexpr double kSamplesPerTurn = 12;

struct Place {
  std::string name;
  Eigen::Index node;
};

struct Peak {
  double size = 0;
  std::string place;
};

/// The machine with the allowed imbalance and half of its tubes.
Rotor loaded(const Rotor& rotor, const CentrifugeSetup& setup) {
  Rotor r = rotor;
  r.unbalances = {{setup.plane, setup.plane, setup.allowed * setup.radius, setup.first_bucket}};
  r.bow.clear();
  if (setup.load > 0) {
    const double polar = 0.5 * setup.load * setup.radius * setup.radius;
    r.discs.push_back({"load", setup.plane, 0.5 * setup.load, polar / 2, polar, 0});
  }
  return r;
}

class Passages {
 public:
  /// `drawn`: the rotor of the file, whose probes or discs are looked at; `machine`: as it runs.
  Passages(const Rotor& drawn, const Rotor& machine, const PassageOptions& options) : o_(options) {
    const System full = assemble(machine);
    system_ = reduce(full, {.modes = 8, .static_shapes = true, .highest = o_.highest}).system;
    for (const Critical& c : criticals(full, o_.highest))
      if (c.direction > 0) speeds_.push_back(c.speed);
    std::ranges::sort(speeds_);
    for (const Probe& p : drawn.probes) places_.push_back({p.name, full.node_at(p.position)});
    if (places_.empty())
      for (const Disc& d : drawn.discs) places_.push_back({d.name, full.node_at(d.position)});
    if (places_.empty()) throw Error("the rotor file has no [[probe]] and no [[disc]]: nothing to look at");
  }

  std::size_t count() const { return speeds_.size(); }

  Passage passage(std::size_t k) const {
    Passage p;
    p.critical = speeds_[k];
    // From the middle between two critical speeds to the next, and no further than the motion rings.
    p.from = std::max(0.6 * p.critical, k > 0 ? 0.5 * (speeds_[k - 1] + p.critical) : 0.0);
    p.to = std::min(1.4 * p.critical, k + 1 < speeds_.size() ? 0.5 * (p.critical + speeds_[k + 1]) : kInf);
    const Peak slow = peak(p, o_.slowest), fast = peak(p, o_.fastest);
    p.peak_slow = slow.size;
    Peak kept = slow;
    if (slow.size > o_.limit) {
      kept = fast;
      p.needed = kInf;
    }
    if (slow.size > o_.limit && fast.size <= o_.limit) {
      double low = std::log(o_.slowest), high = std::log(o_.fastest);
      for (int i = 0; i < kHalvings && high - low > kClose; ++i) {
        const Peak middle = peak(p, std::exp(0.5 * (low + high)));
        (middle.size <= o_.limit ? high : low) = 0.5 * (low + high);
        if (middle.size <= o_.limit) kept = middle;
      }
      p.needed = std::exp(high);
    }
    p.peak = kept.size;
    p.place = kept.place;
    return p;
  }

  Peak peak(const Passage& p, double acceleration) const {
    RunOptions run;
    run.from = p.from;
    run.to = p.to;
    run.duration = (p.to - p.from) / acceleration;
    run.sample_time = std::min(kTwoPi / p.to / kSamplesPerTurn, run.duration / 200);
    run.tolerance = 1e-3;
    const RotorRun motion = simulate_run(system_, run);
    if (!motion.x.allFinite()) return {kInf, places_.front().name};
    Peak most{-1, {}};
    for (const Place& place : places_)
      if (const RunPeak r = run_peak(motion, place.node); r.size > most.size) most = {r.size, place.name};
    return most;
  }

 private:
  PassageOptions o_;
  System system_;
  std::vector<double> speeds_;
  std::vector<Place> places_;
};

/// What every passage needs against what the drive can.
void judge(PassagePlan& plan, const PassageOptions& o) {
  for (const Passage& p : plan.passages) {
    const double rpm = p.critical * kRpmPerRadPerSec;
    if (std::isinf(p.needed))
      plan.summary.fail(fmt::format("passage at {:.0f} rpm: {:.3g} um at {:.0f} rpm/s, no acceleration keeps {:.3g} um",
                                    rpm, 1e6 * p.peak, o.fastest * kRpmPerRadPerSec, 1e6 * o.limit));
    else if (p.needed > plan.drive)  // false where the drive is not known
      plan.summary.fail(fmt::format("passage at {:.0f} rpm needs {:.3g} rpm/s: the drive gives {:.3g} rpm/s", rpm,
                                    p.needed * kRpmPerRadPerSec, plan.drive * kRpmPerRadPerSec));
  }
}

}  // namespace

PassagePlan plan_passages(const Rotor& rotor, const CentrifugeSetup& setup, const PassageOptions& o) {
  if (!setup.given()) throw Error("the rotor file has no [centrifuge]: plane_mm, radius_mm, allowed_gram are needed");
  require_range("limit", o.limit, 1e-12, 1, "m");
  require_range("highest", o.highest, 1e-3, 1e6, "rad/s");
  require_range("torque", o.torque, 0, 1e9, "N m");
  const Rotor machine = loaded(rotor, setup);
  PassagePlan plan;
  plan.inertia = machine.polar_inertia();
  plan.drive = o.torque > 0 ? o.torque / plan.inertia : std::nan("");
  const Passages passages(rotor, machine, o);
  for (std::size_t k = 0; k < passages.count(); ++k) {
    Passage p = passages.passage(k);
    p.peak_drive = o.torque > 0 ? passages.peak(p, plan.drive).size : std::nan("");
    plan.passages.push_back(p);
  }
  judge(plan, o);
  return plan;
}

io::Json to_json(const PassagePlan& plan) {
  io::Json list = io::Json::array();
  for (const Passage& p : plan.passages)
    list.push(io::Json::object()
                  .set("critical", p.critical)
                  .set("from", p.from)
                  .set("to", p.to)
                  .set("peak_slow", p.peak_slow)
                  .set("needed", p.needed)
                  .set("peak", p.peak)
                  .set("place", p.place)
                  .set("peak_drive", p.peak_drive));
  return io::start_document("whirl.centrifuge_runup", 1)
      .set("summary", io::to_json(plan.summary))
      .set("passages", std::move(list))
      .set("inertia", plan.inertia)
      .set("drive", plan.drive);
}

}  // namespace whirl::shaft
