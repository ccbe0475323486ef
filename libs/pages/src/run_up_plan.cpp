#include "whirl/pages/run_up_plan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/units.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
constexpr double kSensitive = 1;  ///< d log peak / d log rate; a linear rotor stays at 0.5
constexpr double kRaise = 1.05;   ///< a rate is raised by this until the band holds
constexpr int kRaises = 60;

std::string rpm_s(double rate) { return fmt::format("{:.4g} rpm/s", rate / kRadPerSecPerRpm); }

/// The slowest rate for which 97.5 % of the rotors stay within the limit.
std::optional<double> suggest(const RotorModel& rotor, const std::vector<double>& covariance,
                              const response::RunUpOptions& o, const response::RateCurve& curve, bool up,
                              std::optional<response::PeakBand>& band) {
  if (!curve.slowest_safe) return std::nullopt;
  double rate = o.limit > 0 ? *curve.slowest_safe : curve.fastest_useful;
  if (covariance.empty()) return rate;
  const double from = up ? o.from : o.to, to = up ? o.to : o.from;
  for (int k = 0; k < kRaises; ++k, rate *= kRaise) {
    band = response::passage_band(rotor, covariance, from, to, rate);
    if (o.limit == 0 || band->high <= o.limit) return rate;
  }
  return std::nullopt;
}

DriveVerdict try_drive(const RotorModel& rotor, const Drive& d, const response::RunUpOptions& o, double rate) {
  DriveVerdict v;
  v.limit = response::stall_limit(rotor, d.mass, d.torque, o.from, o.to);
  rotor::TorqueModel friction = d.torque;
  friction.motor = friction.motor_slope = 0;
  v.needed = d.inertia * rate + d.mass * response::passage(rotor, o.from, o.to, rate).reaction -
             std::min(friction.torque(o.from), friction.torque(o.to));
  // Ten times as long as without whirl: a drive that has not come through by then stands.
  const double spare = std::max(d.torque.torque(o.from), 1e-3 * d.torque.motor);
  v.run = response::driven_run_up(rotor, d.mass, d.inertia, d.torque, o.from, o.to,
                                  std::min(10 * d.inertia * (o.to - o.from) / spare, 3000.0));
  return v;
}

void judge(RunUpSheet& s, const std::optional<Drive>& drive) {
  for (const auto& [name, curve, rate] :
       {std::tuple{"run-up", &s.plan.up, &s.up_rate}, {"run-down", &s.plan.down, &s.down_rate}}) {
    const auto& p = curve->passages;
    if (!*rate)
      s.summary.fail(fmt::format("{}: no rate up to {} keeps the radius within {} ({} at that rate)", name,
                                 rpm_s(p.back().rate), report::format_amplitude(s.options.limit, AmplitudeKind::peak),
                                 report::format_amplitude(p.back().peak, AmplitudeKind::peak)));
    if (curve->sensitivity > kSensitive)
      s.summary.warn(
          fmt::format("{}: at {} a small change of the rate decides which branch the rotor follows (10 % of "
                      "the rate changes the peak by {:.0f} %)",
                      name, rpm_s(curve->sensitive_rate), 100 * (std::pow(1.1, curve->sensitivity) - 1)));
  }
  if (!s.drive) return;
  if (!s.drive->run.reached)
    s.summary.fail(
        fmt::format("the drive stalls at {:.0f} rpm, its power goes into the whirl; a slow run-up needs {:.4g} N m",
                    s.drive->run.final_speed / kRadPerSecPerRpm, s.drive->limit.torque));
  else if (s.up_rate && drive->torque.torque(s.options.to) < s.drive->needed)
    s.summary.warn(fmt::format("the suggested run-up needs {:.4g} N m, the drive has {:.4g} N m at the last speed",
                               s.drive->needed, drive->torque.motor - drive->torque.motor_slope * s.options.to));
}

io::Json curve_json(const response::RateCurve& c, const std::optional<double>& rate,
                    const std::optional<response::PeakBand>& band) {
  io::Json passages = io::Json::array();
  for (const response::Passage& p : c.passages)
    passages.push(io::Json::object().set("rate", p.rate).set("peak", p.peak).set("peak_speed", p.peak_speed));
  io::Json out = io::Json::object();
  out.set("passages", std::move(passages)).set("fastest_useful", c.fastest_useful);
  out.set("sensitivity", c.sensitivity).set("sensitive_rate", c.sensitive_rate);
  out.set("slow_peak", c.slow_peak);
  if (c.slowest_safe) out.set("slowest_safe", *c.slowest_safe);
  if (rate) out.set("suggested", *rate);
  if (band) out.set("peak_interval", io::Json::array().push(band->low).push(band->high));
  return out;
}

