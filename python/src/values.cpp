#include <fmt/format.h>

#include <cmath>

#include "bindings.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/report/equation.hpp"

namespace whirl::python {
namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// The quantity of a channel by the SI unit that Python names, e.g. "m" or "rad/s"; "" and "1" have none.
Quantity quantity_of(const std::string& unit) {
  if (unit.empty() || unit == "1") return Quantity::dimensionless;
  for (int q = 0; q <= static_cast<int>(Quantity::specific_power); ++q) {
    if (si_unit(static_cast<Quantity>(q)) == unit) return static_cast<Quantity>(q);
  }
  throw Error::in_field("unit", unit, "an SI unit such as m, m/s, m/s^2, N, rad, rad/s, V, s or 1");
}

double uniform_step(const Eigen::VectorXd& t) {
  if (t.size() < 2) throw Error("t: a record needs at least two times");
  const double dt = (t[t.size() - 1] - t[0]) / static_cast<double>(t.size() - 1);
  if (!(dt > 0)) throw Error("t: times must rise");
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    if (!(std::abs(t[i] - t[0] - dt * static_cast<double>(i)) <= 0.05 * dt)) {
      throw Error(fmt::format("t[{}] = {:g} s: times must be uniform (here every {:g} s)", i, t[i], dt));
    }
  }
  return dt;
}

/// Times as numbers in s: dates (NumPy's datetime64) from the first on, differences of dates as they are. A cast would
/// take their nanoseconds for seconds.
py::array seconds_from(py::array times) {
  py::object t = std::move(times);
  const py::module_ numpy = py::module_::import("numpy");
  if (t.attr("dtype").attr("kind").cast<std::string>() == "M") t = t - t[py::int_(0)];
  return t.attr("__truediv__")(numpy.attr("timedelta64")(1, "s"));
}

/// One channel of real numbers, or the times of a record; Error for anything else that NumPy can hold.
Eigen::VectorXd samples_from(const py::handle& values, const std::string& name) {
  const py::array any = py::array::ensure(values);
  if (!any) {
    PyErr_Clear();
    throw Error(name + ": must be an array of numbers");
  }
  if (any.ndim() != 1)
    throw Error(
        fmt::format("{} has shape {}: must be one-dimensional", name, py::str(any.attr("shape")).cast<std::string>()));
  if (any.dtype().kind() == 'c')
    throw Error(name + " has complex values: give its real and imaginary part as two channels");
  const py::module_ masked = py::module_::import("numpy.ma");  // `mask` is also a method, of a pandas.Series
  if (py::isinstance(values, masked.attr("MaskedArray")) && masked.attr("is_masked")(values).cast<bool>())
    throw Error(name + " has masked samples: cut the record there, or fill them");
  const bool dates = any.dtype().kind() == 'M' || any.dtype().kind() == 'm';
  if (dates && name != "t")
    throw Error(fmt::format("{} holds {}: must be numbers", name, py::str(any.dtype()).cast<std::string>()));
  const Array numbers = Array::ensure(dates && any.size() > 0 ? seconds_from(any) : any);
  if (!numbers) {
    PyErr_Clear();
    throw Error(fmt::format("{} holds {}: must be numbers", name, py::str(any.dtype()).cast<std::string>()));
  }
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), numbers.size());
}

Recording make_recording(const py::dict& channels, const py::object& t, double dt, double t0,
                         const std::map<std::string, std::string>& units, std::string source) {
  Recording r;
  r.source = std::move(source);
  r.t0 = t0;
  r.dt = dt;
  require_range("t0", t0, -1e15, 1e15, "s");
  if (channels.empty()) throw Error("channels: a record needs at least one");
  Eigen::Index stamped = -1;
  if (!t.is_none()) {
    if (!std::isnan(dt)) throw Error("t and dt: give one of them");
    const Eigen::VectorXd times = samples_from(t, "t");
    r.dt = uniform_step(times);
    r.t0 = times[0];
    stamped = times.size();
  }
  for (const auto& [name, samples] : channels) {
    const std::string key = name.cast<std::string>();
    const auto unit = units.find(key);
    r.add(key, unit == units.end() ? Quantity::dimensionless : quantity_of(unit->second),
          samples_from(samples, "channel '" + key + "'"));
    if (stamped >= 0 && r[key].size() != stamped)
      throw Error(fmt::format("channel '{}' has {} samples, t has {}: must be equal", key, r[key].size(), stamped));
  }
  for (const auto& [name, unit] : units) {
    if (!r.has(name)) throw Error::in_field("units", name, "the name of a channel");
  }
  r.check();
  return r;
}

