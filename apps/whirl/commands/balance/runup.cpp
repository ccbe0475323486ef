#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "response.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/model_parts.hpp"
#include "whirl/identify/readings.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/simulate_model.hpp"
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

/// The plan is that of the RotorModel; what the model has beside it is run once at the rates suggested.
void say_further_forces(Session& session, IdentifiedModel model, const pages::RunUpSheet& sheet, Summary& summary) {
  const std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  if (terms.empty()) return;
  model.rotor = sheet.rotor;
  const response::RunUpOptions& o = sheet.options;
  const std::string names = names_of(terms);
  if (const double w = identification::unstable_from(sheet.rotor, terms, o.to); std::isfinite(w))
    summary.fail(fmt::format("with its {} the rotor whirls by itself from {:.0f} rpm on, inside the range", names,
                             w / kRadPerSecPerRpm));
  for (const auto& [rate, from, to] :
       {std::tuple(sheet.up_rate, o.from, o.to), std::tuple(sheet.down_rate, o.to, o.from)}) {
    if (!rate) continue;
    rotor::SpeedProfile profile;
    profile.omega_start = from;
    profile.omega_end = to;
    profile.ramp_time = std::abs(to - from) / *rate;
    const double fastest = std::max(o.to, sheet.rotor.natural_frequency());
    const rotor::Response run =
        identification::simulate_rotor(model, rotor::angle_signal(profile, 2 * std::numbers::pi / 20 / fastest));
    const double peak = (run.z.array() - sheet.rotor.offset).abs().maxCoeff();
    session.say(fmt::format("with {:<13} {} at {:.4g} rpm/s {}", names, mm(peak), *rate / kRadPerSecPerRpm,
                            from < to ? "up" : "down"));
    if (o.limit > 0 && !(peak <= o.limit))
      summary.fail(
          fmt::format("with its {} the run at {:.4g} rpm/s exceeds the limit", names, *rate / kRadPerSecPerRpm));
  }
}

/// What of the plan lies beyond the records of the model.
void say_extrapolation(const identification::DataRange& range, const pages::RunUpSheet& sheet, Summary& summary) {
  double largest = 0;
  for (const response::RateCurve* c : {&sheet.plan.up, &sheet.plan.down})
    for (const auto& passage : c->passages) largest = std::max(largest, passage.peak);
  if (const std::string text = range.beyond(largest, sheet.options.from, sheet.options.to); !text.empty())
    summary.warn(text);
}

void run(const RunupOptions& o, Session& session) {
  const IdentifiedModel model = io::load<IdentifiedModel>(o.model);
  Summary parts;
  take_parts(identification::Consumer::runup, model, parts, o.model);
  if (!model.rotor) throw Error(o.model + ": the model has no rotor parameters");
  RotorModel rotor = *model.rotor;
  identification::scale_unbalance(rotor, o.unbalance);
  std::vector<double> covariance = model.rotor_covariance;
  for (std::size_t k = 0; covariance.size() == 25 && k < 25; ++k) {
    const bool row = k / 5 >= 3, column = k % 5 >= 3;
    covariance[k] *= (row ? o.unbalance : 1) * (column ? o.unbalance : 1);
  }
  response::RunUpOptions options;
  options.from = o.from_rpm * kRadPerSecPerRpm;
  options.to = o.to_rpm * kRadPerSecPerRpm;
  options.limit = o.limit_mm * 1e-3;
  options.slowest = o.slowest * kRadPerSecPerRpm;
  options.fastest = o.fastest * kRadPerSecPerRpm;
  pages::RunUpSheet sheet = pages::run_up_sheet(rotor, covariance, options, drive_of(o), std::move(parts));
  pages::cover_readings(model, o.unbalance, sheet);
  say_direction(session, "run-up", sheet.plan.up, sheet.up_rate, sheet.up_band, o);
  say_direction(session, "run-down", sheet.plan.down, sheet.down_rate, sheet.down_band, o);
  if (sheet.drive) {
    session.say(fmt::format("drive              a slow run-up needs {:.4g} N m (at {:.0f} rpm); this one {}",
                            sheet.drive->limit.torque, sheet.drive->limit.speed / kRadPerSecPerRpm,
                            sheet.drive->run.reached ? fmt::format("comes through in {:.3g} s, peak {}",
                                                                   sheet.drive->run.seconds, mm(sheet.drive->run.peak))
                                                     : "stalls"));
  }
  say_further_forces(session, model, sheet, sheet.summary);
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
