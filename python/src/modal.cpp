#include "bindings.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"

namespace whirl::python {

void bind_modal(py::module_& m) {
  auto frf = py::class_<FrequencyResponse>(m, "FrequencyResponse", "Frequency responses on one uniform axis");
  frf.def_readonly("frequency", &FrequencyResponse::frequency, "Hz")
      .def_property_readonly("kind", [](const FrequencyResponse& f) { return std::string(to_string(f.kind)); })
      .def_property_readonly(
          "names",
          [](const FrequencyResponse& f) {
            std::vector<std::pair<std::string, std::string>> names;
            for (const FrfChannel& c : f.channels) names.emplace_back(c.response, c.reference);
            return names;
          },
          "(response, reference) of every column")
      .def_property_readonly(
          "values",
          [](const FrequencyResponse& f) {
            Eigen::MatrixXcd values(f.frequency.size(), static_cast<Eigen::Index>(f.channels.size()));
            for (std::size_t i = 0; i < f.channels.size(); ++i) {
              values.col(static_cast<Eigen::Index>(i)) = f.channels[i].value;
            }
            return values;
          },
          "lines x channels, SI: motion per newton")
      .def_readonly("summary", &FrequencyResponse::summary);
  add_json<FrequencyResponse>(frf);
  m.def(
      "frf",
      [](const std::vector<Recording>& records, const std::string& force) {
        modal::FrfOptions options;
        options.force = force;
        const py::gil_scoped_release unlocked;
        return modal::estimate_frf(records, options);
      },
      py::arg("records"), py::kw_only(), py::arg("force") = "",
      "Frequency responses (H1) of hammer blows: records with a force channel (N) and response channels.");

  py::class_<Mode>(m, "Mode")
      .def_readonly("frequency", &Mode::frequency, "undamped natural frequency, Hz")
      .def_readonly("damping", &Mode::damping, "damping ratio, 1")
      .def_readonly("pole", &Mode::pole, "rad/s")
      .def_readonly("residues", &Mode::residues, "one per channel, of receptance")
      .def("__repr__", [](const Mode& v) {
        return fmt::format("<whirl.Mode {:.6g} +- {:.2g} Hz, zeta {:.4g} +- {:.2g}>", v.frequency.value, v.frequency.sd,
                           v.damping.value, v.damping.sd);
      });
  auto model = py::class_<ModalModel>(m, "ModalModel", "Poles and residues of a structure");
  model.def_readonly("modes", &ModalModel::modes)
      .def_readonly("reconstruction_error", &ModalModel::reconstruction_error, "norm(measured - model)/norm(measured)")
      .def_readonly("summary", &ModalModel::summary)
      .def("__len__", [](const ModalModel& v) { return v.modes.size(); })
      .def(
          "__iter__", [](const ModalModel& v) { return py::make_iterator(v.modes.begin(), v.modes.end()); },
          py::keep_alive<0, 1>());
  add_json<ModalModel>(model);
  m.def(
      "modes",
      [](const FrequencyResponse& response, double low, double high) {
        modal::ModeOptions options;
        options.poles.band_low = low;
        if (high > 0) options.poles.band_high = high;
        const py::gil_scoped_release unlocked;
        return modal::fit_modes(response, options);
      },
      py::arg("frf"), py::kw_only(), py::arg("band_low") = 0.0, py::arg("band_high") = 0.0,
      "Natural frequencies, damping and residues with standard deviations; band in Hz (0: the whole).");
}

}  // namespace whirl::python
