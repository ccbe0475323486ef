
#include "bindings.hpp"
#include "whirl/balancing/solve.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/balancing.hpp"
#include "whirl/pages/steady_response.hpp"

namespace whirl::python {
namespace {

py::dict advice_of(const IdentifiedModel& model, double mass_kg, double radius_mm, double speed_rpm, double grade) {
  if (!model.rotor) throw Error("the model has no rotor parameters: identify with method='weak'");
  const diagnosis::BalancingAdvice a = diagnosis::balancing_advice(
      *model.rotor, mass_kg, radius_mm * 1e-3, speed_rpm * kRadPerSecPerRpm, grade, model.rotor_covariance);
  py::dict out(py::arg("unbalance_gmm") = a.unbalance * 1e6, py::arg("heavy_angle_deg") = a.heavy_angle / kRadPerDegree,
               py::arg("correction_mass_g") = a.correction_mass * 1e3,
               py::arg("correction_angle_deg") = a.correction_angle / kRadPerDegree, py::arg("grade_mm_s") = a.grade,
               py::arg("permitted_unbalance_gmm") = a.permitted_unbalance * 1e6,
               py::arg("within_grade") = a.within_grade);
  if (a.mass_interval) {
    out["correction_mass_g_95"] = py::make_tuple(a.mass_interval->low * 1e3, a.mass_interval->high * 1e3);
    out["correction_angle_deg_95"] =
        py::make_tuple(a.angle_interval->low / kRadPerDegree, a.angle_interval->high / kRadPerDegree);
  }
  return out;
}

py::object solved_job(const std::filesystem::path& runs, const std::string& phase, const std::string& amplitude,
                      const std::string& angles, double slow_roll_rpm, const std::string& criterion, double limit_gram,
                      double noise_um, const std::filesystem::path& prior, double mass_kg, double radius_mm) {
  if (criterion != "least-squares" && criterion != "min-max")
    throw Error::in_field("criterion", criterion, "'least-squares' or 'min-max'");
  balancing::JobOptions options;
  options.criterion = balancing::criterion_of(criterion);
  options.limit = limit_gram * 1e-3;
  options.noise = noise_um * 1e-6;
  options.prior.from = prior;
  options.rotor.mass = mass_kg;
  options.rotor.radius = radius_mm * 1e-3;
  io::Json document;
  {
    const py::gil_scoped_release unlocked;
    const balancing::JobFile file = balancing::read_job(
        runs.string(), balancing::VectorConvention::stated(phase, amplitude, angles), slow_roll_rpm * kRadPerSecPerRpm);
    document = balancing::solve_job(runs.string(), file, options).json;
  }
  return as_python(document);
}

void bind_balance(py::module_& m) {
  m.def(
      "balance", &advice_of, py::arg("model"), py::kw_only(), py::arg("mass_kg"), py::arg("radius_mm"),
      py::arg("speed_rpm"), py::arg("grade") = 6.3,
      "Mass and angle to add in one plane of an identified rotor, with 95 % intervals, and the grade of ISO 21940-11.");
  m.def("balance", &solved_job, py::arg("runs"), py::kw_only(), py::arg("phase") = "", py::arg("amplitude") = "",
        py::arg("angles") = "", py::arg("slow_roll_rpm") = 0.0, py::arg("criterion") = "least-squares",
        py::arg("limit_gram") = 0.0, py::arg("noise_um") = 0.0, py::arg("prior") = "", py::arg("mass_kg") = 0.0,
        py::arg("radius_mm") = 0.0,
        "Masses from a job of balancing runs (runs.csv or runs.toml, docs/balancing.md) as the content of\n"
        "balance.json: masses and angles of every plane with intervals, readings before and after, influence\n"
        "coefficients, runs that contradict the others. phase: 'lag' or 'lead'; amplitude: '0p', 'pp' or 'rms';\n"
        "angles of the masses: 'with' or 'against' the rotation. Nothing is assumed in silence: without phase and\n"
        "angles the summary is unusable and names both answers, unless the runs show the sense; without amplitude\n"
        "readings stand as read and get no zones. prior: balance.json or model.json, for fewer trials.");
}

Eigen::VectorXd over_points(const pages::SteadyResponse& f,
                            const std::function<double(const response::CurvePoint&)>& value) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(f.curve.points.size()));
  for (std::size_t i = 0; i < f.curve.points.size(); ++i) out[static_cast<Eigen::Index>(i)] = value(f.curve.points[i]);
  return out;
}

