#include <cctype>
#include <set>

#include "fmu_builder.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/shaft/control/controller.hpp"
#include "whirl/shaft/control/export_c.hpp"
#include "written.hpp"

namespace whirl::deploy {
namespace {

/// Names of the variables: letters and digits, all else an underscore, a number behind what is there already.
class Names {
 public:
  std::string operator()(const std::string& given) {
    std::string name;
    for (const char c : given) name += std::isalnum(static_cast<unsigned char>(c)) != 0 ? c : '_';
    if (name.empty() || std::isdigit(static_cast<unsigned char>(name.front())) != 0) name.insert(name.begin(), '_');
    std::string free = name;
    for (int k = 2; !taken_.insert(free).second; ++k) free = name + fmt::format("_{}", k);
    return free;
  }

 private:
  std::set<std::string> taken_{"time", "angle", "speed", "sample_time"};
};

/// Header and source, each with the file that it came from.
std::vector<SourceFile> sources(const shaft::RotorController& controller, const CodeOptions& options) {
  require_prefix(options.prefix);
  const shaft::ControllerCode code = shaft::controller_code(controller, options.prefix);
  const std::string from = options.origin.empty() ? "" : fmt::format("/* From {}. */\n", c_comment(options.origin));
  return {{options.prefix + ".h", from + code.header}, {options.prefix + ".c", from + code.source}};
}

}  // namespace

std::vector<SourceFile> fmu_files(const shaft::RotorController& controller, const FmuOptions& options) {
  FmuOptions o = options;
  require_fmu(o);
  if (!o.co_simulation)
    throw Error("a sampled controller is a co-simulation FMU: it has no continuous states to exchange");
  o.model_exchange = false;
  const std::vector<SourceFile> code = sources(controller, o.code);
  FmuBuilder b("controller of a flexible rotor");
  Names names;
  b.block("INPUT", controller.probes.size() + 2);
  for (const shaft::Probe& p : controller.probes)
    b.add(fmu_real(names(p.name), "m", "reading of probe " + p.name, "input", "discrete", "0"));
  b.add(fmu_real("angle", "rad", "rotor angle", "input", "discrete", "0"));
  b.add(fmu_real("speed", "rad/s", "rotor speed", "input", "discrete", "0"));
  b.block("OUTPUT", controller.actuators.size());
  for (const shaft::Actuator& a : controller.actuators) {
    FmuVariable v = fmu_real(names(a.name), "N", "force of actuator " + a.name + " from the end of the step on",
                             "output", "discrete", "");
    v.depends.emplace();  // the sample was taken when the step began
    b.add(std::move(v));
  }
  b.block("PARAMETER", 1);
  const double period = controller.sample_time;
  TemplateSettings s;
  s.features = {"ROTOR"};
  s.slots["period"] = fmt::format("{:.17g}", period);
  s.slots["fixed"] =
      std::to_string(b.parameters({{"sample_time", "s", "of the controller", period, period, period}}, "sample_time"));
  s.slots["states"] = s.slots["indicators"] = "0U";
  b.description.step = period;
  b.description.variable_step = false;
  return finish_fmu(b, o, std::move(s), "fmu_rotor.c", code[0], code[1]);
}

std::vector<SourceFile> source_files(const shaft::RotorController& controller, const std::string& form,
                                     const CodeOptions& options) {
  if (form != "c") throw Error::in_field("form", form, "c or fmu: a controller of a flexible rotor has no other");
  return sources(controller, options);
}

}  // namespace whirl::deploy
