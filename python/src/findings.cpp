#include "whirl/pages/text/findings.hpp"

#include "bindings.hpp"

namespace whirl::python {
namespace {

py::object find_vibration(const Recording& record, const std::vector<double>& mains, double chance) {
  std::string text;
  {
    const py::gil_scoped_release unlocked;
    text = pages::to_json(diagnosis::find_vibration(record, {mains, chance})).dump();
  }
  return py::module_::import("json").attr("loads")(text);
}

}  // namespace

void bind_findings(py::module_& m) {
  m.def(
      "find_vibration", &find_vibration, py::arg("record"), py::kw_only(),
      py::arg("mains") = std::vector<double>{50, 60}, py::arg("chance") = 0.01,
      "What the vibration of a rotor holds: orders, electric lines, oil whirl, sidebands, a 1X phase that wanders,\n"
      "run-out. A dict: angle ('measured', 'vibration', 'none'), low_speed and high_speed (rad/s), findings (code,\n"
      "channel, size with unit and kind, chance under noise, order, frequency_hz, speed, ratio_to_1x, may_mean, text)\n"
      "and not_judged. mains: electric supplies looked for, Hz. chance: of a false finding in a record of noise.");
}

}  // namespace whirl::python
