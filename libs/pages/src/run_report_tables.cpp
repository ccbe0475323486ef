#include "whirl/pages/run_report_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/record_maps.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/report/format.hpp"
#include "whirl/rig/segments.hpp"

namespace whirl::pages {
namespace {

using report::Align;
using report::format_fixed;
constexpr double kSkip = 0.5;  // s of start transient

std::string rpm(double speed) { return fmt::format("{:.0f}", speed / kRadPerSecPerRpm); }
std::string um(double metres) { return report::format_number(1e6 * metres, 3); }

// 1X amplitude at the speed nearest to `speed`, when the run came within 2 % of it.
std::optional<double> amplitude_at(const signal::SynchronousCurve& curve, double speed) {
  Eigen::Index nearest = 0;
  const double distance = (curve.speed.array() - speed).abs().minCoeff(&nearest);
  if (distance > 0.02 * speed) return std::nullopt;
  return std::abs(curve.vector[nearest]);
}

}  // namespace

report::Table run_table(const std::vector<NamedFile<Recording>>& records) {
  report::Table t;
  t.caption = "Records";
  t.columns = {{"record", "", Align::left},  {"rate", "Hz"}, {"duration", "s"}, {"speed", "rpm"}, {"sweep", "rpm/s"},
               {"channels", "", Align::left}};
  for (const auto& [name, r] : records) {
    std::vector<std::string> names;
    for (const Channel& c : r.channels) names.push_back(c.name);
    const auto turning = readable_rotation(r);
    t.add({name, report::format_number(r.rate(), 5), report::format_number(r.duration(), 4),
           turning ? rpm(turning->speed[0]) + " → " + rpm(turning->speed[turning->size() - 1]) : "–",
           turning ? fmt::format("{:.0f}", turning->sweep_rate(r.dt) / kRadPerSecPerRpm) : "–",
           fmt::format("{}", fmt::join(names, ", "))});
  }
  t.notes = {"Sweep: largest rate of change of the speed over a twentieth of the run."};
  return t;
}

report::Table critical_table(const std::vector<CriticalRow>& rows, double service_speed) {
  report::Table t;
  t.caption = "Critical speeds: largest 1X amplitude and half-power amplification factor";
  t.columns = {{"run", "", Align::left}, {"channel", "", Align::left}, {"critical", "rpm"},
               {"1X, peak", ""},         {"0.707 at", "rpm"},          {"AF", ""},
               {"sweep", "rpm/s"},       {"sweep · AF²", ""}};
  const bool service = service_speed > 0;
  if (service) {
    t.columns.push_back({"margin", "%"});
    t.columns.push_back({"required", "%"});
  }
  for (const CriticalRow& r : rows) {
    std::vector<std::string> row{r.run, r.channel, rpm(r.critical),
                                 report::format_quantity(r.amplitude, r.curve.quantity)};
    if (r.reading) {
      const diagnosis::Amplification& a = *r.reading;
      row.insert(row.end(), {rpm(a.low) + ", " + rpm(a.high), format_fixed(a.factor, 1),
                             fmt::format("{:.0f}", a.sweep_rate / kRadPerSecPerRpm),
                             format_fixed(a.sweep * a.factor * a.factor, 2)});
    } else {
      row.insert(row.end(), {"–", "–", "–", "–"});
    }
    if (service) {
      const bool below = r.critical < service_speed;
      row.push_back(format_fixed(100 * std::abs(service_speed - r.critical) / service_speed, 1));
      row.push_back(r.reading ? format_fixed(100 * diagnosis::required_margin(r.reading->factor, below), 1) : "–");
    }
    t.add(std::move(row));
  }
  t.notes = {
      "AF = critical speed / width at 0.707 of the peak (API 617, 684). A run through the critical speed widens, "
      "shifts and "
      "lowers the peak: sweep · AF² = |dΩ/dt| AF² / Ω² should be far below 1 (it is the sweep in bandwidths squared); "
      "where "
      "it is not, AF is that of the run, not of the rotor."};
  if (service) {
    t.notes.push_back(fmt::format(
        "Margin: distance of the critical speed from {} rpm. Required: 17 (1 − 1/(AF − 1.5)) %, at most 16 % "
        "below the operating range, 10 % more above it; nothing when AF < 2.5.",
        rpm(service_speed)));
  }
  return t;
}

report::Table zone_table(const std::vector<CriticalRow>& rows, double service_speed) {
  report::Table t;
  t.caption = "Shaft vibration zones (ISO 20816-3): 1X, peak-to-peak";
  t.columns = {{"run", "", Align::left},
               {"channel", "", Align::left},
               {"at", "", Align::left},
               {"speed", "rpm"},
               {"1X, p-p", "µm"},
               {"A/B", "µm"},
               {"B/C", "µm"},
               {"C/D", "µm"},
               {"zone", "", Align::center}};
  const auto add = [&](const CriticalRow& r, const char* at, double speed, double amplitude) {
    t.add({r.run, r.channel, at, rpm(speed), um(2 * amplitude), um(diagnosis::shaft_vibration_limit('A', speed)),
           um(diagnosis::shaft_vibration_limit('B', speed)), um(diagnosis::shaft_vibration_limit('C', speed)),
           std::string(1, diagnosis::shaft_vibration_zone(2 * amplitude, speed))});
  };
  for (const CriticalRow& r : rows) {
    if (r.curve.quantity != Quantity::displacement) continue;  // a housing is judged by `housing_table`
    const double speed = service_speed > 0 ? service_speed : r.curve.speed.maxCoeff();
    if (const auto a = amplitude_at(r.curve, speed))
      add(r, service_speed > 0 ? "service speed" : "highest speed", speed, *a);
    add(r, "largest (passage)", r.critical, r.amplitude);
  }
  t.notes = {
      "The zones apply to steady running of machines above 15 kW (the standard's scope); they do not apply to the "
      "passage "
      "through a critical speed, whose row is for orientation."};
  return t;
}

std::string BalanceQuality::words() const { return std::isfinite(held) ? fmt::format("G {:g}", held) : "above G 4000"; }

double BalanceQuality::allowed() const { return 1e3 * kGradeOfCentrifuges / speed; }

std::vector<BalanceQuality> balance_quality(const std::vector<NamedFile<IdentifiedModel>>& models,
                                            const std::vector<CriticalRow>& rows, double service_speed) {
  std::vector<BalanceQuality> out;
  double speed = service_speed;
  for (const CriticalRow& r : rows) {
    if (service_speed <= 0) speed = std::max(speed, r.curve.speed.maxCoeff());
  }
  for (const auto& [name, model] : models) {
    const Estimate* e = model.parameter("e");
    if (e == nullptr || !(speed > 0)) continue;
    const double grade = diagnosis::balance_grade(e->value, speed);
    out.push_back({name, *e, speed, grade, diagnosis::balance_grade_class(grade)});
  }
  return out;
}

report::Table grade_table(const std::vector<BalanceQuality>& models) {
  report::Table t;
  t.caption = "Balance quality (ISO 21940-11) from the identified eccentricity";
  t.columns = {{"model", "", Align::left}, {"e", "µm"},   {"speed", "rpm"},
               {"e · Ω", "mm/s"},          {"grade", ""}, {"e for G 6.3", "µm"}};
  for (const BalanceQuality& q : models) {
    const Estimate& e = q.eccentricity;
    t.add({q.model, report::format_estimate({1e6 * e.value, 1e6 * e.sd, 1e6 * e.low, 1e6 * e.high}), rpm(q.speed),
           report::format_number(1e3 * q.grade, 3), q.words(), report::format_number(q.allowed(), 3)});
  }
  t.notes = {"Centrifuges (separators, decanters): G 6.3. The speed is the service speed, or the highest of the runs."};
  return t;
}

report::Table mode_list(const std::string& name, const ModalModel& modes) {
  report::Table t;
  t.caption = "Modes, " + name;
  t.columns = {{"mode", ""}, {"natural frequency", "Hz"}, {"damping ratio", "%"}};
  for (std::size_t i = 0; i < modes.modes.size(); ++i) {
    const Mode& m = modes.modes[i];
    t.add({std::to_string(i + 1), report::format_estimate(m.frequency),
           report::format_estimate(
               {100 * m.damping.value, 100 * m.damping.sd, 100 * m.damping.low, 100 * m.damping.high})});
  }
  return t;
}

namespace {

/// In mm as the column says, or with the unit of velocity and acceleration in the cell.
std::string error_text(double rms, Quantity quantity) {
  return quantity == Quantity::displacement ? report::format_number(1e3 * rms) : report::format_quantity(rms, quantity);
}

Quantity quantity_in(const io::JsonReader& run) {
  for (const Quantity q : {Quantity::velocity, Quantity::acceleration})
    if (run.has("quantity") && run.at("quantity").text() == to_string(q)) return q;
  return Quantity::displacement;
}

}  // namespace

report::Table validation_columns() {
  report::Table t;
  t.caption = "Models run free against records, rms error";
  t.columns = {{"model", "", Align::left},
               {"record", "", Align::left},
               {"used for the fit", ""},
               {"x", "mm rms"},
               {"y", "mm rms"},
               {"noise of x", "mm rms"},
               {"nrmse", "%"},
               {"note", "", Align::left}};
  t.notes = {
      "Errors against the measured record contain its noise. Fitted to each run: its initial state and the "
      "constant of each channel."};
  return t;
}

void add_validation(report::Table& table, const std::string& model, const std::string& record, bool trained,
                    const identification::Validation& v) {
  table.add({model, record, trained ? "yes" : "no", error_text(v.rmse_x, v.quantity), error_text(v.rmse_y, v.quantity),
             error_text(v.noise_x, v.quantity), format_fixed(100 * v.nrmse, 2),
             v.fold_sensitive ? "fold-sensitive" : std::string(to_string(v.summary.status))});
}

void add_validation_file(report::Table& table, const std::string& name, const io::Json& json) {
  const io::JsonReader in(json, name);
  for (const io::JsonReader& run : in.at("runs").items()) {
    if (!run.has("rmse_x")) continue;
    const Quantity quantity = quantity_in(run);
    table.add({name, run.at("file").text(), "–", error_text(run.at("rmse_x").number_or_nan(), quantity),
               error_text(run.at("rmse_y").number_or_nan(), quantity), "–",
               format_fixed(100 * run.at("nrmse").number_or_nan(), 2), "as written"});
  }
}

std::string force_text(const tuning::ClosedLoopMetrics& m) {
  const auto axis = [](const char* name, double rms, double peak) {
    return fmt::format("{} {} N rms, {} N peak", name, format_fixed(rms, 2), format_fixed(peak, 1));
  };
  return axis("x", m.force_rms, m.force_peak) + "; " + axis("y", m.force_y_rms, m.force_y_peak);
}

report::Table run_file_table(const std::string& name, const io::Json& json, bool with_paper) {
  const io::JsonReader in(json, name);
  tuning::ClosedLoopMetrics m;
  const auto segments = in.at("segments").items();
  for (std::size_t i = 0; i < std::min<std::size_t>(4, segments.size()); ++i) {
    m.open.segment[i] = segments[i].at("open_peak").number();
    m.closed.segment[i] = segments[i].at("closed_peak").number();
  }
  m.open.all = in.at("whole").at("open_peak").number();
  m.closed.all = in.at("whole").at("closed_peak").number();
  report::Table t = segment_table(m, "Segments as written in " + name, with_paper);
  m.force_rms = in.at("force_rms").number();
  m.force_peak = in.at("force_peak").number();
  std::string force = fmt::format("x {} N rms, {} N peak", format_fixed(m.force_rms, 2), format_fixed(m.force_peak, 1));
  if (in.has("force_y_rms")) {
    m.force_y_rms = in.at("force_y_rms").number();
    m.force_y_peak = in.at("force_y_peak").number();
    force = force_text(m);
  }
  t.notes.push_back(fmt::format("Force {}; total variation in x {} N/s; {} % of ticks saturated; trip: {}.", force,
                                format_fixed(in.at("total_variation").number(), 0),
                                format_fixed(100 * in.at("saturated").number(), 2), in.at("trip").text()));
  return t;
}

std::vector<std::pair<std::string, std::string>> controller_values(const ControllerDesign& d) {
  std::vector<std::pair<std::string, std::string>> out{
      {"law", d.law},
      {"estimator", d.estimator},
      {"unbalance feedforward", d.feedforward ? "yes" : "no"},
      {"sample time", report::format_quantity(d.sample_time, Quantity::time)},
      {"delay assumed", report::format_quantity(d.delay, Quantity::time)},
      {"force limit", report::format_quantity(d.force_limit, Quantity::force)}};
  for (const auto& [name, value] : d.parameters) out.emplace_back(name, report::format_number(value, 5));
  for (const auto& [name, value] : d.margins) out.emplace_back("margin: " + name, report::format_number(value, 4));
  return out;
}

std::vector<std::pair<std::string, std::string>> effort_values(const tuning::ClosedLoopMetrics& m) {
  return {{"force", force_text(m)},
          {"total variation of the force in x", format_fixed(m.total_variation, 0) + " N/s"},
          {"at the force limit", format_fixed(100 * m.saturated, 2) + " % of ticks"},
          {"largest radius", report::format_amplitude(m.radial_peak, AmplitudeKind::peak)},
          {"standstill",
           m.standstill_rms > 0 ? report::format_amplitude(m.standstill_rms, AmplitudeKind::rms) : "not in the run"}};
}

tuning::ClosedLoopMetrics metrics_of_log(const Recording& log, double natural_frequency, double force_limit) {
  tuning::ClosedLoopMetrics m;
  const std::vector<int> segment = rig::segments(log["omega"], natural_frequency);
  const auto skip = static_cast<Eigen::Index>(std::lround(kSkip / log.dt));
  m.open = rig::segment_peaks(log["x_open"], segment, skip);
  m.closed = rig::segment_peaks(log["x_true"], segment, skip);
  m.suppression = rig::suppression(m.open, m.closed);
  const Eigen::VectorXd &x = log["x_true"], &y = log["y_true"], &u = log["ux"], &across = log["uy"];
  const Eigen::Index n = x.size();
  m.radial_peak = std::sqrt(
      (x.tail(n - std::min(skip, n - 1)).cwiseAbs2() + y.tail(n - std::min(skip, n - 1)).cwiseAbs2()).maxCoeff());
  m.force_rms = std::sqrt(u.squaredNorm() / static_cast<double>(n));
  m.force_peak = u.cwiseAbs().maxCoeff();
  m.force_y_rms = std::sqrt(across.squaredNorm() / static_cast<double>(n));
  m.force_y_peak = across.cwiseAbs().maxCoeff();
  m.total_variation = (u.tail(n - 1) - u.head(n - 1)).cwiseAbs().sum() / log.duration();
  if (force_limit > 0) {
    m.saturated = static_cast<double>(
                      (u.array().abs() >= 0.999 * force_limit || across.array().abs() >= 0.999 * force_limit).count()) /
                  static_cast<double>(n);
  }
  Eigen::Index still = n;
  while (still > 0 && log["omega"][still - 1] == 0) --still;
  still += skip;
  if (still + 10 < n) {
    const double count = static_cast<double>(n - still);
    m.standstill_rms = std::sqrt(std::max(x.tail(n - still).squaredNorm(), y.tail(n - still).squaredNorm()) / count);
  }
  return m;
}

std::vector<report::Segment> segment_times(const Recording& log, double natural_frequency) {
  const std::vector<int> segment = rig::segments(log["omega"], natural_frequency);
  std::vector<report::Segment> out;
  for (std::size_t i = 0; i < segment.size(); ++i) {
    const double t = log.t0 + log.dt * static_cast<double>(i);
    const std::string name = fmt::format("{}", segment[i] + 1);
    if (out.empty() || out.back().name != name) out.push_back({name, t, t});
    out.back().end = t;
  }
  return out;
}

}  // namespace whirl::pages
