#include "whirl/pipeline/closed_loop.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "whirl/control/controller.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl {
namespace {

constexpr double kLimitCycle = 30e-6;  // m rms at standstill

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
           const ControllerState& c, std::complex<double> open) {
    table.row(k) << z.real(), z.imag(), m.x, m.y, c.estimate.z.real(), c.estimate.z.imag(),
        c.estimate.v.real(), c.estimate.v.imag(), c.requested.real(), c.requested.imag(), u.real(), u.imag(),
        c.s.real(), c.s.imag(), m.beta, m.omega, open.real(), open.imag();
  }
  Eigen::MatrixXd table;
};

}  // namespace

ClosedLoopPlant::ClosedLoopPlant(const RigParameters& rig, const ClosedLoopOptions& options)
    : rig_(rig), options_(options), tables_(make_rig_tables(rig)) {
  VirtualRig open(tables_, {options.run.seed, {}});
  const RigTruth truth(open);
  const long ticks = open.ticks();
  Eigen::VectorXd omega(ticks), x(ticks);
  const std::complex<double> unbalance = rig.rotor.mass * rig.eccentricity();
  double last = 0;
  open_motion_.reserve(static_cast<std::size_t>(ticks));
  for (long k = 0; k < ticks; ++k) {
    omega(k) = truth.angle().omega;
    x(k) = truth.z().real();
    open_motion_.push_back(truth.z());
    const AngleState a = truth.angle();
    const double u = -product(unbalance, unbalance_per_metre(a.beta, a.omega, a.alpha)).real();
    smooth_variation_ += std::abs(u - last) * rig.timing.rate / static_cast<double>(ticks);
    last = u;
    open.advance();
  }
  segment_ = segments(omega, rig.natural_frequency(), options.bounds);
  open_ = segment_peaks(x, segment_, std::lround(options.skip * rig.timing.rate));
}

ClosedLoopMetrics ClosedLoopPlant::run(const ControllerDesign& design, Recording* log,
                                       std::uint64_t seed) const {
  Controller controller = make_controller(design);
  RigRun experiment = options_.run;
  if (seed != 0) experiment.seed = seed;
  VirtualRig rig(tables_, experiment);
  const RigTruth truth(rig);
  SimulatedClock clock(1 / rig_.timing.rate);
  Loop loop(rig, controller, clock, options_.safety);

  const long ticks = rig.ticks();
  const double diverged = 3 * open_.all + 5e-3;  // m, far outside anything a useful controller does
  Eigen::VectorXd x = Eigen::VectorXd::Zero(ticks);
  std::optional<Log> table;
  if (log != nullptr) table.emplace(ticks);

  ClosedLoopMetrics out;
  out.open = open_;
  const long skip = std::lround(options_.skip * rig_.timing.rate);
  double square = 0, variation = 0, last = 0, still_x = 0, still_y = 0;
  long saturated = 0, still = 0, k = 0;
  const long settle = std::lround(0.5 * rig_.timing.rate);
  long since_stop = 0;
  for (; k < ticks; ++k) {
    const std::complex<double> z = truth.z();
    if (!truth.finite() || std::abs(z) > diverged) break;
    x(k) = z.real();
    if (k >= skip) out.radial_peak = std::max(out.radial_peak, std::abs(z));
    since_stop = truth.angle().omega == 0 ? since_stop + 1 : 0;
    if (since_stop > settle) {
      still_x += z.real() * z.real();
      still_y += z.imag() * z.imag();
      ++still;
    }
    const CycleRecord cycle = loop.cycle();
    if (table) {
      table->row(k, z, truth.commanded(), cycle.measurement, controller.state(),
                 open_motion_[static_cast<std::size_t>(k)]);
    }
    const double u = truth.commanded().real();
    square += u * u;
    out.force_peak = std::max(out.force_peak, std::abs(u));
    variation += std::abs(u - last);
    last = u;
    saturated += controller.state().saturated || cycle.limited;
    if (cycle.trip != Fault::none && out.trip == Fault::none) {
      out.trip = cycle.trip;
      out.survived = static_cast<double>(k) / static_cast<double>(ticks);
    }
  }
  if (k < ticks) out.survived = std::min(out.survived, static_cast<double>(k) / static_cast<double>(ticks));
  const double n = static_cast<double>(std::max(k, 1L));
  out.closed = segment_peaks(x, segment_, skip);
  if (k < ticks) out.closed.all = std::max(out.closed.all, diverged);
  out.suppression = suppression(open_, out.closed);
  if (still > 0) out.standstill_rms = std::sqrt(std::max(still_x, still_y) / static_cast<double>(still));
  out.force_rms = std::sqrt(square / n);
  out.total_variation = variation / (n / rig_.timing.rate);
  out.excess_variation = out.total_variation - smooth_variation_;
  out.saturated = static_cast<double>(saturated) / n;
  out.held = controller.state().held_total;
  out.stable = k == ticks && out.trip == Fault::none && out.standstill_rms <= kLimitCycle &&
               out.saturated <= options_.saturation_limit;

  if (log != nullptr) {
    *log = {};
    log->dt = 1 / rig_.timing.rate;
    log->source = "virtual rig, closed loop, " + design.law + " with " + design.estimator;
    for (std::size_t c = 0; c < kColumns.size(); ++c) {
      log->add(kColumns[c].first, kColumns[c].second, table->table.col(static_cast<Eigen::Index>(c)).head(k));
    }
  }
  return out;
}

ClosedLoopRun run_closed_loop(const ControllerDesign& design, const RigParameters& rig,
                              const ClosedLoopOptions& options) {
  ClosedLoopRun out;
  out.metrics = ClosedLoopPlant(rig, options).run(design, &out.log);
  return out;
}

}  // namespace whirl
