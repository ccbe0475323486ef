#include <fmt/format.h>

#include "bindings.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/modal/order_modes.hpp"
#include "whirl/modal/shaker_frf.hpp"

namespace whirl::python {
namespace {

modal::OperationalModes operational_modes(const std::vector<Recording>& setups, const std::string& method,
                                          double band_low, double band_high, int max_order, std::optional<int> orders,
                                          std::vector<double> tones) {
  modal::SetupsOptions options{.method = method, .joint = false, .orders = orders, .oma = {}};
  options.oma.band_low = band_low;
  options.oma.band_high = band_high;
  options.oma.max_order = max_order;
  options.oma.tones = std::move(tones);
  const py::gil_scoped_release unlocked;
  return modal::identify_setups(setups, options);
}

void bind_operational(py::module_& m) {
  py::class_<modal::OperationalMode>(m, "OperationalMode", "A mode seen under unknown broad-band excitation")
      .def_readonly("frequency", &modal::OperationalMode::frequency, "undamped natural frequency, Hz")
      .def_readonly("damping", &modal::OperationalMode::damping, "damping ratio, 1")
      .def_readonly("shape", &modal::OperationalMode::shape, "per channel, largest component 1; not scaled by mass")
      .def_property_readonly(
          "mpc", [](const modal::OperationalMode& v) { return modal::mode_complexity(v.shape).mpc; },
          "modal phase collinearity, 1 for a real shape")
      .def("__repr__", [](const modal::OperationalMode& v) {
        return fmt::format("<whirl.OperationalMode {:.6g} +- {:.2g} Hz, zeta {:.4g} +- {:.2g}>", v.frequency.value,
                           v.frequency.sd, v.damping.value, v.damping.sd);
      });
  py::class_<modal::OperationalModes>(m, "OperationalModes", "Modes from responses alone")
      .def_readonly("channels", &modal::OperationalModes::channels)
      .def_readonly("modes", &modal::OperationalModes::modes, "ascending in frequency")
      .def_property_readonly(
          "harmonics",
          [](const modal::OperationalModes& v) {
            std::vector<double> found;
            for (const modal::Tone& tone : v.tones) found.push_back(tone.frequency);
            return found;
          },
          "tones that are no modes, Hz")
      .def_readonly("summary", &modal::OperationalModes::summary)
      .def("__len__", [](const modal::OperationalModes& v) { return v.modes.size(); })
      .def(
          "__iter__",
          [](const modal::OperationalModes& v) { return py::make_iterator(v.modes.begin(), v.modes.end()); },
          py::keep_alive<0, 1>());
  const char* text =
      "Modes from records under operation, the force not measured. `records`: one record of responses of one "
      "quantity,\n"
      "or several set-ups that share channel names. method: 'ssi-data', 'ssi-cov', or 'orders' (a run-up or run-down "
      "by\n"
      "the rotor's angle, a channel in rad). band in Hz (0: by the sample rate), max_order in states (0: by the\n"
      "channels), orders: multiples of the running speed to subtract, with 'orders' to use (1); harmonics: known "
      "tones\n"
      "to subtract, Hz. Raises Error for too short records and channels of different quantities.";
  const auto bind = [&](auto function) {
    m.def("oma", function, py::arg("records"), py::kw_only(), py::arg("method") = "ssi-data", py::arg("band_low") = 0.0,
          py::arg("band_high") = 0.0, py::arg("max_order") = 0, py::arg("orders") = py::none(),
          py::arg("harmonics") = std::vector<double>(), text);
  };
  bind([](const Recording& record, const std::string& method, double low, double high, int max_order,
          std::optional<int> orders, std::vector<double> tones) {
    return operational_modes({record}, method, low, high, max_order, orders, std::move(tones));
  });
  bind(&operational_modes);
}

}  // namespace

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
      [](const std::vector<Recording>& records, const std::variant<std::string, std::vector<std::string>>& force,
         double resolution_hz) {
        modal::ShakerOptions shaker;
        if (const auto* names = std::get_if<std::vector<std::string>>(&force))
          shaker.forces = *names;
        else if (!std::get<std::string>(force).empty())
          shaker.forces = {std::get<std::string>(force)};
        shaker.resolution = resolution_hz;
        const py::gil_scoped_release unlocked;
        if (modal::excited_by_shakers(records, shaker.forces)) return modal::estimate_shaker_frf(records, shaker);
        modal::FrfOptions options;
        if (!shaker.forces.empty()) options.force = shaker.forces.front();
        return modal::estimate_frf(records, options);
      },
      py::arg("records"), py::kw_only(), py::arg("force") = "", py::arg("resolution_hz") = 0,
      "Frequency responses (H1) of hammer impacts or shakers: records with force (N) and response channels. `force`: "
      "name "
      "of the channel, or names where several shakers act. `resolution_hz`: shakers, Hz between lines; 0 = automatic.");

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
      "Natural frequencies, damping and residues with standard deviations; band in Hz (0: the whole). A Hann window of "
      "an "
      "analyser that the lines show is taken off, with a warning.");
  bind_operational(m);
}

}  // namespace whirl::python
