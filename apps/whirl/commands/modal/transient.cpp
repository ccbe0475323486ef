#include <fmt/format.h>

#include <algorithm>
#include <complex>
#include <numeric>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/vibration.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/modal/transient_runup.hpp"
#include "whirl/pages/bode_table.hpp"
#include "whirl/pages/record_views.hpp"
#include "whirl/report/table.hpp"
#include "whirl/signal/motion_quantity.hpp"

namespace whirl::app {
namespace {

std::string list_rpm(const std::vector<double>& speeds) {
  std::string text;
  for (const double w : speeds) text += fmt::format("{}{:.0f}", text.empty() ? "" : ", ", w / kRadPerSecPerRpm);
  return text;
}

/// "1575.4 ± 0.7": a standard deviation that these decimals would round to zero keeps a digit.
std::string with_sd(const Estimate& e, double unit, int decimals) {
  const double sd = e.sd / unit;
  const std::string text = fmt::format("{:.{}f}", sd, decimals);
  const bool lost = sd > 0 && text.find_first_of("123456789") == std::string::npos;
  return fmt::format("{:.{}f} ± {}", e.value / unit, decimals, lost ? fmt::format("{:.1g}", sd) : text);
}

io::Json fit_json(const modal::TransientRunupFit& fit) {
  io::Json::Array modes;
  for (const modal::RunupMode& m : fit.modes) {
    modes.push_back(io::Json::object().set("omega", to_json(m.omega, "rad/s")).set("zeta", to_json(m.zeta, "1")));
  }
  io::Json json = io::Json::object();
  json.set("fit_percent", fit.fit_percent).set("peak_speed", fit.peak_speed).set("alpha", fit.alpha);
  json.set("beats", fit.beats).set("modes", std::move(modes)).set("summary", to_json(fit.summary));
  return json;
}

struct TransientFlags {
  std::string file, channel, speed, amplitude, phase, convention;
  RecordOptions record;
  modal::TransientRunupOptions fit;
  bool steady = false;
};

/// Columns named one by one, each with the usual name where it is not.
std::vector<signal::SynchronousCurve> named_columns(const TransientFlags& o) {
  const auto or_usual = [](const std::string& stated, const char* usual) { return stated.empty() ? usual : stated; };
  return {pages::curve_of_columns(io::read_table(o.file), or_usual(o.speed, "speed"), or_usual(o.amplitude, "amp_1x"),
                                  or_usual(o.phase, "phase_1x"), o.convention)};
}

/// 1X vectors, one per revolution, of the sensors of a record.
std::vector<signal::SynchronousCurve> of_a_record(const TransientFlags& o) {
  const Recording record = pages::without_bad_samples(o.record.read(o.file)).record;
  const auto turning = diagnosis::rotation_of(record);
  if (!turning)
    throw Error(fmt::format(
        "{}: no rotor angle: needs a channel beta (rad), pulses (key, keyphasor, tacho; --pulses) or a speed_rpm",
        o.file));
  std::vector<signal::SynchronousCurve> out;
  for (const Channel& c : record.channels) {
    if (c.quantity == Quantity::displacement || diagnosis::of_a_housing(c, record))
      out.push_back(diagnosis::order_curve(record, *turning, c.name));
  }
  return out;
}

modal::RunupResponse run_of(const TransientFlags& o, Session& session) {
  const bool columns = !o.speed.empty() || !o.amplitude.empty() || !o.phase.empty();
  std::vector<signal::SynchronousCurve> curves =
      columns ? named_columns(o) : pages::read_bode_table(o.file, o.convention);
  if (curves.empty() && !o.convention.empty())
    throw Error::in_field("--phase", o.convention, "left out: a record has its phase from its angle");
  if (curves.empty()) curves = of_a_record(o);
  std::string present;
  for (const signal::SynchronousCurve& c : curves) present += (present.empty() ? "" : ", ") + c.name;
  const auto chosen = std::ranges::find_if(
      curves, [&](const signal::SynchronousCurve& c) { return o.channel.empty() || c.name == o.channel; });
  if (chosen == curves.end())
    throw Error(o.channel.empty() ? fmt::format("{}: no displacement, velocity or acceleration", o.file)
                                  : fmt::format("{}: no channel '{}'; present: {}", o.file, o.channel, present));
  if (curves.size() > 1)
    session.say(fmt::format("channel {} of {}{}", chosen->name, present, o.channel.empty() ? " (--channel)" : ""));
  const signal::SynchronousCurve curve = signal::in_quantity(*chosen, Quantity::displacement);
  return {curve.speed, curve.time, curve.vector};
}

/// Rows at held speeds in their order, as a run whose speed is its time.
modal::RunupResponse at_held_speeds(const modal::RunupResponse& run) {
  std::vector<Eigen::Index> order(static_cast<std::size_t>(run.omega.size()));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, {}, [&](Eigen::Index k) { return run.omega[k]; });
  modal::RunupResponse out{run.omega(order), {}, run.vector(order)};
  out.time = out.omega;
  return out;
}

}  // namespace

