#include "whirl/deploy/fmu_loop.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "whirl/control/controller.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::deploy {
namespace {

/// One run on the FMU: columns x, y (m), ux, uy (N), beta (rad), omega (rad/s).
struct FmuRun {
  Eigen::MatrixXd table;
  Fault trip = Fault::none;
  bool failed = false;

  double peak(long skip) const {
    const Eigen::Index from = std::min<Eigen::Index>(skip, table.rows());
    return table.leftCols(2).bottomRows(table.rows() - from).rowwise().norm().maxCoeff();
  }
};

/// The plant without control.
struct NoControl {
  Expected<Command, Fault> step(const Measurement&) noexcept { return Command{}; }
  void applied(const Command&) noexcept {}
};

template <class Control>
FmuRun run(const std::string& fmu, const FmuPlantOptions& options, Control& control) {
  FmuPlant plant(fmu, options);
  rt::SimulatedClock clock(options.sample_time);
  rt::Loop loop(plant, control, clock);
  FmuRun out;
  out.table.setZero(plant.ticks(), 6);
  for (Eigen::Index k = 0; k < out.table.rows(); ++k) {
    const rt::CycleRecord cycle = loop.cycle();
    const Measurement& m = cycle.measurement;
    out.table.row(k) << m.x, m.y, cycle.sent.ux, cycle.sent.uy, m.beta, m.omega;
    if (cycle.trip != Fault::none && out.trip == Fault::none) out.trip = cycle.trip;
    if (plant.failed()) {
      out.failed = true;
      out.table.conservativeResize(k + 1, Eigen::NoChange);
      break;
    }
  }
  return out;
}

}  // namespace

FmuLoop run_fmu(const ControllerDesign& design, const std::string& fmu, const FmuPlantOptions& plant) {
  NoControl none;
  const FmuRun open = run(fmu, plant, none);
  FmuLoop out;
  control::Controller control = control::make_controller(design);
  const FmuRun closed = run(fmu, plant, control);
  const long skip = std::min(std::lround(out.settled / design.sample_time), open.table.rows() / 2);
  out.open_peak = open.peak(skip);
  out.closed_peak = closed.peak(skip);
  out.force_peak = closed.table.middleCols(2, 2).cwiseAbs().maxCoeff();
  out.closed.dt = design.sample_time;
  out.closed.source = "closed loop with " + fmu;
  const std::pair<const char*, Quantity> columns[] = {
      {"x", Quantity::displacement}, {"y", Quantity::displacement}, {"ux", Quantity::force},
      {"uy", Quantity::force},       {"beta", Quantity::angle},     {"omega", Quantity::angular_velocity}};
  for (Eigen::Index c = 0; c < 6; ++c) out.closed.add(columns[c].first, columns[c].second, closed.table.col(c));
  if (open.failed || closed.failed) out.summary.fail("the FMU refused a step");
  if (closed.trip != Fault::none) {
    const std::string why = control::supervision_text(control.state().supervision.word);
    out.summary.fail(fmt::format("the loop tripped: {}{}", to_string(closed.trip), why.empty() ? "" : ": " + why));
  }
  return out;
}

}  // namespace whirl::deploy
