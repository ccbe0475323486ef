#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "bindings.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/rotor_runs.hpp"
#include "whirl/shaft/centrifuge/centrifuge_json.hpp"
#include "whirl/shaft/centrifuge/passage_plan.hpp"
#include "whirl/shaft/control/control_json.hpp"
#include "whirl/shaft/fit/fit_json.hpp"
#include "whirl/shaft/fit/trend.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::python {
namespace {

using Speeds = std::vector<double>;  // rad/s

/// A rotor file and its model. Speeds are in rad/s, lengths in m: the Python side takes rpm and mm.
struct PythonRotor {
  shaft::RotorJob job;
  shaft::System system;
  std::string source;

  PythonRotor(const std::string& text, const std::string& name)
      : job(shaft::parse_rotor_job(text, name)), system(shaft::assemble(job.rotor)), source(name) {}
};

py::tuple modes(const PythonRotor& r, double speed, int count) {
  const std::vector<shaft::Mode> found = shaft::modes(r.system, speed, count);
  Summary summary;
  if (!shaft::returns_to_place(r.system, speed)) pages::warn_if_unstable(r.system, speed, speed, summary);
  return py::make_tuple(as_python(shaft::modes_json(r.system, speed, found, shaft::static_sag(r.system),
                                                    shaft::check_mesh(r.job.rotor, speed, count))),
                        summary);
}

py::object criticals(const PythonRotor& r, double highest, double order) {
  const std::vector<shaft::Critical> found = shaft::criticals(r.system, highest, 1 / order);
  return as_python(
      shaft::criticals_json(found, 1 / order, shaft::stability_threshold(r.system, highest / 1000, highest), highest));
}

py::tuple campbell(const PythonRotor& r, const Speeds& speeds, int count) {
  io::Json document = shaft::campbell_json(shaft::campbell(r.system, speeds, count));
  Summary summary;
  const auto threshold = pages::warn_if_unstable(r.system, 1e-3 * speeds.back(), speeds.back(), summary);
  document.set("unstable_from", shaft::threshold_json(threshold));
  return py::make_tuple(as_python(document), summary);
}

/// The document, of each place its name, amplitude and phase, and the summary.
py::tuple response(const PythonRotor& r, const Speeds& speeds) {
  if (r.system.unbalance.norm() == 0 && r.system.bow.norm() == 0)
    throw Error(r.source + ": no [[unbalance]] and no [[bow]]: nothing moves the rotor");
  std::vector<shaft::Reading> readings;
  py::list curves;
  const shaft::Response found = pages::refined_response(r.job.rotor, r.system, speeds);
  for (const pages::PlaceCurve& c : pages::place_curves(r.job.rotor, r.system, found)) {
    readings.push_back({c.name, c.position, c.angle, shaft::peaks(found.speeds, c.amplitude)});
    curves.append(py::make_tuple(c.name, c.amplitude, c.phase));
  }
  Summary summary;
  const auto threshold = pages::warn_if_unstable(r.system, speeds.front(), speeds.back(), summary);
  const io::Json document = shaft::response_json(readings).set("unstable_from", shaft::threshold_json(threshold));
  return py::make_tuple(as_python(document), found.speeds, curves, summary);
}

py::tuple simulate(const PythonRotor& r, double from, double to, double seconds, double rate_hz, bool full, int modes,
                   bool weight, double noise_db, std::uint64_t seed,
                   const std::optional<shaft::RotorController>& controller) {
  pages::SimulatedRun options;
  options.run = {.from = from, .to = to, .duration = seconds, .sample_time = 1 / rate_hz, .weight = weight};
  options.full = full;
  options.modes = modes;
  options.noise_db = noise_db;
  options.seed = seed;
  options.controller = controller;
  if (controller)  // the record keeps every n-th sample of the controller
    options.run.sample_time =
        controller->sample_time * std::max(1.0, std::round(1 / (controller->sample_time * rate_hz)));
  const pages::RotorRecord made = pages::simulated_record(r.job, options, r.source);
  std::vector<std::string> names;
  for (const pages::RotorPlace& p : made.places) names.push_back(p.name);
  return py::make_tuple(made.record, made.summary,
                        as_python(shaft::run_json(made.run, names, made.peaks, made.reduction_error)
                                      .set("passages", shaft::passages_json(made.passages))));
}

py::tuple control(const PythonRotor& r, double from, double to, const std::string& law, double rate_hz, int modes,
                  int schedule, int points, double sensitivity, double adaptation, double share, double force_weight,
                  bool unbalance_known, const std::optional<shaft::RotorController>& given) {
  const shaft::ControlOptions options{law,        from,     to,           given ? given->sample_time : 1 / rate_hz,
                                      modes,      schedule, points,       sensitivity,
                                      adaptation, share,    force_weight, unbalance_known};
  shaft::ControlDesign d;
  {
    const py::gil_scoped_release unlocked;
    d = given ? shaft::check_rotor_control(r.job.rotor, *given, options)
              : shaft::design_rotor_control(r.job.rotor, options);
  }
  return py::make_tuple(d.summary, as_python(shaft::control_design_json(d)), d.controller);
}

std::vector<shaft::OrderRun> runs_of(const PythonRotor& r,
                                     const std::vector<std::pair<std::string, Recording>>& records) {
  std::vector<shaft::OrderRun> runs;
  for (const auto& [name, record] : records) runs.push_back(pages::probe_run(record, r.job.rotor, name));
  return runs;
}

struct PythonFit {
  shaft::RotorFit fit;
};

PythonFit fit(const PythonRotor& r, const std::vector<std::pair<std::string, Recording>>& records, int restarts) {
  const std::vector<shaft::OrderRun> runs = runs_of(r, records);
  const py::gil_scoped_release unlocked;
  return {shaft::fit_rotor(r.job.rotor, r.job.fit, runs, {.restarts = restarts})};
}

/// Motion at stations with the forces of the supports that carry the shaft.
py::object motion(const PythonFit& f, const std::vector<double>& positions, const Speeds& speeds) {
  std::vector<shaft::VirtualProbe> motions;
  std::vector<shaft::VirtualForce> forces;
  for (const double at : positions) {
    require_range("position", 1e3 * at, 0, 1e3 * f.fit.rotor.length() * (1 + 1e-9), "mm");
    motions.push_back(shaft::virtual_probe(f.fit, at, speeds));
  }
  for (std::size_t k = 0; k < f.fit.rotor.supports.size(); ++k)
    if (f.fit.rotor.supports[k].a.part == "shaft") forces.push_back(shaft::virtual_force(f.fit, k, speeds));
  return as_python(shaft::fit_json(f.fit, motions, forces));
}

py::tuple trend(const PythonRotor& r, const std::vector<std::pair<std::string, Recording>>& records, int restarts) {
  const std::vector<shaft::OrderRun> runs = runs_of(r, records);
  shaft::FitTrend found;
  {
    const py::gil_scoped_release unlocked;
    found = shaft::fit_trend(r.job.rotor, r.job.fit, runs, {.restarts = restarts});
  }
  return py::make_tuple(as_python(shaft::to_json(found)), found.summary);
}

py::tuple check_load(const PythonRotor& r, const Recording& record, const std::vector<std::string>& sensors,
                     double highest) {
  const pages::SensorRun spinup = pages::sensor_run(record, r.job, sensors);
  const shaft::LoadCheck check =
      shaft::check_load(r.job.rotor, r.job.centrifuge, spinup.run, spinup.sensors, {.highest = highest});
  return py::make_tuple(as_python(shaft::load_check_json(check)), check.summary);
}

py::object limits(const PythonRotor& r, const Speeds& speeds, double safety) {
  return as_python(shaft::speed_limits_json(shaft::speed_limits(r.job.rotor, r.job.centrifuge, speeds, safety)));
}

py::tuple run_up(const PythonRotor& r, double highest, double limit, double torque) {
  const shaft::PassagePlan plan =
      shaft::plan_passages(r.job.rotor, r.job.centrifuge, {.limit = limit, .highest = highest, .torque = torque});
  return py::make_tuple(as_python(shaft::to_json(plan)), plan.summary);
}

}  // namespace