void draw_run(report::Panel& panel, const RunUpSheet& s, double rate, bool up) {
  const double from = up ? s.options.from : s.options.to, to = up ? s.options.to : s.options.from;
  rotor::SpeedProfile profile;
  profile.omega_start = from;
  profile.omega_end = to;
  profile.ramp_time = std::abs(to - from) / rate;
  const double dt = 2 * std::numbers::pi / 60 / std::max({s.options.to, 1.5 * s.rotor.natural_frequency()});
  const AngleSignal angle = rotor::angle_signal(profile, dt);
  const Eigen::VectorXd radius = (rotor::simulate(s.rotor, angle).z.array() - s.rotor.offset).abs();
  const Index n = std::min<Index>(radius.size(), 1500), step = std::max<Index>(1, radius.size() / n);
  Eigen::VectorXd speed(radius.size() / step), largest(speed.size());
  for (Index k = 0; k < speed.size(); ++k) {
    speed[k] = angle.omega[2 * k * step];
    largest[k] = radius.segment(k * step, step).maxCoeff();
  }
  panel.line(fmt::format("{} at {}", up ? "run-up" : "run-down", rpm_s(rate)), speed, largest, {.color = up ? 0 : 1});
}

}  // namespace

RunUpSheet run_up_sheet(const RotorModel& rotor, const std::vector<double>& covariance,
                        const response::RunUpOptions& options, const std::optional<Drive>& drive, Summary parts) {
  RunUpSheet s{rotor, options, response::plan_run_up(rotor, options), {}, {}, {}, {}, {}, std::move(parts), {}, {}};
  s.up_rate = suggest(rotor, covariance, options, s.plan.up, true, s.up_band);
  s.down_rate = suggest(rotor, covariance, options, s.plan.down, false, s.down_band);
  if (drive) s.drive = try_drive(rotor, *drive, options, s.up_rate.value_or(s.plan.up.fastest_useful));
  judge(s, drive);
  return s;
}

namespace {

/// The plan is that of the RotorModel; what the model has beside it is run once at the rates suggested.
void add_further_forces(IdentifiedModel model, RunUpSheet& sheet) {
  const std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  if (terms.empty()) return;
  model.rotor = sheet.rotor;
  const response::RunUpOptions& o = sheet.options;
  sheet.further = names_of(terms);
  Summary& summary = sheet.summary;
  if (const double w = identification::unstable_from(sheet.rotor, terms, o.to); std::isfinite(w))
    summary.fail(fmt::format("with its {} the rotor whirls by itself from {:.0f} rpm on, inside the range",
                             sheet.further, w / kRadPerSecPerRpm));
  for (const auto& [rate, from, to] :
       {std::tuple(sheet.up_rate, o.from, o.to), std::tuple(sheet.down_rate, o.to, o.from)}) {
    if (!rate) continue;
    rotor::SpeedProfile profile;
    profile.omega_start = from;
    profile.omega_end = to;
    profile.ramp_time = std::abs(to - from) / *rate;
    const double fastest = std::max(o.to, sheet.rotor.natural_frequency());
    const rotor::Response run =
        identification::simulate_rotor(model, rotor::angle_signal(profile, 2 * std::numbers::pi / 20 / fastest));
    const double peak = (run.z.array() - sheet.rotor.offset).abs().maxCoeff();
    sheet.further_runs.push_back({*rate, peak, from < to});
    if (o.limit > 0 && !(peak <= o.limit))
      summary.fail(fmt::format("with its {} the run at {} exceeds the limit", sheet.further, rpm_s(*rate)));
  }
}

/// Makes the intervals of the peaks hold those of the readings that the covariance does not cover: one run of each at
/// the suggested rates with all its forces.
void cover_readings(const IdentifiedModel& model, double unbalance, RunUpSheet& s) {
  const response::RunUpOptions& o = s.options;
  for (identification::ModelReading& reading : identification::other_readings(model)) {
    identification::scale_unbalance(*reading.model.rotor, unbalance);
    for (const bool up : {true, false}) {
      const std::optional<double>& rate = up ? s.up_rate : s.down_rate;
      if (!rate) continue;
      rotor::SpeedProfile profile;
      profile.omega_start = up ? o.from : o.to;
      profile.omega_end = up ? o.to : o.from;
      profile.ramp_time = (o.to - o.from) / *rate;
      const double dt = 2 * std::numbers::pi / 60 / std::max(o.to, 1.5 * s.rotor.natural_frequency());
      const rotor::Response run = identification::simulate_rotor(reading.model, rotor::angle_signal(profile, dt));
      const double peak = (run.z.array() - s.rotor.offset).abs().maxCoeff();
      std::optional<response::PeakBand>& band = up ? s.up_band : s.down_band;
      const double own = response::passage(s.rotor, profile.omega_start, profile.omega_end, *rate).peak;
      if (!band) band = response::PeakBand{own, own};
      if (!std::isfinite(peak)) {
        s.summary.add({FindingCode::readings_differ, Consequence::warning, {}, reading.reading},
                      ": its motion diverges");
        if (o.limit > 0) s.summary.fail(fmt::format("with {} the motion exceeds the limit", reading.reading));
        continue;
      }
      band->low = std::min(band->low, peak);
      band->high = std::max(band->high, peak);
      s.summary.add({FindingCode::readings_differ,
                     Consequence::note,
                     {{up ? "peak up" : "peak down", peak, "m"}},
                     reading.reading});
      if (o.limit > 0 && !(peak <= o.limit))
        s.summary.fail(fmt::format("with {} the {} at {} exceeds the limit: {}", reading.reading,
                                   up ? "run-up" : "run-down", rpm_s(*rate),
                                   report::format_amplitude(peak, AmplitudeKind::peak)));
    }
  }
}

}  // namespace

