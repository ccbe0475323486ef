#include <fmt/format.h>

#include <algorithm>

#include "bindings.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/record/model_run.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/modal/transient_runup.hpp"
#include "whirl/pages/derivation.hpp"
#include "whirl/pages/file_report.hpp"
#include "whirl/pages/nonlinear_mode.hpp"
#include "whirl/pages/printed_page.hpp"
#include "whirl/pages/run_report.hpp"
#include "whirl/pages/run_up_plan.hpp"
#include "whirl/records/channel_damage.hpp"

namespace whirl::python {
namespace {

const Channel& channel_of(const Recording& record, const std::string& argument, const std::string& name) {
  const Channel* found = record.find(name);
  if (found == nullptr) throw Error::in_field(argument, name, "a channel of " + record.source);
  return *found;
}

py::tuple decay(const Recording& record, const std::string& name, double from, double to, double periods) {
  if (record.channels.empty()) throw Error("the record has no channels");
  const Channel& channel = name.empty() ? record.channels.front() : channel_of(record, "channel", name);
  response::DecayOptions options{.from = from, .to = to, .periods = periods};
  records::ChannelDamage damage = records::channel_damage(record, channel.name);
  options.usable = std::move(damage.usable);
  response::DecayCurve curve;
  response::NonlinearMode mode;
  {
    const py::gil_scoped_release unlocked;
    curve = response::decay_curve(channel.samples, record.dt, options);
    mode = response::fit_decay(curve);
  }
  for (std::string& warning : damage.warnings(record, curve.from, curve.to)) mode.summary.warn(std::move(warning));
  return py::make_tuple(as_python(pages::to_json(mode, curve, {})), mode.summary, mode.model());
}

using Points = std::vector<std::array<double, 4>>;  // rad/s, N, m, rad

/// Windows of a record with a swept sine.
std::vector<response::SteadyPoint> swept_points(const Recording& record, const std::string& force_name,
                                                const std::string& name, double periods,
                                                std::vector<std::string>& warnings) {
  const Channel& force = channel_of(record, "force", force_name);
  const auto other = std::find_if(record.channels.begin(), record.channels.end(),
                                  [&](const Channel& c) { return c.name != force.name; });
  if (name.empty() && other == record.channels.end())
    throw Error("a channel of the response is needed beside the force");
  const Channel& answer = name.empty() ? *other : channel_of(record, "channel", name);
  response::SweptSineOptions options{.periods = periods};
  for (const auto& [channel, usable] :
       {std::pair(&force, &options.force_usable), std::pair(&answer, &options.usable)}) {
    records::ChannelDamage damage = records::channel_damage(record, channel->name);
    for (std::string& w : damage.warnings(record, 0, record.dt * static_cast<double>(record.size())))
      warnings.push_back(std::move(w));
    *usable = std::move(damage.usable);
  }
  return response::swept_sine_points(force.samples, answer.samples, record.dt, options);
}

py::tuple sine(const Points& table, const std::vector<Recording>& records, const std::string& force,
               const std::string& channel, double periods) {
  std::vector<response::SteadyPoint> points;
  std::vector<std::string> warnings;
  for (const auto& p : table) points.push_back({p[0], p[1], p[2], p[3]});
  for (const Recording& record : records) {
    const auto swept = swept_points(record, force, channel, periods, warnings);
    points.insert(points.end(), swept.begin(), swept.end());
  }
  Estimate gain;
  response::NonlinearMode mode = response::fit_steady(points, gain);
  for (std::string& warning : warnings) mode.summary.warn(std::move(warning));
  Points used;
  for (const response::SteadyPoint& p : points) used.push_back({p.omega, p.force, p.amplitude, p.phase});
  return py::make_tuple(as_python(pages::to_json(mode, {}, gain)), mode.summary, mode.model(), used);
}

py::tuple runup(const IdentifiedModel& model, double from_rpm, double to_rpm, double limit_mm, double unbalance,
                double slowest_rpm_s, double fastest_rpm_s, const std::map<std::string, double>& drive) {
  response::RunUpOptions options;
  options.from = from_rpm * kRadPerSecPerRpm;
  options.to = to_rpm * kRadPerSecPerRpm;
  options.limit = limit_mm * 1e-3;
  options.slowest = slowest_rpm_s * kRadPerSecPerRpm;
  options.fastest = fastest_rpm_s * kRadPerSecPerRpm;
  std::optional<pages::Drive> stated;
  if (!drive.empty()) {
    pages::Drive d;
    std::map<std::string, double*> fields{{"mass_kg", &d.mass},
                                          {"inertia_kgm2", &d.inertia},
                                          {"torque_nm", &d.torque.motor},
                                          {"torque_slope_nms", &d.torque.motor_slope},
                                          {"coulomb_nm", &d.torque.coulomb},
                                          {"viscous_nms", &d.torque.viscous},
                                          {"drag_nms2", &d.torque.drag}};
    for (const auto& [key, value] : drive) {
      if (fields.count(key) == 0)
        throw Error::in_field(
            "drive", key, "mass_kg, inertia_kgm2, torque_nm, torque_slope_nms, coulomb_nm, viscous_nms or drag_nms2");
      require_range(key, value, 0, 1e9);
      *fields[key] = value;
    }
    for (const char* key : {"torque_nm", "inertia_kgm2", "mass_kg"})
      if (!(*fields[key] > 0))
        throw Error::in_field(key, fmt::format("{:g}", *fields[key]), "> 0: a drive needs torque, inertia and mass");
    stated = d;
  }
  pages::RunUpSheet sheet;
  {
    const py::gil_scoped_release unlocked;
    sheet = pages::run_up_sheet(model, unbalance, options, stated);
  }
  return py::make_tuple(as_python(to_json(sheet)), sheet.summary);
}

py::tuple derive(const std::filesystem::path& path, const IdentifiedModel* model) {
  const lagrange::LagrangeFile file = lagrange::read_lagrange_file(path);
  lagrange::LagrangeEquations equations;
  try {
    equations = lagrange::derive(file.problem);
  } catch (const Error& e) {
    throw Error::in_file(path.string(), 0, e.what());
  }
  io::Json document = pages::to_json(file, equations);
  Summary summary;
  if (model != nullptr) {
    const lagrange::PhysicalParameters found =
        lagrange::physical_parameters(equations.library, lagrange::unknown_estimates(*model, equations.library),
                                      file.problem.parameters, file.report);
    pages::add_parameters(document, found);
    summary = found.summary;
  }
  return py::make_tuple(as_python(document), summary, pages::derivation_text(file, equations),
                        pages::derivation_latex(equations),
                        io::to_toml(equations.library, {"Derived from " + path.filename().string()}));
}

std::string report_page(const std::vector<std::filesystem::path>& files, const std::string& title, double service_rpm,
                        double slow_roll_rpm, const std::filesystem::path& about) {
  pages::ReportOptions options = about.empty() ? pages::ReportOptions{} : pages::about_machine(about);
  if (!title.empty()) options.title = title;
  if (service_rpm > 0) options.service_speed = service_rpm * kRadPerSecPerRpm;
  if (slow_roll_rpm > 0) options.slow_roll = slow_roll_rpm * kRadPerSecPerRpm;
  options.command_line = "Python";
  const py::gil_scoped_release unlocked;
  return report::to_html(pages::run_report(pages::read_report_inputs(files), options));
}

void bind_transient(py::module_& m) {
  using modal::RunupMode;
  using modal::TransientRunupFit;
  py::class_<RunupMode>(m, "RunupMode", "A mode seen while the speed passes it")
      .def_readonly("omega", &RunupMode::omega, "undamped natural frequency, rad/s")
      .def_readonly("zeta", &RunupMode::zeta, "damping ratio, 1")
      .def_readonly("participation", &RunupMode::participation, "eccentricity as seen by the probe, m");
  py::class_<TransientRunupFit>(m, "_Transient")
      .def_readonly("modes", &TransientRunupFit::modes)
      .def_readonly("runout", &TransientRunupFit::runout)
      .def_readonly("alpha", &TransientRunupFit::alpha)
      .def_readonly("simulated", &TransientRunupFit::simulated)
      .def_readonly("fit_percent", &TransientRunupFit::fit_percent)
      .def_readonly("peak_speed", &TransientRunupFit::peak_speed)
      .def_readonly("beats", &TransientRunupFit::beats)
      .def_readonly("peak_speed_measured", &TransientRunupFit::peak_speed_measured)
      .def_readonly("beats_measured", &TransientRunupFit::beats_measured)
      .def_readonly("summary", &TransientRunupFit::summary);
  m.def(
      "_transient",
      [](const Eigen::VectorXd& omega, const Eigen::VectorXcd& vector, int modes, bool steady) {
        modal::TransientRunupOptions options;
        options.modes = modes;
        options.model = steady ? modal::RunupModel::steady : modal::RunupModel::transient;
        const py::gil_scoped_release unlocked;
        const modal::RunupResponse run{.omega = omega, .time = {}, .vector = vector};
        modal::TransientRunupFit fit = modal::fit_transient_runup(run, options);
        modal::judge_phase(run, options, fit);
        return fit;
      },
      py::arg("omega"), py::arg("vector"), py::arg("modes"), py::arg("steady"));
}

void bind_record_check(py::module_& m) {
  using records::Finding;
  using records::RecordReport;
  py::class_<Finding>(m, "RecordFinding", "What is wrong with a record, where, and what follows")
      .def_property_readonly("kind", [](const Finding& f) { return std::string(records::to_string(f.kind)); })
      .def_property_readonly(
          "severity", [](const Finding& f) { return std::string(records::to_string(f.severity)); },
          "'note', 'mask', 'model' or 'refuse'")
      .def_readonly("channel", &Finding::channel, "empty: the record as a whole")
      .def_readonly("begin", &Finding::begin, "s")
      .def_readonly("end", &Finding::end, "s")
      .def_readonly("samples", &Finding::samples)
      .def_readonly("size", &Finding::size, "SI unit of the channel; of hum the amplitude (peak)")
      .def_readonly("frequency", &Finding::frequency, "Hz, of hum")
      .def_readonly("advice", &Finding::advice)
      .def("__str__", &Finding::text)
      .def("__repr__", [](const Finding& f) { return fmt::format("<whirl.RecordFinding {}>", f.text()); });
  py::class_<RecordReport>(m, "RecordReport", "What is wrong with a record, before anything is fitted to it")
      .def_readonly("findings", &RecordReport::findings)
      .def_property_readonly("refused", &RecordReport::refused, "True: the record cannot be used as it is")
      .def_property_readonly(
          "usable",
          [](const RecordReport& r) {
            py::dict masks;
            for (const records::ChannelMask& mask : r.masks) masks[py::str(mask.channel)] = py::cast(mask.usable);
            return masks;
          },
          "channel -> samples that count, for the channels that lost some")
      .def("__len__", [](const RecordReport& r) { return r.findings.size(); })
      .def("__repr__", [](const RecordReport& r) {
        std::string text = fmt::format("<whirl.RecordReport {}", r.refused() ? "refused" : "usable");
        for (const Finding& f : r.findings) text += "\n  " + f.text();
        return text + ">";
      });
  m.def(
      "check",
      [](const Recording& record, const std::string& x, const std::string& y, const std::string& angle,
         std::vector<double> mains) {
        const records::CheckOptions options{x, y, angle, std::move(mains)};
        const py::gil_scoped_release unlocked;
        return records::check(record, options);
      },
      py::arg("record"), py::kw_only(), py::arg("x") = "x", py::arg("y") = "y", py::arg("angle") = "beta",
      py::arg("mains") = std::vector<double>{50, 60},
      "What is wrong with a record: gaps, dropouts, clipping, spikes, mains hum, drift, swapped axes, wrong units.\n"
      "x, y, angle: channels of a rotor's record; mains: frequencies looked for with their first multiples, Hz.");
  m.def(
      "info",
      [](const std::filesystem::path& path) {
        return as_python(pages::to_json(pages::report_file(io::read_signals(path, {}))));
      },
      py::arg("path"), "What a file of any format holds, as the content of `whirl info --json`.");
}

}  // namespace

void bind_studies(py::module_& m) {
  m.def(
      "_run_over_speeds",
      [](const IdentifiedModel& model, double from_rpm, double to_rpm, double seconds, double dwell_s, double rate_hz,
         double unbalance, std::optional<std::complex<double>> eccentricity) {
        const identification::SpeedRun run{
            from_rpm * kRadPerSecPerRpm, to_rpm * kRadPerSecPerRpm, seconds, dwell_s, rate_hz, unbalance, eccentricity};
        const py::gil_scoped_release unlocked;
        return identification::run_over_speeds(model, run).record;
      },
      py::arg("model"), py::arg("from_rpm"), py::arg("to_rpm"), py::arg("seconds"), py::arg("dwell_s"),
      py::arg("rate_hz"), py::arg("unbalance"), py::arg("eccentricity"));
  m.def("_run_over_record", &identification::run_over_record, py::call_guard<py::gil_scoped_release>(),
        py::arg("model"), py::arg("record"));
  m.def("_decay", &decay, py::arg("record"), py::arg("channel"), py::arg("start"), py::arg("stop"), py::arg("periods"));
  m.def("_sine", &sine, py::arg("points"), py::arg("records"), py::arg("force"), py::arg("channel"),
        py::arg("periods"));
  m.def("_runup", &runup, py::arg("model"), py::arg("from_rpm"), py::arg("to_rpm"), py::arg("limit_mm"),
        py::arg("unbalance"), py::arg("slowest_rpm_s"), py::arg("fastest_rpm_s"), py::arg("drive"));
  m.def("_derive", &derive, py::arg("path"), py::arg("model"));
  m.def("_report", &report_page, py::arg("files"), py::arg("title"), py::arg("service_rpm"), py::arg("slow_roll_rpm"),
        py::arg("about"));
  m.def(
      "_printed",
      [](const std::string& page, const std::filesystem::path& pdf) {
        return py::bytes(pages::printed_page(page, pdf));
      },
      py::arg("page"), py::arg("pdf"));
  bind_transient(m);
  bind_record_check(m);
}

}  // namespace whirl::python