void add_transient(CommandLine& app, Session& session) {
  auto o = std::make_shared<TransientFlags>();
  CommandLine* sub = add_command(
      app, session, "transient", "Modes from the 1X vector of one fast run through critical speeds",
      "Input: a record with a rotor angle (as `whirl plot --what bode` takes it), the CSV that this plot writes, or a "
      "table with\n"
      "one row per revolution: rpm, amp_1x_um (zero-to-peak; amp_pp_um, amp_rms_mm_s), phase_1x_deg (phase of the "
      "average of\n"
      "x exp(-i theta); phase_lag_deg or --phase lag for a lag). A Bode plot of a fast run misplaces the critical "
      "speed and shows\n"
      "beats that are no resonances; the transient fit accounts for both. The steady-state fit is printed beside "
      "it.\n\n"
      "Example: whirl transient runup_bode.csv --modes 2",
      [o, &session] {
        const modal::RunupResponse run = run_of(*o, session);
        modal::TransientRunupOptions steady_options = o->fit;
        steady_options.model = modal::RunupModel::steady;
        const modal::TransientRunupFit steady = modal::fit_transient_runup(run, steady_options);
        const modal::RunupResponse used = o->steady ? at_held_speeds(run) : run;
        const modal::TransientRunupOptions& options = o->steady ? steady_options : o->fit;
        modal::TransientRunupFit fit = modal::fit_transient_runup(used, options);
        if (o->steady && !fit.summary.trust.empty())
          fit.summary.trust =
              "Frequencies and damping hold for linear modes; one probe does not fix two of them uniquely.";
        if (!o->steady && 100 - fit.fit_percent > modal::kLeftOver * (100 - steady.fit_percent))
          fit.summary.fail(
              fmt::format("the steady-state model explains the vectors better ({:.1f} % against {:.1f} %): where the "
                          "rows are speeds that were held and no turns of one run, --steady fits them",
                          steady.fit_percent, fit.fit_percent));
        modal::judge_phase(used, options, fit);
        for (std::size_t i = 0; i < fit.modes.size(); ++i) {
          session.say(fmt::format("mode {}: {} rpm, damping ratio {}", i + 1,
                                  with_sd(fit.modes[i].omega, kRadPerSecPerRpm, 1), with_sd(fit.modes[i].zeta, 1, 4)));
        }
        if (o->steady)
          session.say(fmt::format("held speeds; fit {:.1f} %", fit.fit_percent));
        else
          session.say(fmt::format("sweep {:.1f} rpm/s; fit {:.1f} % (steady-state model: {:.1f} %)",
                                  fit.alpha / kRadPerSecPerRpm, fit.fit_percent, steady.fit_percent));
        const auto beats = [](const auto& speeds) { return speeds.empty() ? "none" : list_rpm(speeds) + " rpm"; };
        if (!fit.modes.empty() && !o->steady)
          session.say(fmt::format("largest amplitude at {:.0f} rpm (measured {:.0f} rpm); beats at {} (measured {})",
                                  fit.peak_speed / kRadPerSecPerRpm, fit.peak_speed_measured / kRadPerSecPerRpm,
                                  beats(fit.beats), beats(fit.beats_measured)));
        session.result(io::Json::object().set("transient", fit_json(fit)).set("steady", fit_json(steady)));
        session.finish(fit.summary);
      });
  sub->add_option("FILE", o->file, "record, or 1X vectors (CSV)")->input()->required();
  sub->add_option("--modes", o->fit.modes, "1 or 2")->range(1, 2)->show_default();
  sub->add_flag("--steady", o->steady, "the rows are speeds that were held: the steady-state fit is the result");
  sub->add_option("--channel", o->channel, "sensor of the record or of the table; default the first");
  sub->add_option(
      "--speed-column", o->speed,
      "name of the speed column of a table; default speed, as a column headed by a unit of speed alone (rpm) "
      "is called");
  sub->add_option("--amplitude-column", o->amplitude, "name of the amplitude column; default amp_1x");
  sub->add_option("--phase-column", o->phase, "name of the phase column; default phase_1x");
  sub->add_option("--phase", o->convention, "of a table whose columns do not say it: phases are lag or lead [lead]")
      ->one_of({"lag", "lead"});
  o->record.turning = true;
  o->record.add_to(sub);
  o->record.add_tacho_to(sub);
}

}  // namespace whirl::app
