#include "whirl/tuning/closed_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "runs/run_judge.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::tuning {
namespace {

/// Columns of the log, in the order of the header.
constexpr std::array<std::pair<const char*, Quantity>, 18> kColumns{{
    {"x_true", Quantity::displacement},
    {"y_true", Quantity::displacement},
    {"x", Quantity::displacement},
    {"y", Quantity::displacement},
    {"x_est", Quantity::displacement},
    {"y_est", Quantity::displacement},
    {"vx_est", Quantity::velocity},
    {"vy_est", Quantity::velocity},
    {"ux_requested", Quantity::force},
    {"uy_requested", Quantity::force},
    {"ux", Quantity::force},
    {"uy", Quantity::force},
    {"s_x", Quantity::velocity},
    {"s_y", Quantity::velocity},
    {"beta", Quantity::angle},
    {"omega", Quantity::angular_velocity},
    {"x_open", Quantity::displacement},
    {"y_open", Quantity::displacement},
}};

struct Log {
  explicit Log(long rows) : table(rows, static_cast<Eigen::Index>(kColumns.size())) { table.setZero(); }
  void row(long k, std::complex<double> z, std::complex<double> u, const Measurement& m,
           const control::ControllerState& c, std::complex<double> open) {
    table.row(k) << z.real(), z.imag(), m.x, m.y, c.estimate.z.real(), c.estimate.z.imag(), c.estimate.v.real(),
        c.estimate.v.imag(), c.requested.real(), c.requested.imag(), u.real(), u.imag(), c.s.real(), c.s.imag(), m.beta,
        m.omega, open.real(), open.imag();
  }
  Eigen::MatrixXd table;
};

}  // namespace

ClosedLoopPlant::ClosedLoopPlant(const rig::RigParameters& rig, const ClosedLoopOptions& options)
    : rig_(rig), options_(options), tables_(rig::make_rig_tables(rig)) {
  rig::VirtualRig open(tables_, {options.run.seed, {}});
  const rig::RigTruth truth(open);
  const long ticks = open.ticks();
  Eigen::VectorXd omega(ticks), x(ticks);
  const std::complex<double> unbalance = rig.rotor.mass * rig.eccentricity();
  double last = 0;
  open_motion_.reserve(static_cast<std::size_t>(ticks));
  for (long k = 0; k < ticks; ++k) {
    omega(k) = truth.angle().omega;
    open_motion_.push_back(in_reach(truth.z(), rig.laser.range));
    x(k) = open_motion_.back().real();
    const rotor::AngleState a = truth.angle();
    const double u = -control::product(unbalance, control::unbalance_per_metre(a.beta, a.omega, a.alpha)).real();
    smooth_variation_ += std::abs(u - last) * rig.timing.rate / static_cast<double>(ticks);
    last = u;
    open.advance();
  }
  segment_ = rig::segments(omega, rig.natural_frequency(), options.bounds);
  open_ = rig::segment_peaks(x, segment_, std::lround(options.skip * rig.timing.rate));
}

namespace {

/// What was determined last: a rotor that has stopped tells nothing.
void keep_last_said(control::Reidentification& last, const control::Reidentification& now) {
  constexpr std::uint32_t kSays =
      control::kStiffnessKnown | control::kDampingKnown | control::kActuatorKnown | control::kOtherMachine;
  if ((now.word & kSays) != 0 || (last.word & kSays) == 0) last = now;
}

}  // namespace

ClosedLoopMetrics ClosedLoopPlant::run(const ControllerDesign& design, Recording* log, std::uint64_t seed,
                                       const std::vector<rig::ScriptedFault>& faults) const {
  control::Controller controller = control::make_controller(design);
  rig::RigRun experiment = options_.run;
  if (seed != 0) experiment.seed = seed;
  experiment.faults.insert(experiment.faults.end(), faults.begin(), faults.end());
  rig::VirtualRig rig(tables_, experiment);
  const rig::RigTruth truth(rig);
  rt::SimulatedClock clock(1 / rig_.timing.rate);
  rt::Loop loop(rig, controller, clock, options_.safety);

  const long ticks = rig.ticks();
  std::optional<Log> table;
  if (log != nullptr) table.emplace(ticks);

  ClosedLoopMetrics out;
  out.open = open_;
  RunJudge judge(open_, &segment_, rig_.timing.rate, options_.skip, ticks, options_.verdict);
  double square = 0, square_y = 0;
  for (long i = 0; i < ticks; ++i) {
    const std::complex<double> z = truth.z();
    if (!judge.motion(z, truth.angle().omega)) break;
    const rt::CycleRecord cycle = loop.cycle();
    if (table) {
      table->row(i, z, truth.commanded(), cycle.measurement, controller.state(),
                 open_motion_[static_cast<std::size_t>(i)]);
    }
    const control::Supervision& watched = controller.state().supervision;
    if (watched.word != 0 && out.supervised < 0) out.supervised = cycle.measurement.t;
    out.supervision |= watched.word;
    keep_last_said(out.reidentification, controller.state().reidentification);
    if (cycle.measurement.t > 0.3) out.watched_level = std::max(out.watched_level, watched.level);
    const double u = truth.commanded().real(), across = truth.commanded().imag();
    square += u * u;
    square_y += across * across;
    out.force_peak = std::max(out.force_peak, std::abs(u));
    out.force_y_peak = std::max(out.force_y_peak, std::abs(across));
    judge.cycle(cycle.measurement, u, controller.state().saturated || cycle.limited, cycle.trip);
  }
  const long k = judge.tick();
  const double n = static_cast<double>(std::max(k, 1L));
  JudgedRun judged = judge.collected(smooth_variation_, nominal_excess(design));
  judged.margins = margin_shortfall(design, options_.verdict);
  out.closed = judged.closed;
  out.suppression = rig::suppression(open_, out.closed);
  out.radial_peak = judge.radial_peak();
  out.standstill_rms = judged.standstill_rms;
  out.standing_rms = judged.standing_rms;
  out.force_rms = std::sqrt(square / n);
  out.force_y_rms = std::sqrt(square_y / n);
  out.total_variation = judged.total_variation;
  out.smooth_variation = smooth_variation_;
  out.excess_variation = out.total_variation - smooth_variation_;
  out.saturated = judge.saturated();
  out.saturated_turning = judged.saturated_turning;
  out.held = controller.state().held_total;
  out.trip = judged.trip;
  out.survived = judged.survived;
  out.verdict = tuning::judge(judged, options_.verdict);
  // What supervision had to take back is not held by the design.
  if ((out.supervision & control::kUnheld) != 0) {
    out.verdict.reasons.push_back("supervision stepped in: " + control::supervision_text(out.supervision));
    out.verdict.stable = false;
  }
  out.stable = out.verdict.passed();

  if (log != nullptr) {
    *log = {};
    log->dt = 1 / rig_.timing.rate;
    log->source = "simulated rig, closed loop, " + design.law + " with " + design.estimator;
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      log->add(kColumns[c].first, kColumns[c].second, table->table.col(static_cast<Eigen::Index>(c)).head(k));
    }
  }
  return out;
}

ClosedLoopRun run_closed_loop(const ControllerDesign& design, const rig::RigParameters& rig,
                              const ClosedLoopOptions& options) {
  ClosedLoopRun out;
  out.metrics = ClosedLoopPlant(rig, options).run(design, &out.log);
  return out;
}

}  // namespace whirl::tuning
