#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "bindings.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/io/file.hpp"
#include "whirl/rig/fields.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/rig/rig_file.hpp"
#include "whirl/shaft/control/controller.hpp"
#include "whirl/tuning/closed_loop.hpp"

namespace whirl::python {
namespace {

using rig::RigParameters;

/// Sets fields by the keys of the rig's file, e.g. {"rotor.added_mass_g": 5}.
RigParameters make_rig(const std::filesystem::path& file, const std::map<std::string, double>& settings) {
  RigParameters parameters = rig::read_rig(file);
  std::map<std::string, double> left = settings;
  rig::visit_fields(parameters, [&](const std::string& key, auto& field, double unit) {
    const auto setting = left.find(key);
    if (setting == left.end()) return;
    field = static_cast<std::remove_reference_t<decltype(field)>>(setting->second * unit);
    left.erase(setting);
  });
  if (!left.empty()) throw Error::in_field("settings", left.begin()->first, "a key of `whirl rig parameters`");
  parameters.check();
  return parameters;
}

py::dict segment_dict(const rig::SegmentPeaks& peaks) {
  py::dict out;
  for (std::size_t i = 0; i < 4; ++i) out[py::int_(i + 1)] = peaks.segment[i];
  out["all"] = peaks.all;
  return out;
}

void bind_rig(py::module_& m) {
  py::class_<RigParameters>(
      m, "VirtualRig",
      "A simulated machine with sensors, converters and actuators.\n\n"
      "VirtualRig({'rotor.added_mass_g': 5}) sets keys of `whirl rig parameters`; VirtualRig(file='rig.toml')\n"
      "reads them from a file.")
      .def(py::init([](const std::map<std::string, double>& settings, const std::filesystem::path& file) {
             return make_rig(file, settings);
           }),
           py::arg("settings") = std::map<std::string, double>{}, py::kw_only(), py::arg("file") = "")
      .def("run_up", &RigParameters::run_up, "the same machine, accelerating")
      .def("toml", &rig::rig_toml, "all parameters as the text of a file")
      .def(
          "record",
          [](const RigParameters& p, std::uint64_t seed, std::optional<double> snr_db) {
            const py::gil_scoped_release unlocked;
            return rig::record_open_loop(p, {.seed = seed}, snr_db).measured;
          },
          py::kw_only(), py::arg("seed") = 1, py::arg("snr_db") = py::none(),
          "What the sensors show on a run without control: x, y (m), beta (rad).")
      .def(
          "stiffness_test",
          [](const RigParameters& p, std::uint64_t seed) {
            rig::StiffnessTestOptions options;
            options.seed = seed;
            const rig::StiffnessTable table = rig::simulate_stiffness_test(p, options);
            return std::pair(table.deflection, table.force);
          },
          py::kw_only(), py::arg("seed") = 1, "(deflection m, force N) of a static stiffness test.")
      .def(
          "hammer_test",
          [](const RigParameters& p, int blows, std::uint64_t seed) {
            rig::HammerTestOptions options;
            options.blows = blows;
            options.seed = seed;
            const py::gil_scoped_release unlocked;
            return rig::simulate_hammer_test(p, options);
          },
          py::kw_only(), py::arg("blows") = 5, py::arg("seed") = 1, "One record per impact: force, acc_x, acc_y.");
}

void bind_design(py::module_& m) {
  auto design = py::class_<ControllerDesign>(m, "Controller", "A controller as data");
  design.def_readonly("law", &ControllerDesign::law)
      .def_readonly("estimator", &ControllerDesign::estimator)
      .def_readonly("parameters", &ControllerDesign::parameters, "SI")
      .def_readonly("margins", &ControllerDesign::margins)
      .def_readonly("sample_time", &ControllerDesign::sample_time, "s")
      .def_readonly("force_limit", &ControllerDesign::force_limit, "N")
      .def_readonly("summary", &ControllerDesign::summary)
      .def("__repr__", [](const ControllerDesign& d) {
        return fmt::format("<whirl.Controller {} with {}: {}>", d.law, d.estimator, to_string(d.summary.status));
      });
  add_json<ControllerDesign>(design);
  py::class_<tuning::ClosedLoopMetrics>(m, "Metrics",
                                        "How a controller did; peaks are zero-to-peak of the true disk centre, m")
      .def_property_readonly("open", [](const tuning::ClosedLoopMetrics& v) { return segment_dict(v.open); })
      .def_property_readonly("closed", [](const tuning::ClosedLoopMetrics& v) { return segment_dict(v.closed); })
      .def_property_readonly(
          "suppression", [](const tuning::ClosedLoopMetrics& v) { return segment_dict(v.suppression); },
          "1 - closed / open")
      .def_readonly("standstill_rms", &tuning::ClosedLoopMetrics::standstill_rms, "m")
      .def_readonly("force_rms", &tuning::ClosedLoopMetrics::force_rms, "N, x axis")
      .def_readonly("force_peak", &tuning::ClosedLoopMetrics::force_peak, "N, x axis")
      .def_readonly("force_y_rms", &tuning::ClosedLoopMetrics::force_y_rms, "N, y axis")
      .def_readonly("force_y_peak", &tuning::ClosedLoopMetrics::force_y_peak, "N, y axis")
      .def_readonly("total_variation", &tuning::ClosedLoopMetrics::total_variation, "N/s")
      .def_readonly("saturated", &tuning::ClosedLoopMetrics::saturated, "share of ticks at the force limit")
      .def_readonly("stable", &tuning::ClosedLoopMetrics::stable);
  py::class_<tuning::ClosedLoopRun>(m, "Run")
      .def_readonly("log", &tuning::ClosedLoopRun::log, "every tick")
      .def_readonly("metrics", &tuning::ClosedLoopRun::metrics);
  m.def(
      "run",
      [](const ControllerDesign& controller, const RigParameters& rig, std::uint64_t seed) {
        tuning::ClosedLoopOptions options;
        options.run.seed = seed;
        const py::gil_scoped_release unlocked;
        return tuning::run_closed_loop(controller, rig, options);
      },
      py::arg("controller"), py::arg("rig") = RigParameters{}, py::kw_only(), py::arg("seed") = 1,
      "Closed loop of a controller on the simulated rig.");
}

template <class T>
std::vector<std::filesystem::path> export_value(const T& value, const std::string& form,
                                                const std::filesystem::path& folder, const std::string& prefix) {
  deploy::CodeOptions code;
  code.prefix = prefix;
  code.origin = "Python";
  if (form == "fmu") {
    deploy::FmuOptions options;
    options.code = code;
    options.model_exchange = std::is_same_v<T, IdentifiedModel>;
    std::filesystem::create_directories(folder);
    deploy::pack_fmu(deploy::fmu_files(value, options), options, folder / (prefix + ".fmu"));
    return {folder / (prefix + ".fmu")};
  }
  return io::write_files(folder, deploy::source_files(value, form, code));
}

}  // namespace

void bind_control(py::module_& m) {
  bind_rig(m);
  bind_design(m);
  m.def("export", &export_value<ControllerDesign>, py::arg("value"), py::arg("form"), py::arg("folder"), py::kw_only(),
        py::arg("prefix") = "controller");
  m.def("export", &export_value<shaft::RotorController>, py::arg("value"), py::arg("form"), py::arg("folder"),
        py::kw_only(), py::arg("prefix") = "controller");
  m.def("export", &export_value<IdentifiedModel>, py::arg("value"), py::arg("form"), py::arg("folder"), py::kw_only(),
        py::arg("prefix") = "model",
        "Writes a controller or a model; returns the files. form: 'c' (C99), 'fmu', 'latex', 'matlab', 'python', "
        "'sfunction' (Simulink), of a model also 'modelica'.");
}

}  // namespace whirl::python