/// The samples themselves: the array keeps the recording alive and cannot be written.
py::array samples_of(const py::object& self, const std::string& name) {
  const Eigen::VectorXd& samples = self.cast<const Recording&>()[name];
  py::array_t<double> view(samples.size(), samples.data(), self);
  view.attr("setflags")(py::arg("write") = false);
  return view;
}

void bind_recording(py::module_& m) {
  py::class_<Recording>(m, "Recording",
                        "Signals sampled together at one constant rate, in SI units.\n\n"
                        "Recording({'x': x, 'y': y, 'beta': beta}, dt=1e-3, units={'x': 'm', 'y': 'm', 'beta': 'rad'})")
      .def(py::init(&make_recording), py::arg("channels"), py::kw_only(), py::arg("t") = py::none(),
           py::arg("dt") = std::nan(""), py::arg("t0") = 0.0, py::arg("units") = std::map<std::string, std::string>{},
           py::arg("source") = "python")
      .def_readonly("dt", &Recording::dt, "sample time, s")
      .def_readonly("t0", &Recording::t0, "time of the first sample, s")
      .def_readonly("source", &Recording::source)
      .def_property_readonly("duration", &Recording::duration, "s")
      .def_property_readonly("t", &Recording::times, "sample times, s")
      .def_property_readonly("names",
                             [](const Recording& r) {
                               std::vector<std::string> names;
                               for (const Channel& c : r.channels) names.push_back(c.name);
                               return names;
                             })
      .def_property_readonly("units",
                             [](const Recording& r) {
                               std::map<std::string, std::string> units;
                               for (const Channel& c : r.channels) units[c.name] = si_unit(c.quantity);
                               return units;
                             })
      .def("__getitem__", &samples_of, "samples of a channel: a view that cannot be written")
      .def("__contains__", [](const Recording& r, const std::string& name) { return r.has(name); })
      .def(
          "__iter__",
          [](const Recording& r) {
            py::list names;
            for (const Channel& c : r.channels) names.append(c.name);
            return py::iter(names);
          },
          "names of the channels")
      .def("__len__", &Recording::size)
      .def("__repr__",
           [](const Recording& r) {
             std::string names;
             for (const Channel& c : r.channels) {
               names += fmt::format("{}{} [{}]", names.empty() ? "" : ", ", c.name, si_unit(c.quantity));
             }
             return fmt::format("<whirl.Recording {}: {} samples every {:g} s: {}>", r.source, r.size(), r.dt, names);
           })
      .def(py::pickle(
          [](const py::object& self) {
            const auto& r = self.cast<const Recording&>();
            py::dict channels, units;
            for (const Channel& c : r.channels) {
              channels[py::str(c.name)] = samples_of(self, c.name);
              units[py::str(c.name)] = std::string(si_unit(c.quantity));
            }
            return py::make_tuple(channels, r.dt, r.t0, units, r.source);
          },
          [](const py::tuple& s) {
            return make_recording(s[0].cast<py::dict>(), py::none(), s[1].cast<double>(), s[2].cast<double>(),
                                  s[3].cast<std::map<std::string, std::string>>(), s[4].cast<std::string>());
          }));
}

