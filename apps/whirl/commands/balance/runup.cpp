#include <fmt/format.h>

#include <tuple>

#include "response.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/pages/run_up_plan.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

struct RunupOptions {
  std::string model, out, figure;
  double from_rpm = 0, to_rpm = 0, limit_mm = 0, slowest = 0, fastest = 0, unbalance = 1;
  double mass_kg = 0, inertia = 0, torque = 0, torque_slope = 0, coulomb = 0, viscous = 0, drag = 0;
};

std::optional<pages::Drive> drive_of(const RunupOptions& o) {
  if (o.torque == 0 && o.inertia == 0) {
    if (o.mass_kg + o.torque_slope + o.coulomb + o.viscous + o.drag > 0)
      throw Error("mass and friction belong to a drive: give --torque-nm, --inertia-kgm2 and --mass-kg");
    return std::nullopt;
  }
  for (const auto& [flag, value] :
       {std::pair{"--torque-nm", o.torque}, {"--inertia-kgm2", o.inertia}, {"--mass-kg", o.mass_kg}})
    if (!(value > 0))
      throw Error::in_field(flag, fmt::format("{:g}", value), "> 0: a drive needs torque, inertia and mass");
  return pages::Drive{o.mass_kg, o.inertia, {o.torque, o.torque_slope, o.coulomb, o.viscous, o.drag}};
}

std::string mm(double m) { return report::format_amplitude(m, AmplitudeKind::peak); }

void say_direction(Session& session, const char* name, const response::RateCurve& c, const std::optional<double>& rate,
                   const std::optional<response::PeakBand>& band, const RunupOptions& o) {
  std::string line = fmt::format("{:<18} slow {}, fastest looked at {} at {:.4g} rpm/s", name, mm(c.slow_peak),
                                 mm(c.passages.back().peak), c.passages.back().rate / kRadPerSecPerRpm);
  session.say(line);
  if (rate) {
    const double seconds = (o.to_rpm - o.from_rpm) * kRadPerSecPerRpm / *rate;
    session.say(fmt::format("  suggested        {:.4g} rpm/s ({:.3g} s){}", *rate / kRadPerSecPerRpm, seconds,
                            band ? ", peak " + mm(band->low) + " to " + mm(band->high) + " (95 % interval)" : ""));
  }
  if (o.limit_mm > 0 && c.slowest_safe)
    session.say(
        fmt::format("  slowest safe     {:.4g} rpm/s for {:g} mm", *c.slowest_safe / kRadPerSecPerRpm, o.limit_mm));
  if (c.fastest_useful < 0.99 * c.passages.back().rate)
    session.say(fmt::format("  fastest useful   {:.4g} rpm/s: faster does not lower the peak",
                            c.fastest_useful / kRadPerSecPerRpm));
}

/// What of the plan lies beyond the records of the model.
void say_extrapolation(const identification::DataRange& range, const pages::RunUpSheet& sheet, Summary& summary) {
  double largest = 0;
  for (const response::RateCurve* c : {&sheet.plan.up, &sheet.plan.down})
    for (const auto& passage : c->passages) largest = std::max(largest, passage.peak);
  const std::string text = range.beyond(largest, sheet.options.from, sheet.options.to);
  if (!text.empty()) summary.warn(text);
}