void bind_shaft(py::module_& m) {
  m.def("_rotor_template", &shaft::rotor_template, py::arg("name"));
  m.def("_rotor_templates", &shaft::rotor_templates);
  m.def(
      "_rotor_from_ross",
      [](const std::string& path) {
        const shaft::ImportedRotor imported = shaft::import_ross_rotor(path);
        return std::make_pair(shaft::rotor_text(imported.rotor), imported.remarks);
      },
      py::arg("path"));
  py::class_<shaft::RotorController>(m, "_RotorController")
      .def(py::init(&shaft::load_rotor_controller), py::arg("file"))
      .def_readonly("sample_time", &shaft::RotorController::sample_time)
      .def(
          "save",
          [](const shaft::RotorController& c, const std::filesystem::path& file) {
            shaft::save_rotor_controller(file, c);
          },
          py::arg("file"));
  py::class_<PythonFit>(m, "_RotorFit")
      .def_property_readonly("summary", [](const PythonFit& f) { return f.fit.summary; })
      .def("text", [](const PythonFit& f) { return shaft::rotor_text(f.fit.rotor); })
      .def("document", [](const PythonFit& f) { return as_python(shaft::fit_json(f.fit, {}, {})); })
      .def("motion", &motion, py::arg("positions"), py::arg("speeds"));
  py::class_<PythonRotor>(m, "_Rotor")
      .def(py::init<const std::string&, const std::string&>(), py::arg("text"), py::arg("name"))
      .def_property_readonly("name", [](const PythonRotor& r) { return r.job.rotor.name; })
      .def_property_readonly("length", [](const PythonRotor& r) { return r.job.rotor.length(); })
      .def_property_readonly("mass", [](const PythonRotor& r) { return r.job.rotor.mass(); })
      .def("modes", &modes, py::arg("speed"), py::arg("count"))
      .def("criticals", &criticals, py::arg("highest"), py::arg("order"))
      .def("campbell", &campbell, py::arg("speeds"), py::arg("count"))
      .def("response", &response, py::arg("speeds"))
      .def("simulate", &simulate, py::arg("start"), py::arg("stop"), py::arg("seconds"), py::arg("rate_hz"),
           py::arg("full"), py::arg("modes"), py::arg("weight"), py::arg("noise_db"), py::arg("seed"),
           py::arg("controller"))
      .def("control", &control, py::arg("start"), py::arg("stop"), py::arg("law"), py::arg("rate_hz"), py::arg("modes"),
           py::arg("schedule"), py::arg("points"), py::arg("sensitivity"), py::arg("adaptation"), py::arg("share"),
           py::arg("force_weight"), py::arg("unbalance_known"), py::arg("given"))
      .def("fit", &fit, py::arg("records"), py::arg("restarts"))
      .def("trend", &trend, py::arg("records"), py::arg("restarts"))
      .def("check_load", &check_load, py::arg("record"), py::arg("sensors"), py::arg("highest"))
      .def("limits", &limits, py::arg("speeds"), py::arg("safety"))
      .def("run_up", &run_up, py::arg("highest"), py::arg("limit"), py::arg("torque"));
}

}  // namespace whirl::python