RunUpSheet run_up_sheet(const IdentifiedModel& model, double unbalance, const response::RunUpOptions& options,
                        const std::optional<Drive>& drive, std::string_view file) {
  Summary parts;
  take_parts(identification::Consumer::runup, model, parts, file);
  if (!model.rotor) throw Error("the model has no rotor parameters: a run-up is planned for an identified rotor");
  RotorModel rotor = *model.rotor;
  identification::scale_unbalance(rotor, unbalance);
  std::vector<double> covariance = model.rotor_covariance;
  for (std::size_t k = 0; covariance.size() == 25 && k < 25; ++k) {
    const bool row = k / 5 >= 3, column = k % 5 >= 3;
    covariance[k] *= (row ? unbalance : 1) * (column ? unbalance : 1);
  }
  RunUpSheet sheet = run_up_sheet(rotor, covariance, options, drive, std::move(parts));
  add_further_forces(model, sheet);
  cover_readings(model, unbalance, sheet);
  return sheet;
}

report::Figure run_up_figure(const RunUpSheet& s) {
  report::Figure figure;
  figure.title = "Run-up and run-down";
  figure.description = "Largest radius over the acceleration in both directions, and the suggested runs over speed.";
  report::Panel& top = figure.panel("", {"acceleration", report::kRpmPerSecond}, {"largest radius, peak", {}});
  top.x.scale = report::Scale::logarithmic;
  for (const auto& [name, curve, color] : {std::tuple{"run-up", &s.plan.up, 0}, {"run-down", &s.plan.down, 1}}) {
    const auto n = static_cast<Index>(curve->passages.size());
    Eigen::VectorXd rate(n), peak(n);
    for (Index k = 0; k < n; ++k) {
      rate[k] = curve->passages[static_cast<std::size_t>(k)].rate;
      peak[k] = curve->passages[static_cast<std::size_t>(k)].peak;
    }
    top.line(name, rate, peak, {.color = color, .mark = report::Mark::circle});
  }
  report::show_y_as(top, Quantity::displacement);
  if (s.options.limit > 0) top.horizontal(s.options.limit, "limit");
  if (s.up_rate) top.vertical(*s.up_rate, "suggested up");
  report::Panel& low = figure.panel("", {"speed", report::kRpm}, {"radius, peak", {}});
  // The runs decide the scale: a slow run may reach far above them.
  double largest = s.options.limit;
  for (const auto& [curve, rate] : {std::pair{&s.plan.up, &s.up_rate}, {&s.plan.down, &s.down_rate}})
    for (const response::Passage& p : curve->passages)
      if (*rate && p.rate >= 0.6 * **rate) largest = std::max(largest, p.peak);
  if (largest > 0) low.y.low = 0, low.y.high = 1.1 * largest;
  const response::SlowRun slow = response::slow_run(s.rotor, s.options.from, s.options.to);
  Eigen::VectorXd speed(static_cast<Index>(slow.points.size())), radius(speed.size());
  for (Index k = 0; k < speed.size(); ++k) {
    speed[k] = slow.points[static_cast<std::size_t>(k)].omega;
    radius[k] = slow.points[static_cast<std::size_t>(k)].radius;
    if (largest > 0 && radius[k] > 1.1 * largest) radius[k] = NAN;
  }
  low.line("infinitely slow run-up", speed, radius, {.color = 7, .dash = report::Dash::dashed});
  if (s.up_rate) draw_run(low, s, *s.up_rate, true);
  if (s.down_rate) draw_run(low, s, *s.down_rate, false);
  report::show_y_as(low, Quantity::displacement);
  if (s.options.limit > 0) low.horizontal(s.options.limit, "limit");
  return figure;
}

io::Json to_json(const RunUpSheet& s) {
  io::Json out = io::start_document("whirl.run_up", 1);
  out.set("from", s.options.from).set("to", s.options.to);
  if (s.options.limit > 0) out.set("limit", s.options.limit);
  out.set("up", curve_json(s.plan.up, s.up_rate, s.up_band));
  out.set("down", curve_json(s.plan.down, s.down_rate, s.down_band));
  if (s.drive)
    out.set("drive", io::Json::object()
                         .set("stall_torque", s.drive->limit.torque)
                         .set("stall_speed", s.drive->limit.speed)
                         .set("torque_needed", s.drive->needed)
                         .set("reached", s.drive->run.reached)
                         .set("seconds", s.drive->run.seconds)
                         .set("final_speed", s.drive->run.final_speed)
                         .set("peak", s.drive->run.peak));
  return out.set("summary", whirl::to_json(s.summary));
}

}  // namespace whirl::pages
