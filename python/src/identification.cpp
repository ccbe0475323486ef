#include <fmt/format.h>

#include <numbers>

#include "bindings.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/record/channel_instants.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/modal/stiffness.hpp"

namespace whirl::python {
namespace {

using namespace identification;

Identification identify_any(const std::vector<Recording>& records, const std::string& method,
                            std::vector<std::string> states, std::vector<std::string> inputs, int order,
                            std::vector<std::string> library, bool discrete, double holdout,
                            const std::vector<std::string>& bounds, double least_decay, bool trapping,
                            const std::map<std::string, std::string>& hold,
                            const std::map<std::string, double>& dead_time, int hidden,
                            std::vector<std::string> denominators,
                            const std::function<void(const std::string&, double)>& progress) {
  IdentifyOptions options;
  options.method = method_of(method);
  options.sindy.states = std::move(states);
  options.sindy.inputs = std::move(inputs);
  options.sindy.order = order;
  options.sindy.library = std::move(library);
  options.sindy.discrete = discrete;
  options.sindy.timing.dead_time = dead_time;
  options.sindy.hidden = hidden;
  options.sindy.equations.denominators = std::move(denominators);
  for (const auto& [input, name] : hold) options.sindy.timing.hold[input] = hold_of(name);
  for (const std::string& text : bounds) options.bounds.linear.push_back(linear_bound(text));
  options.bounds.least_decay = least_decay;
  options.bounds.trapping = trapping;
  options.holdout = holdout;
  options.progress = [&](const std::string& what, double fraction) {
    stop_when_interrupted();
    if (!progress) return;
    const py::gil_scoped_acquire lock;
    progress(what, fraction);
  };
  const py::gil_scoped_release unlocked;
  return identify(records, options);
}

py::dict scores_of(const std::vector<StateScore>& scores) {
  py::dict out;
  for (const StateScore& s : scores) {
    out[py::str(s.state)] = py::dict(py::arg("rmse") = s.rmse, py::arg("nrmse") = s.nrmse, py::arg("noise") = s.noise);
  }
  return out;
}

UnbalanceSource unbalance_source(const std::string& name) {
  for (const UnbalanceSource s : {UnbalanceSource::identified, UnbalanceSource::added, UnbalanceSource::refitted}) {
    if (to_string(s) == name) return s;
  }
  throw Error::in_field("unbalance", name, "'identified', 'added' or 'refitted'");
}

}  // namespace

void bind_identification(py::module_& m) {
  py::class_<Identification>(m, "Identification", "A model and the evidence for and against it")
      .def_readonly("model", &Identification::model)
      .def_readonly("summary", &Identification::summary, "the verdict by all evidence")
      .def_property_readonly("usable", &Identification::usable)
      .def_property_readonly("parameters",
                             [](const py::object& self) -> py::object { return self.attr("model").attr("parameters"); })
      .def_property_readonly(
          "held_out", [](const Identification& v) { return scores_of(v.evidence.held_out.scores); },
          "free-run error (rms) on the part that a second fit did not see, by state")
      .def_property_readonly(
          "ambiguities",
          [](const Identification& v) {
            std::vector<py::dict> out;
            for (const Ambiguity& a : v.model.ambiguities)
              out.emplace_back(py::arg("readings") = a.readings, py::arg("consequence") = a.consequence,
                               py::arg("experiment") = a.experiment);
            return out;
          },
          "readings that the records cannot tell apart: what, which parameters differ, what would decide")
      .def_property_readonly("held_out_part", [](const Identification& v) { return v.evidence.held_out.what; })
      .def("__str__", [](const py::object& self) { return py::str(self.attr("model")); })
      .def("__repr__", [](const Identification& v) {
        return fmt::format("<whirl.Identification by {}: {}>", v.model.method, to_string(v.summary.status));
      });
  m.def("_identify", &identify_any, py::arg("records"), py::arg("method"), py::arg("states"), py::arg("inputs"),
        py::arg("order"), py::arg("library"), py::arg("discrete"), py::arg("holdout"), py::arg("bounds"),
        py::arg("least_decay"), py::arg("trapping"), py::arg("hold"), py::arg("dead_time"), py::arg("hidden"),
        py::arg("denominators"), py::arg("progress"));
  py::class_<Validation>(m, "Validation", "Free-run prediction of a record that was not used for the fit")
      .def_property_readonly(
          "unit", [](const Validation& v) { return std::string(si_unit(v.quantity)); },
          "of errors, noise and peaks: m, or m/s, m/s^2 of a record of velocity or acceleration")
      .def_readonly("rmse_x", &Validation::rmse_x, "against the measured x, rms (contains the sensor noise)")
      .def_readonly("rmse_y", &Validation::rmse_y, "rms")
      .def_readonly("nrmse", &Validation::nrmse, "rms of the error over rms of the motion")
      .def_readonly("noise_x", &Validation::noise_x, "noise of the record, rms")
      .def_readonly("noise_y", &Validation::noise_y, "rms")
      .def_readonly("peak_measured", &Validation::peak_measured, "largest radius, peak")
      .def_readonly("peak_simulated", &Validation::peak_simulated, "peak")
      .def_readonly("fold_sensitive", &Validation::fold_sensitive)
      .def_readonly("simulated", &Validation::simulated)
      .def_readonly("summary", &Validation::summary);
  m.def(
      "validate",
      [](const IdentifiedModel& model, const Recording& record, const std::string& unbalance,
         std::complex<double> added) {
        ValidateOptions options;
        options.unbalance = unbalance_source(unbalance);
        options.added = added;
        const py::gil_scoped_release unlocked;
        return validate_model(model, record, options);
      },
      py::arg("model"), py::arg("record"), py::kw_only(), py::arg("unbalance") = "identified",
      py::arg("added") = std::complex<double>(),
      "Free-run prediction of a rotor record. `added`: complex eccentricity of a known added mass, m, for\n"
      "unbalance='added'.");
  m.def(
      "score",
      [](const IdentifiedModel& model, const Recording& record, double horizon) {
        std::vector<StateScore> scores;
        {
          const py::gil_scoped_release unlocked;
          scores = score(model, record, horizon);
        }
        return scores_of(scores);
      },
      py::arg("model"), py::arg("record"), py::arg("horizon") = 0.0,
      "Free-run error of every measured state (rms), restarted every `horizon` seconds (0: never).");
  m.def(
      "at_common_instants",
      [](Recording record, const std::map<std::string, double>& late) {
        const py::gil_scoped_release unlocked;
        for (const auto& [channel, seconds] : late)
          record = at_common_instants(std::move(record), LateChannel{channel, seconds});
        return record;
      },
      py::arg("record"), py::arg("late"),
      "The record with channels that are read `late` seconds after the others, {channel: s}, brought to their "
      "instants\n"
      "by band-limited interpolation; shorter by the samples at an end for which they were not read. Raises\n"
      "whirl.Error for a channel that the record lacks and a delay as long as the record.");

  auto law = py::class_<StiffnessLaw>(m, "StiffnessLaw", "F = k1 (d - offset) + k2 (d - offset)^3");
  law.def_readonly("k1", &StiffnessLaw::k1, "N/m")
      .def_readonly("k2", &StiffnessLaw::k2, "N/m^3")
      .def_readonly("offset", &StiffnessLaw::offset, "m")
      .def_readonly("summary", &StiffnessLaw::summary)
      .def("__repr__", [](const StiffnessLaw& v) {
        return fmt::format("<whirl.StiffnessLaw k1 = {:.6g} +- {:.2g} N/m, k2 = {:.4g} +- {:.2g} N/m^3>", v.k1.value,
                           v.k1.sd, v.k2.value, v.k2.sd);
      });
  add_json<StiffnessLaw>(law);
  m.def(
      "stiffness",
      [](const Eigen::Ref<const Eigen::VectorXd>& deflection, const Eigen::Ref<const Eigen::VectorXd>& force) {
        return modal::fit_stiffness(deflection, force);
      },
      py::arg("deflection"), py::arg("force"), "Stiffness law of a force-deflection table, m and N.");
}

}  // namespace whirl::python
