#include "run_fmu.hpp"

#include <fmt/format.h>

#include "whirl/deploy/fmu_loop.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::app {

void RunFmuOptions::add_to(CommandLine* sub) {
  sub->add_option("--fmu-name", names,
                  "variable of the FMU for a role, e.g. x=rotor.x; roles x, y, ux, uy, beta, omega, alpha")
      ->needs("--fmu");
}

std::map<std::string, std::string> fmu_names(const std::vector<std::string>& roles) {
  std::map<std::string, std::string> names;
  for (const std::string& role : roles) {
    const std::size_t equals = role.find('=');
    if (equals == std::string::npos) throw Error::in_field("--fmu-name", role, "ROLE=VARIABLE, e.g. x=rotor.x");
    names[role.substr(0, equals)] = role.substr(equals + 1);
  }
  return names;
}

void run_fmu(Session& session, const std::string& controller, const std::string& fmu,
             const rotor::SpeedProfile& profile, const std::string& log, const RunFmuOptions& options) {
  const ControllerDesign design = io::load<ControllerDesign>(controller);
  const deploy::FmuPlantOptions plant{profile.without_ripple(), design.sample_time, fmu_names(options.names)};
  const deploy::FmuLoop loop = deploy::run_fmu(design, fmu, plant);
  if (!log.empty()) io::write_csv(log, loop.closed);
  const bool moves = loop.open_peak > 0;
  session.say(fmt::format(
      "{} on {}: peak radius {:.4f} mm without control, {:.4f} mm with it (zero-to-peak, after {:.1f} s): suppression "
      "{}; largest force {:.2f} N",
      design.law, fmu, 1e3 * loop.open_peak, 1e3 * loop.closed_peak, loop.settled,
      moves ? fmt::format("{:.1f} %", 100 * loop.suppression()) : "not defined, it does not move without control",
      loop.force_peak));
  io::Json json = io::start_document("whirl.fmu_run", 1);
  json.set("open_peak", loop.open_peak)
      .set("closed_peak", loop.closed_peak)
      .set("suppression", loop.suppression())
      .set("force_peak", loop.force_peak);
  json.set("inputs", io::Json::array().push(io::input_record(controller)).push(io::input_record(fmu)));
  session.result(json);
  session.finish(loop.summary);
}

}  // namespace whirl::app
