
#include <fmt/format.h>

#include "command.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/modal/transient_runup.hpp"
#include "whirl/pages/estimate_text.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

std::string list_rpm(const std::vector<double>& speeds) {
  std::string text;
  for (const double w : speeds) text += fmt::format("{}{:.0f}", text.empty() ? "" : ", ", w / kRadPerSecPerRpm);
  return text;
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

}  // namespace

void add_transient(CommandLine& app, Session& session) {
  struct Options {
    std::string file, speed = "speed", amplitude = "amp_1x", phase = "phase_1x";
    modal::TransientRunupOptions fit;
  };
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "transient", "Modes from the 1X vector of one fast run through critical speeds",
      "Input: CSV table with one row per revolution: rpm, amp_1x_um (zero-to-peak), phase_1x_deg (phase of the average "
      "of\n"
      "x exp(-i theta); a phase LAG enters with minus). A Bode plot of a fast run misplaces the critical speed and "
      "shows\n"
      "beats that are no resonances; the transient fit accounts for both. The steady-state fit stands beside it.\n\n"
      "Example: whirl transient runup_bode.csv --modes 2",
      [o, &session] {
        const io::Table table = io::read_table(o->file);
        modal::RunupResponse run;
        const Eigen::VectorXd &amplitude = table[o->amplitude], &phase = table[o->phase];
        run.omega = table[o->speed];
        run.vector.resize(amplitude.size());
        for (Eigen::Index i = 0; i < amplitude.size(); ++i) run.vector[i] = std::polar(amplitude[i], phase[i]);
        modal::TransientRunupOptions steady_options = o->fit;
        steady_options.model = modal::RunupModel::steady;
        const modal::TransientRunupFit fit = modal::fit_transient_runup(run, o->fit);
        const modal::TransientRunupFit steady = modal::fit_transient_runup(run, steady_options);
        for (std::size_t i = 0; i < fit.modes.size(); ++i) {
          session.say(fmt::format("mode {}: {:.1f} ± {:.1f} rpm, damping ratio {:.4f} ± {:.4f}", i + 1,
                                  fit.modes[i].omega.value / kRadPerSecPerRpm, fit.modes[i].omega.sd / kRadPerSecPerRpm,
                                  fit.modes[i].zeta.value, fit.modes[i].zeta.sd));
        }
        session.say(fmt::format("sweep {:.1f} rpm/s; fit {:.1f} % (steady-state model: {:.1f} %)",
                                fit.alpha / kRadPerSecPerRpm, fit.fit_percent, steady.fit_percent));
        session.say(fmt::format("largest amplitude at {:.0f} rpm (measured {:.0f}); beats at {} rpm (measured {})",
                                fit.peak_speed / kRadPerSecPerRpm, fit.peak_speed_measured / kRadPerSecPerRpm,
                                list_rpm(fit.beats), list_rpm(fit.beats_measured)));
        session.result(io::Json::object().set("transient", fit_json(fit)).set("steady", fit_json(steady)));
        session.finish(fit.summary);
      });
  sub->add_option("FILE", o->file, "1X vectors (CSV)")->input()->required();
  sub->add_option("--modes", o->fit.modes, "1 or 2")->range(1, 2)->show_default();
  sub->add_option("--speed-column", o->speed,
                  "name of the speed column; a column headed by a unit of speed alone (rpm) is called speed")
      ->show_default();
  sub->add_option("--amplitude-column", o->amplitude, "name of the amplitude column")->show_default();
  sub->add_option("--phase-column", o->phase, "name of the phase column")->show_default();
}

}  // namespace whirl::app
