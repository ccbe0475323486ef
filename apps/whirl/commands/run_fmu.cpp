#include "run_fmu.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/control/controller.hpp"
#include "whirl/deploy/fmu_plant.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/rt/clock.hpp"
#include "whirl/rt/loop.hpp"

namespace whirl::app {
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
FmuRun run(const std::string& fmu, const deploy::FmuPlantOptions& options, Control& control) {
  deploy::FmuPlant plant(fmu, options);
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

void RunFmuOptions::add_to(CommandLine* sub) {
  sub->add_option("--fmu-name", names,
                  "variable of the FMU for a role, e.g. x=rotor.x; roles x, y, ux, uy, beta, omega, alpha");
}

void run_fmu(Session& session, const std::string& controller, const std::string& fmu,
             const rotor::SpeedProfile& profile, const std::string& log, const RunFmuOptions& options) {
  const ControllerDesign design = io::load<ControllerDesign>(controller);
  deploy::FmuPlantOptions plant{profile.without_ripple(), design.sample_time, {}};
  for (const std::string& name : options.names) {
    const std::size_t equals = name.find('=');
    if (equals == std::string::npos) throw Error::in_field("--fmu-name", name, "ROLE=VARIABLE, e.g. x=rotor.x");
    plant.names[name.substr(0, equals)] = name.substr(equals + 1);
  }
  NoControl none;
  const FmuRun open = run(fmu, plant, none);
  control::Controller control = control::make_controller(design);
  const FmuRun closed = run(fmu, plant, control);
  const long skip = std::min(std::lround(0.5 / design.sample_time), closed.table.rows() / 2);
  const double open_peak = open.peak(std::min<long>(skip, open.table.rows() - 1)), closed_peak = closed.peak(skip);
  const double force = closed.table.middleCols(2, 2).cwiseAbs().maxCoeff();
  if (!log.empty()) {
    Recording record;
    record.dt = design.sample_time;
    record.source = "closed loop with " + fmu;
    const std::pair<const char*, Quantity> columns[] = {
        {"x", Quantity::displacement}, {"y", Quantity::displacement}, {"ux", Quantity::force},
        {"uy", Quantity::force},       {"beta", Quantity::angle},     {"omega", Quantity::angular_velocity}};
    for (Eigen::Index c = 0; c < 6; ++c) record.add(columns[c].first, columns[c].second, closed.table.col(c));
    io::write_csv(log, record);
  }
  session.say(fmt::format(
      "{} on {}: peak radius {:.4f} mm without control, {:.4f} mm with it (zero-to-peak, after {:.1f} s): suppression "
      "{:.1f} %; largest force {:.2f} N",
      design.law, fmu, 1e3 * open_peak, 1e3 * closed_peak, 0.5, 100 * (1 - closed_peak / open_peak), force));
  io::Json json = io::Json::object();
  json.set("open_peak", open_peak).set("closed_peak", closed_peak).set("suppression", 1 - closed_peak / open_peak);
  json.set("force_peak", force)
      .set("inputs", io::Json::array().push(io::input_record(controller)).push(io::input_record(fmu)));
  session.result(json);
  Summary summary;
  if (open.failed || closed.failed) summary.fail("the FMU refused a step");
  if (closed.trip != Fault::none) summary.fail("the loop tripped: " + std::string(to_string(closed.trip)));
  session.finish(summary);
}

}  // namespace whirl::app
