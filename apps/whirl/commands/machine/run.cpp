#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "command.hpp"
#include "run_fmu.hpp"
#include "run_io.hpp"
#include "run_live.hpp"
#include "run_off_nominal.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/pages/text/sliding.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/tuning/sliding.hpp"

namespace whirl::app {

namespace {

struct RunOptions {
  std::string controller, rig, fmu_file, log;
  std::optional<double> added_mass_g;
  tuning::ClosedLoopOptions loop;
  bool run_up = false;
  RunIoOptions io;
  RunFmuOptions fmu;
  std::string sliding, sliding_figure;
  bool wants_sliding() const { return !sliding.empty() || !sliding_figure.empty(); }
  bool monitor = false, repeat = false, off_nominal = false;
  ViewOptions view;
};

/// Whether the rig that is taken where none is given is another machine than the controller's: its natural frequency is
/// off by more than a tenth, where identification errs by a hundredth.
std::optional<std::string> another_machine(const RunOptions& o, const ControllerDesign& design,
                                           const rig::RigParameters& rig) {
  constexpr double kAnother = 0.1;
  const double of_rig = rig.natural_frequency() / kTwoPi, of_model = std::sqrt(std::max(0.0, design.model.k1)) / kTwoPi;
  if (!o.rig.empty() || std::abs(of_model / of_rig - 1) <= kAnother) return {};
  return fmt::format(
      "this run says nothing of the controller's machine: without --rig it is on the rig of the paper, with a natural "
      "frequency of {:.4g} Hz in place of {:.4g} Hz",
      of_rig, of_model);
}

/// The simulated run on the virtual rig, as fast as it goes.
void run_simulated(Session& session, const RunOptions& o, const ControllerDesign& design, const rig::RigParameters& rig,
                   const Summary& of_rig) {
  const tuning::ClosedLoopRun run = tuning::run_closed_loop(design, rig, o.loop);
  if (!o.log.empty()) io::write_csv(o.log, run.log);
  const tuning::ClosedLoopMetrics& m = run.metrics;
  if (!m.stable) session.say("FAILS: " + m.verdict.text());
  session.say(report::to_text(pages::segment_table(m, "Closed loop on the simulated rig: " + design.law, false)));
  session.say(
      fmt::format("standstill {:.4f} mm rms; force {}; total variation in x {:.0f} N/s; {:.2f} % of ticks saturated",
                  1e3 * m.standstill_rms, pages::force_text(m), m.total_variation, 100 * m.saturated));
  if (m.supervision != 0) {
    session.say(
        fmt::format("supervision, from {:.3f} s on: {}", m.supervised, control::supervision_text(m.supervision)));
  }
  if (m.reidentification.sd[0] > 0)
    session.say("re-identified, shares of the design: " + control::reidentification_text(m.reidentification));
  io::Json json = pages::to_json(m);
  json.set("provenance", to_json(io::provenance({o.controller}, session.command_line, o.loop.run.seed)));
  Summary summary;
  // What the design left out of the model is not in this controller either.
  for (const Finding& f : design.summary.findings)
    if (f.code == FindingCode::part_left_out) summary.add(f);
  if (!m.stable) {
    summary.fail(m.verdict.text());
  } else if (const auto stated = design.margins.find("peak_m");
             stated != design.margins.end() && m.closed.all > stated->second) {
    constexpr double kAnother = 1.5;
    summary.warn(fmt::format(
        "the peak of {:.4f} mm is {:.1f} times the one the certificate states for 95 % of the "
        "machines, {:.4f} mm{}",
        1e3 * m.closed.all, m.closed.all / stated->second, 1e3 * stated->second,
        m.closed.all > kAnother * stated->second ? ": this machine is not the one the controller was designed for"
                                                 : ""));
  }
  if (of_rig.status == Status::unusable) summary.fail(of_rig.reason);
  if (o.wants_sliding()) {
    const std::optional<tuning::SlidingStudy> study = tuning::sliding_study(design, run.log);
    if (!study) throw Error("--sliding: law '" + design.law + "' has no switching gain with a layer: nothing to check");
    if (!o.sliding.empty()) io::write_text(o.sliding, pages::sliding_csv(*study));
    if (!o.sliding_figure.empty()) report::write_figure(pages::sliding_figure(*study), o.sliding_figure);
    session.say(report::to_text(pages::sliding_table(*study)));
    json.set("sliding", pages::to_json(*study));
    if (const std::optional<Finding> missed = study->missed()) summary.add(*missed);
  }
  session.result(json.set("summary", to_json(summary)));
  session.finish(summary);
}

void run(Session& session, const RunOptions& o) {
  if (!o.io.io.empty()) return run_io(session, o.controller, o.io, o.monitor ? &o.view : nullptr);
  const ControllerDesign design = io::load<ControllerDesign>(o.controller);
  rig::RigParameters rig = rig::read_rig(o.rig);
  if (o.added_mass_g) {
    require_range("--added-mass-g", *o.added_mass_g, 0, 1000, "g");
    rig.rotor.added_mass = *o.added_mass_g * 1e-3;
  }
  if (o.run_up) rig = rig.run_up();
  if (!o.fmu_file.empty()) return run_fmu(session, o.controller, o.fmu_file, rig.profile, o.log, o.fmu);
  if (o.monitor) {
    if (!o.log.empty()) throw Error("--log: a run with --monitor is recorded by the page, into --record-folder");
    return run_live(session, design, rig, {o.view, o.loop.run.seed, o.repeat});
  }
  Summary of_rig;
  if (const std::optional<std::string> another = another_machine(o, design, rig)) of_rig.fail(*another);
  if (o.off_nominal) return run_off_nominal(session, design, rig, o.loop.run.seed, of_rig);
  run_simulated(session, o, design, rig, of_rig);
}

}  // namespace

void add_run(CommandLine& app, Session& session) {
  auto o = std::make_shared<RunOptions>();
  CommandLine* sub = add_command(
      app, session, "run", "Closed loop of a controller on a rig",
      "Input: controller.json; --rig rig.toml (keys of `whirl rig parameters`), --fmu plant.fmu or --io io.toml.\n"
      "Output: open- and closed-loop peak (zero-to-peak, true disk centre, x axis) and suppression in the four "
      "segments of\n"
      "paper Fig. 24 and over the whole run, standstill rms, force of both axes, its total variation in x; --log "
      "writes every "
      "tick.\n"
      "--off-nominal runs it on 18 machines it was not made for, without and with supervision (exit code 1 where one "
      "is "
      "worse\n"
      "than 1.05 of the motion without control).\n"
      "--monitor shows the loop in a browser while it runs, on the simulated rig in real time; who has the address "
      "with "
      "its token\n"
      "can arm, disarm and trip it (docs/monitor.md).\n\n"
      "Example: whirl run controller.json --added-mass-g 5 --log run.csv",
      [o, &session] { run(session, *o); });
  sub->add_option("CONTROLLER", o->controller, "controller.json")->input()->required();
  sub->add_option(
         "--rig", o->rig,
         "TOML file of `whirl rig parameters`; default: the rig of the paper's levels, for its controllers alone")
      ->input();
  sub->add_option("--fmu", o->fmu_file, "instead: an FMU for co-simulation as the plant (docs/export.md)")
      ->existing_file()
      ->input();
  o->fmu.add_to(sub);
  Option* const off_nominal = sub->add_flag(
      "--off-nominal", o->off_nominal, "18 machines the controller was not made for, with supervision and without");
  sub->add_option("--added-mass-g", o->added_mass_g, "screw in the disk; 0 = balanced")->range(0, 1000);
  sub->add_flag("--run-up", o->run_up, "accelerate instead of decelerate");
  sub->add_option("--seed", o->loop.run.seed, "of the sensor noise")->show_default();
  o->io.add_to(sub);
  sub->add_flag("--monitor", o->monitor, "show and command the loop in a browser (simulated rig, or --io)")
      ->group("Live view");
  sub->add_flag("--repeat", o->repeat, "with --monitor: the simulated rig begins its profile again at the end")
      ->group("Live view");
  o->view.add_to(sub);
  Option* const sliding =
      sub->add_option(
             "--sliding", o->sliding,
             "CSV of S, V = S^2/2, dV/dt and their bound (paper, eqs. 28 to 42); fails where eq. 42 does not hold")
          ->output("record");
  Option* const figure = sub->add_option("--sliding-figure", o->sliding_figure,
                                         "the same as a figure: S, disturbance, V, dV/dt (.svg, .png, .pdf, .csv)")
                             ->output();
  Option* const log =
      sub->add_option("--log", o->log, "CSV of every tick: true and measured motion, forces, sliding variables")
          ->output("record");
  // Of the simulated run alone; the others have no such ticks.
  for (Option* of_ticks : {sliding, figure})
    for (const char* other : {"--off-nominal", "--fmu", "--io", "--monitor"}) of_ticks->excludes(other);
  for (const char* other : {"--off-nominal", "--io"}) log->excludes(other);
  for (const char* other : {"--fmu", "--io", "--monitor"}) off_nominal->excludes(other);
}

}  // namespace whirl::app