void run(const RunupOptions& o, Session& session) {
  const IdentifiedModel model = io::load<IdentifiedModel>(o.model);
  response::RunUpOptions options;
  options.from = o.from_rpm * kRadPerSecPerRpm;
  options.to = o.to_rpm * kRadPerSecPerRpm;
  options.limit = o.limit_mm * 1e-3;
  options.slowest = o.slowest * kRadPerSecPerRpm;
  options.fastest = o.fastest * kRadPerSecPerRpm;
  pages::RunUpSheet sheet = pages::run_up_sheet(model, o.unbalance, options, drive_of(o), o.model);
  say_direction(session, "run-up", sheet.plan.up, sheet.up_rate, sheet.up_band, o);
  say_direction(session, "run-down", sheet.plan.down, sheet.down_rate, sheet.down_band, o);
  if (sheet.drive) {
    session.say(fmt::format("drive              a slow run-up needs {:.4g} N m (at {:.0f} rpm); this one {}",
                            sheet.drive->limit.torque, sheet.drive->limit.speed / kRadPerSecPerRpm,
                            sheet.drive->run.reached ? fmt::format("comes through in {:.3g} s, peak {}",
                                                                   sheet.drive->run.seconds, mm(sheet.drive->run.peak))
                                                     : "stalls"));
  }
  for (const pages::FurtherRun& r : sheet.further_runs)
    session.say(fmt::format("with {:<13} {} at {:.4g} rpm/s {}", sheet.further, mm(r.peak), r.rate / kRadPerSecPerRpm,
                            r.up ? "up" : "down"));
  if (const auto range = identification::load_data_range(o.model)) say_extrapolation(*range, sheet, sheet.summary);
  const io::Json json = to_json(sheet);
  session.result(json);
  session.write_together();
  if (!o.out.empty()) io::save_json(o.out, json);
  if (!o.figure.empty()) report::write_figure(pages::run_up_figure(sheet), o.figure);
  session.finish(sheet.summary);
}

}  // namespace

void add_runup(CommandLine& app, Session& session) {
  auto o = std::make_shared<RunupOptions>();
  CommandLine* sub =
      add_command(app, session, "runup", "Choose how fast to run up and down through the critical speed",
                  "Input: model.json of `whirl identify`. Simulates run-ups and run-downs at many accelerations and "
                  "says which is the\n"
                  "slowest that keeps the radius within --limit-mm, above which acceleration nothing is gained, where "
                  "a small change\n"
                  "of the rate decides (folds), and whether the drive comes through (--torque-nm, --inertia-kgm2, "
                  "--mass-kg).\n\n"
                  "Example: whirl runup model.json --from-rpm 300 --to-rpm 1900 --limit-mm 1.5 --figure runup.svg",
                  [o, &session] { run(*o, session); });
  sub->add_option("MODEL", o->model, "model.json")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "lower end of the range")->range(0, 9e6)->required();
  sub->add_option("--to-rpm", o->to_rpm, "upper end")->range(0, 9e6)->required();
  sub->add_option("--limit-mm", o->limit_mm, "largest radius allowed, peak")->range(0, 1000);
  sub->add_option("--unbalance", o->unbalance, "times the identified eccentricity")->range(1e-6, 1e6)->show_default();
  sub->add_option("--slowest-rpm-s", o->slowest, "slowest acceleration looked at; default: almost steady")
      ->range(0, 1e9);
  sub->add_option("--fastest-rpm-s", o->fastest, "fastest; default: the range in two turns of the free whirl")
      ->range(0, 1e9);
  sub->add_option("--torque-nm", o->torque, "torque of the drive")->range(0, 1e9);
  sub->add_option("--torque-slope-nms", o->torque_slope, "what the drive loses per rad/s")->range(0, 1e9);
  sub->add_option("--inertia-kgm2", o->inertia, "of all that turns")->range(0, 1e9);
  sub->add_option("--mass-kg", o->mass_kg, "of the disk")->range(0, 1e9);
  sub->add_option("--coulomb-nm", o->coulomb, "dry friction")->range(0, 1e9);
  sub->add_option("--viscous-nms", o->viscous, "friction per rad/s")->range(0, 1e9);
  sub->add_option("--drag-nms2", o->drag, "air drag per (rad/s)^2")->range(0, 1e9);
  sub->add_option("--out", o->out, "write the plan as JSON")->output("whirl.run_up");
  sub->add_option("--figure", o->figure, "peak over acceleration, and the suggested runs (.svg, .png, .pdf, .csv)")
      ->output();
}

}  // namespace whirl::app