void bind_response(py::module_& m) {
  using pages::SteadyResponse;
  py::class_<SteadyResponse>(m, "SteadyResponse", "Steady answers of a model over speed, along the curve")
      .def_property_readonly(
          "speed",
          [](const SteadyResponse& f) {
            return over_points(f, [](const response::CurvePoint& p) { return p.solution.omega; });
          },
          "rad/s")
      .def_property_readonly(
          "amplitude",
          [](const SteadyResponse& f) {
            return over_points(f, [&](const response::CurvePoint& p) { return f.amplitude(p.solution); });
          },
          "peak: radius of a rotor in m, else of the first coordinate")
      .def_property_readonly(
          "phase",
          [](const SteadyResponse& f) {
            return over_points(f, [](const response::CurvePoint& p) { return std::arg(p.solution.harmonic(0, 1)); });
          },
          "of the first harmonic of the first coordinate, rad")
      .def_property_readonly(
          "stable",
          [](const SteadyResponse& f) {
            Eigen::Array<bool, Eigen::Dynamic, 1> out(static_cast<Eigen::Index>(f.curve.points.size()));
            for (std::size_t i = 0; i < f.curve.points.size(); ++i)
              out[static_cast<Eigen::Index>(i)] = f.curve.points[i].stable;
            return out;
          })
      .def_property_readonly(
          "events",
          [](const SteadyResponse& f) {
            std::vector<std::tuple<std::string, double, double>> out;
            for (const response::CurveEvent& e : f.curve.events)
              out.emplace_back(to_string(e.kind), e.solution.omega, f.amplitude(e.solution));
            return out;
          },
          "(kind, speed in rad/s, amplitude): fold, branch point, ...")
      .def_property_readonly(
          "peak_interval",
          [](const SteadyResponse& f) -> std::optional<std::pair<double, double>> {
            if (!f.band) return {};
            return std::pair(f.band->peak_low, f.band->peak_high);
          },
          "95 % of the largest amplitude over the model's covariance, m; None where it has none")
      .def_readonly("summary", &SteadyResponse::summary)
      .def("to_json", [](const SteadyResponse& f) { return to_json(f).dump(); });
  m.def(
      "response",
      [](const IdentifiedModel& model, double from_rpm, double to_rpm, const std::string& input, double amplitude,
         double unbalance, bool isolas, const Recording* record) {
        pages::SteadyOptions o;
        o.curve.from = from_rpm * kRadPerSecPerRpm;
        o.curve.to = to_rpm * kRadPerSecPerRpm;
        o.input = input;
        o.amplitude = amplitude;
        o.unbalance = unbalance;
        o.isolas = isolas;
        if (record != nullptr) o.known = identification::data_range({*record});
        const py::gil_scoped_release unlocked;
        return pages::steady_response(model, o);
      },
      py::arg("model"), py::arg("from_rpm"), py::arg("to_rpm"), py::kw_only(), py::arg("input") = "",
      py::arg("amplitude") = 0.0, py::arg("unbalance") = 1.0, py::arg("isolas") = false, py::arg("record") = nullptr,
      "Steady response over speed without simulation: stable and unstable answers, folds, branch points (harmonic\n"
      "balance with continuation). The forcing is the unbalance (times `unbalance`), or `input` as amplitude *\n"
      "cos(Omega t). `record`: what the model was found from; points beyond it are warned of.");
}

}  // namespace

void bind_steady(py::module_& m) {
  bind_balance(m);
  bind_response(m);
}

}  // namespace whirl::python