void bind_summary(py::module_& m) {
  py::enum_<Status>(m, "Status", "Outcome of a numerical step")
      .value("ok", Status::ok)
      .value("warning", Status::warning)
      .value("unusable", Status::unusable);
  py::class_<Finding>(m, "Finding", "What a step learned about its result, as data; str() says it in words")
      .def_property_readonly("code", [](const Finding& f) { return std::string(to_string(f.code)); })
      .def_property_readonly(
          "consequence", [](const Finding& f) { return std::string(to_string(f.consequence)); },
          "'warning', 'no_trust' or 'unusable'")
      .def_readonly("where", &Finding::where)
      .def_property_readonly(
          "amounts",
          [](const Finding& f) {
            std::map<std::string, double> amounts;
            for (const Amount& a : f.amounts) amounts[a.name] = a.value;
            return amounts;
          },
          "name -> value, SI")
      .def("__str__", [](const Finding& f) { return text(f); })
      .def("__repr__", [](const Finding& f) { return fmt::format("<whirl.Finding {}>", to_string(f.code)); });
  py::class_<Summary>(m, "Summary", "What every result carries beside its numbers")
      .def(py::init<>())
      .def_readonly("status", &Summary::status)
      .def_readonly("residual", &Summary::residual)
      .def_readonly("condition_number", &Summary::condition_number)
      .def_readonly("chi_square", &Summary::chi_square, "whitened residual variance: 1 when the model fits")
      .def_readonly("trust", &Summary::trust, "what the result may be trusted for")
      .def_readonly("warnings", &Summary::warnings)
      .def_readonly("reason", &Summary::reason, "why the numbers must not be used; empty unless unusable")
      .def_readonly("findings", &Summary::findings, "list of Finding: what later steps decide on")
      .def_property_readonly("trusted", [](const Summary& s) { return s.distrust() == nullptr; })
      .def_property_readonly("usable", [](const Summary& s) { return s.status != Status::unusable; })
      .def("__repr__", [](const Summary& s) {
        std::string text = fmt::format("<whirl.Summary {}", to_string(s.status));
        for (const std::string& w : s.warnings) text += "; " + w;
        return text + ">";
      });
  py::class_<Estimate>(m, "Estimate", "A number with its uncertainty, SI")
      .def(py::init([](double value, double sd, double low, double high) {
             return Estimate{.value = value, .sd = sd, .low = low, .high = high};
           }),
           py::arg("value"), py::arg("sd") = std::nan(""), py::arg("low") = std::nan(""),
           py::arg("high") = std::nan(""))
      .def_readonly("value", &Estimate::value)
      .def_readonly("sd", &Estimate::sd, "standard deviation; nan when not known")
      .def_readonly("low", &Estimate::low, "lower end of the 95 % interval")
      .def_readonly("high", &Estimate::high, "upper end of the 95 % interval")
      .def("covers", &Estimate::covers, py::arg("truth"))
      .def("__float__", [](const Estimate& e) { return e.value; })
      .def("__repr__", [](const Estimate& e) { return fmt::format("{:.6g} +- {:.2g}", e.value, e.sd); });
}

void bind_model(py::module_& m) {
  py::class_<EquationTerm>(m, "Term")
      .def_readonly("function", &EquationTerm::function)
      .def_readonly("coefficient", &EquationTerm::coefficient)
      .def_readonly("unit", &EquationTerm::unit)
      .def("__repr__", [](const EquationTerm& t) { return fmt::format("{:.6g} {}", t.coefficient.value, t.function); });
  py::class_<Equation>(m, "Equation").def_readonly("lhs", &Equation::lhs).def_readonly("terms", &Equation::terms);
  auto model = py::class_<IdentifiedModel>(m, "Model", "Equations of motion found from records");
  model.def_readonly("method", &IdentifiedModel::method)
      .def_readonly("states", &IdentifiedModel::states)
      .def_readonly("inputs", &IdentifiedModel::inputs)
      .def_readonly("equations", &IdentifiedModel::equations)
      .def_property_readonly(
          "parameters",
          [](const IdentifiedModel& v) {
            py::dict out;
            for (const auto& [name, value] : v.parameters) out[py::str(name)] = value;
            return out;
          },
          "physical parameters by name, SI")
      .def_property_readonly(
          "quantity", [](const IdentifiedModel& v) { return std::string(to_string(v.quantity)); },
          "of x and y in a rotor's records: displacement, velocity or acceleration")
      .def_readonly("noise_sd", &IdentifiedModel::noise_sd, "noise found on the training record, rms")
      .def_readonly("noise_correlation", &IdentifiedModel::noise_correlation,
                    "(state, correlation of its noise from one sample to the next); empty: white")
      .def_readonly("summary", &IdentifiedModel::summary)
      .def_property_readonly("usable", [](const IdentifiedModel& v) { return v.summary.status != Status::unusable; })
      .def_property_readonly("is_rotor", [](const IdentifiedModel& v) { return v.rotor.has_value(); })
      .def("__str__",
           [](const IdentifiedModel& v) {
             std::string text;
             for (const Equation& e : v.equations) {
               const bool definition = e.terms.size() == 1 && e.terms[0].coefficient.sd == 0;  // x' = v
               if (!definition) text += report::to_text(e, report::names_of(v)) + "\n";
             }
             return text;
           })
      .def("_repr_latex_",
           [](const IdentifiedModel& v) {
             std::string text;
             for (const Equation& e : v.equations) text += report::to_latex(e, report::names_of(v)) + "\\\\\n";
             return "$$\\begin{aligned}" + text + "\\end{aligned}$$";
           })
      .def("__repr__", [](const IdentifiedModel& v) {
        return fmt::format("<whirl.Model by {}: {}>", v.method, to_string(v.summary.status));
      });
  add_json<IdentifiedModel>(model);
}

/// The value of a JSON result file, by its schema.
py::object load_any(const std::filesystem::path& path) {
  const io::Json document = io::load_json(path);
  const io::Json* schema = document.find("schema");
  const std::string* name = schema == nullptr ? nullptr : schema->get<std::string>();
  if (name == nullptr) throw Error::in_file(path.string(), 0, "no result of whirl: it has no \"schema\"");
  const std::string kind = name->substr(0, name->find('/'));
  const std::string source = path.string();
  if (kind == "whirl.model") return py::cast(io::from_json<IdentifiedModel>(document, source));
  if (kind == "whirl.controller") return py::cast(io::from_json<ControllerDesign>(document, source));
  if (kind == "whirl.modes") return py::cast(io::from_json<ModalModel>(document, source));
  if (kind == "whirl.frf") return py::cast(io::from_json<FrequencyResponse>(document, source));
  if (kind == "whirl.stiffness") return py::cast(io::from_json<StiffnessLaw>(document, source));
  throw Error::in_file(source, 0,
                       fmt::format("{} is not read here; read are model, controller, modes, frf, stiffness", *name));
}

}  // namespace

void bind_values(py::module_& m) {
  bind_summary(m);
  bind_recording(m);
  bind_model(m);
  m.def(
      "read",
      [](const std::filesystem::path& path, std::optional<double> rate, std::vector<std::string> columns) {
        io::CsvOptions options;
        options.rate = rate;
        options.columns = std::move(columns);
        const py::gil_scoped_release unlocked;
        return io::read_recording(path, options);
      },
      py::arg("path"), py::kw_only(), py::arg("rate") = py::none(), py::arg("columns") = std::vector<std::string>{},
      "A record from a file: CSV, UFF, ATFX, MAT, HDF5, WAV or LVM, found from its first bytes. `rate` in Hz for "
      "files\n"
      "without time; `columns` selects and names channels as --columns does.");
  m.def("write", &io::write_recording, py::arg("path"), py::arg("recording"),
        "Writes a record in the format of the file's ending.");
  m.def("load", &load_any, py::arg("path"), "A result from its JSON file: model, controller, modes, frf or stiffness.");
  const auto save = [](const std::filesystem::path& path, const auto& value) { io::save(path, value); };
  m.def("save", [save](const std::filesystem::path& p, const IdentifiedModel& v) { save(p, v); });
  m.def("save", [save](const std::filesystem::path& p, const ControllerDesign& v) { save(p, v); });
  m.def("save", [save](const std::filesystem::path& p, const ModalModel& v) { save(p, v); });
  m.def("save", [save](const std::filesystem::path& p, const FrequencyResponse& v) { save(p, v); });
  m.def(
      "save", [save](const std::filesystem::path& p, const StiffnessLaw& v) { save(p, v); },
      "Writes a result as its versioned JSON file.");
}

}  // namespace whirl::python
