#include "whirl/balancing/job.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/io/units.hpp"

namespace whirl::balancing {
namespace {

using Eigen::Index;

/// Readings of one run at one speed, before they are sorted into rows.
struct Reading {
  std::string run;
  double time = 0, speed = 0;
  Eigen::VectorXcd masses, probes;
};

struct RawJob {
  std::vector<std::string> planes, probes;
  std::vector<Reading> readings;
  Quantity quantity = Quantity::displacement;
  std::string unit;    ///< as written
  bool phases = true;  ///< false: no probe has any
};

/// The unit after the first column or key that begins with this.
std::string unit_written(const std::string& text, const std::string& name) {
  const std::size_t at = text.find(name + "_");
  if (at == std::string::npos) return {};
  const std::size_t begin = at + name.size() + 1;
  return text.substr(begin, text.find_first_not_of("abcdefghijklmnopqrstuvwxyz_0123456789", begin) - begin);
}

/// Names of columns "NAME_amp" / "NAME_phase" or "NAME_mass" / "NAME_angle".
std::vector<std::string> pairs(const io::Table& table, const std::string& first, const std::string& second) {
  std::vector<std::string> names;
  for (const Channel& c : table.columns) {
    if (!c.name.ends_with(first)) continue;
    names.push_back(c.name.substr(0, c.name.size() - first.size()));
    if (second != first) table.in(names.back() + second, Quantity::angle);
  }
  for (const Channel& c : table.columns)
    if (c.name.ends_with(second)) table.at(c.name.substr(0, c.name.size() - second.size()) + first);
  return names;
}

/// What the amplitudes of a table are: one kind of motion for all probes.
Quantity reading_quantity(const std::string& path, const io::Table& table, const std::vector<std::string>& probes) {
  const Quantity first = table.at(probes.front() + "_amp").quantity;
  for (const std::string& probe : probes) {
    const Quantity q = table.at(probe + "_amp").quantity;
    if (q != Quantity::displacement && q != Quantity::velocity && q != Quantity::acceleration)
      throw Error(
          fmt::format("{}: column '{}_amp' is a {}, must be a displacement (_um, _mil), a velocity (_mm_s) or an "
                      "acceleration (_g, _m_s2)",
                      path, probe, to_string(q)));
    if (q != first)
      throw Error(
          fmt::format("{}: column '{}_amp' is a {}, '{}_amp' a {}: balance the probes of one quantity at a time", path,
                      probe, to_string(q), probes.front(), to_string(first)));
  }
  return first;
}

/// Refuses a header in which a column of a balancing table lacks its unit, with the name that it wants.
void require_units(const std::string& path, const std::string& text) {
  constexpr std::pair<std::string_view, std::string_view> kEndings[] = {
      {"_amp", "_um (or _mil, _mm_s, _in_s, _g, _m_s2); peak, pp or rms is stated by --amplitude"},
      {"_phase", "_deg (or _rad)"},
      {"_mass", "_gram (or _kg)"},
      {"_angle", "_deg (or _rad)"}};
  const std::string header = text.substr(0, text.find_first_of("\r\n"));
  for (std::size_t begin = 0; begin <= header.size();) {
    const std::size_t end = std::min(header.find_first_of(",;\t", begin), header.size());
    const std::string_view name = std::string_view(header).substr(begin, end - begin);
    if (name == "run" && header.find("_amp") != header.npos)
      throw Error::in_file(path, 1, "column 'run' needs a unit: run_1");
    for (const auto& [ending, unit] : kEndings) {
      const std::size_t at = name.rfind(ending), behind = at + ending.size();
      const bool other = at != std::string_view::npos && behind < name.size() && name[behind] == '_' &&
                         io::split_unit(name).unit == nullptr;
      if (name.ends_with(ending) || other)
        throw Error::in_file(path, 1,
                             fmt::format("column '{}' needs a unit: {}{}", name, name.substr(0, behind), unit));
    }
    if (header.find("run_1") != header.npos && !name.empty() && io::split_unit(name).unit == nullptr)
      throw Error::in_file(path, 1, "column " + io::unit_problem(name));
    begin = end + 1;
  }
}

/// The table; one whose header is that of no balancing table is refused with the header wanted.
io::Table read_runs(const std::string& path, const io::CsvOptions& options) {
  try {
    return io::read_table(path, options);
  } catch (const Error&) {
    if (!std::filesystem::exists(path)) throw;
    const std::string text = io::read_text(path);
    require_units(path, text);
    if (text.find("run_1") != std::string::npos) throw;
    throw Error::in_file(path, 1,
                         "a balancing table needs the header run_1,speed_rpm,PROBE_amp_um,PROBE_phase_deg,"
                         "PLANE_mass_gram,PLANE_angle_deg (one row per run and speed; PROBE and PLANE are your names, "
                         "units follow the names); see docs/balancing.md");
  }
}

/// A run without a mass on a plane may leave its two cells empty; every other cell holds a number.
void fill_empty_masses(const std::string& path, io::Table& table, const std::vector<std::string>& planes) {
  const auto column = [&](const std::string& name) { return std::ranges::find(table.columns, name, &Channel::name); };
  for (const std::string& plane : planes) {
    Eigen::VectorXd &mass = column(plane + "_mass")->samples, &angle = column(plane + "_angle")->samples;
    for (Index i = 0; i < mass.size(); ++i)
      if (std::isnan(mass[i]) && std::isnan(angle[i])) mass[i] = angle[i] = 0;
  }
  for (const Channel& c : table.columns)
    for (Index i = 0; i < c.samples.size(); ++i)
      if (std::isnan(c.samples[i]))
        throw Error::in_file(path, table.first_line + static_cast<long>(i),
                             "column '" + c.name +
                                 "' is empty: every run has every reading; a run without a mass on a plane has mass "
                                 "and angle 0, or both cells empty");
}

/// Says where phases headed as degrees are radians by their size: four or more that lie anywhere on a circle come so
/// close to zero once in a million jobs.
void doubt_degrees(const io::Table& table, const std::string& header, const std::vector<std::string>& probes) {
  long readings = 0;
  for (const std::string& probe : probes) {
    if (unit_written(header, probe + "_phase") != "deg") return;
    for (const double phase : table[probe + "_phase"] / kRadPerDegree) {
      if (std::abs(phase) > kTwoPi || std::abs(phase - std::round(phase)) < 1e-9) return;
      ++readings;
    }
  }
  if (readings >= 4)
    io::remark(table.source,
               fmt::format("all {} phases lie within 6.28 deg of 0: are they in rad (a header {}_phase_rad)?", readings,
                           probes.front()));
}

RawJob read_csv_job(const std::string& path, const VectorConvention& v) {
  io::CsvOptions one_run;  // as found, beside a prior
  one_run.min_samples = 1;
  one_run.gaps = true;
  io::Table table = read_runs(path, one_run);
  RawJob raw;
  raw.phases = std::any_of(table.columns.begin(), table.columns.end(),
                           [](const Channel& c) { return c.name.ends_with("_phase"); });
  raw.probes = pairs(table, "_amp", raw.phases ? "_phase" : "_amp");
  raw.planes = pairs(table, "_mass", "_angle");
  if (raw.probes.empty() || raw.planes.empty())
    throw Error(path +
                ": a balancing table has columns PROBE_amp_um, PROBE_phase_deg, PLANE_mass_gram and "
                "PLANE_angle_deg, and run_1");
  for (const std::string& plane : raw.planes) table.in(plane + "_mass", Quantity::mass);
  fill_empty_masses(path, table, raw.planes);
  raw.quantity = reading_quantity(path, table, raw.probes);
  const std::string text = io::read_text(path);
  raw.unit = unit_written(text, raw.probes.front() + "_amp");
  if (raw.phases) doubt_degrees(table, text, raw.probes);
  const Eigen::VectorXd& run = table.in("run", Quantity::dimensionless);
  if (const std::size_t least = 1 + 2 * raw.planes.size(); !raw.phases && static_cast<std::size_t>(run.size()) < least)
    throw Error(
        fmt::format("{}: no column '{}_phase': amplitudes alone need {} runs at least (as found, and a trial "
                    "mass at several angles on each plane)",
                    path, raw.probes.front(), least));
  const Channel* speed = table.find("speed");
  if (speed != nullptr) table.in("speed", Quantity::angular_velocity);
  const Channel* time = table.find("time") != nullptr ? table.find("time") : table.find("t");
  for (const Channel& c : table.columns) {
    const bool known = c.name == "run" || &c == speed || &c == time || c.name.ends_with("_amp") ||
                       c.name.ends_with("_phase") || c.name.ends_with("_mass") || c.name.ends_with("_angle");
    if (!known)
      throw Error(path + ": column '" + c.name + "' is not part of a balancing table (see docs/balancing.md)");
  }
  for (Index i = 0; i < table.rows(); ++i) {
    Reading r;
    r.run = fmt::format("{:g}", run[i]);
    r.time = time != nullptr ? time->samples[i] : run[i];
    r.speed = speed != nullptr ? speed->samples[i] : 0;
    if (r.speed < 0)
      throw Error::in_file(
          path, table.first_line + static_cast<long>(i),
          "the speed is negative: it is counted without sign, and --angles and --phase state the sense");
    r.masses.resize(static_cast<Index>(raw.planes.size()));
    r.probes.resize(static_cast<Index>(raw.probes.size()));
    for (std::size_t p = 0; p < raw.planes.size(); ++p)
      r.masses[static_cast<Index>(p)] =
          std::polar(1.0, v.angle_sign() * table[raw.planes[p] + "_angle"][i]) * table[raw.planes[p] + "_mass"][i];
    for (std::size_t p = 0; p < raw.probes.size(); ++p) {
      const double amplitude = table[raw.probes[p] + "_amp"][i];
      if (amplitude < 0)
        throw Error::in_file(path, table.first_line + static_cast<long>(i),
                             raw.probes[p] + "_amp is negative: an amplitude is >= 0");
      r.probes[static_cast<Index>(p)] =
          raw.phases
              ? amplitude * v.amplitude_factor() * std::polar(1.0, v.phase_sign() * table[raw.probes[p] + "_phase"][i])
              : std::complex<double>(amplitude * v.amplitude_factor(), std::isnan(amplitude) ? kNaN : 0);
    }
    raw.readings.push_back(std::move(r));
  }
  return raw;
}

std::vector<double> require_numbers(const io::Settings& s, const std::string& path, Quantity quantity, std::size_t n) {
  if (!s.has(path)) throw Error(s.source() + ": " + path + " is missing");
  std::vector<double> values = s.numbers(path, quantity, {});
  if (values.size() != n) throw s.error(path, fmt::format("{} values are needed, {} were found", n, values.size()));
  return values;
}

JobPlan read_plan(const io::Settings& s, const VectorConvention& v, std::size_t probes, Quantity readings) {
  JobPlan p;
  const double sign = v.angle_sign();
  p.edge = s.text("setup.edge", p.edge, {"leading", "trailing"});
  p.keyphasor = sign * s.number("setup.keyphasor_angle", Quantity::angle, 0);
  p.notch = s.number("setup.notch_width", Quantity::angle, 0, 0, 2 * std::numbers::pi);
  if (s.has("setup.probe_angles"))
    for (const double angle : require_numbers(s, "setup.probe_angles", Quantity::angle, probes))
      p.probe_angles.push_back(sign * angle);
  p.critical_speed = s.number("setup.critical_speed", Quantity::angular_velocity, 0, 0);
  p.trial = s.number("plan.trial_mass", Quantity::mass, 0, 0);
  p.limit = s.number("plan.limit_mass", Quantity::mass, 0, 0);
  p.target = s.number("plan.target_amplitude", readings, 0, 0);
  p.allowed = s.number("plan.allowed_amplitude", readings, 0, 0);
  p.noise = s.number("plan.noise", readings, 0, 0);
  p.slow_roll = s.number("plan.slow_roll_speed", Quantity::angular_velocity, 0, 0);
  p.places.holes = static_cast<int>(s.integer("plan.holes", 0, 0, 1000));
  p.places.first_hole = s.number("plan.first_hole", Quantity::angle, 0);
  p.places.piece = s.number("plan.piece_mass", Quantity::mass, 0, 0);
  p.places.hole = s.number("plan.hole_mass", Quantity::mass, 0, 0);
  p.criterion = criterion_of(s.text("plan.criterion", "", {"", "least-squares", "min-max"}));
  p.drift = drift_of(s.text("plan.drift", "", {"", "automatic", "linear", "none"}));
  p.drop_dependent = s.flag("plan.drop_dependent", false);
  p.rotor.mass = s.number("machine.mass", Quantity::mass, 0, 0);
  p.rotor.radius = s.number("machine.radius", Quantity::displacement, 0, 0);
  p.rotor.grade = s.number("machine.grade", Quantity::dimensionless, 0, 0);
  p.rotor.service_speed = s.number("machine.service_speed", Quantity::angular_velocity, 0, 0);
  return p;
}

RawJob read_toml_job(const std::string& path, VectorConvention& v, bool may_be_empty, JobFile& file) {
  const io::Settings s = io::read_settings(path);
  RawJob raw;
  v.phase = s.text("job.phase", v.phase, {"lag", "lead"});
  v.amplitude = s.text("job.amplitude", v.amplitude, {"0p", "peak", "pp", "rms"});
  v.angles = s.text("job.angles", v.angles, {"with", "against"});
  v.amplitude_stated = v.amplitude_stated || s.has("job.amplitude");
  v.sense_stated = v.sense_stated || (s.has("job.phase") && s.has("job.angles"));
  raw.planes = s.texts("job.planes", {});
  raw.probes = s.texts("job.probes", {});
  if (raw.planes.empty() || raw.probes.empty()) throw Error(path + ": [job] needs planes = [...] and probes = [...]");
  raw.unit = s.text("job.unit", "um", {"um", "mil", "mm_s", "in_s", "g", "m_s2"});
  raw.quantity = io::find_unit(raw.unit)->quantity;
  const std::vector<double> speeds = s.numbers("job.speeds", Quantity::angular_velocity, {0.0});
  if (std::any_of(speeds.begin(), speeds.end(), [](double speed) { return speed < 0; }))
    throw s.error("job.speeds", "a speed is negative: it is counted without sign, and job.angles states the sense");
  file.stated_speeds = speeds;
  file.plan = read_plan(s, v, raw.probes.size(), raw.quantity);
  if (s.count("run") == 0 && !may_be_empty) throw Error(path + ": no [[run]]");
  Eigen::VectorXcd on = Eigen::VectorXcd::Zero(static_cast<Index>(raw.planes.size()));
  for (std::size_t r = 0; r < s.count("run"); ++r) {
    const std::string at = fmt::format("run[{}].", r);
    Reading reading;
    reading.run = s.text(at + "name", fmt::format("{}", r + 1));
    reading.time = s.number(at + "time", Quantity::time, static_cast<double>(r));
    file.sweeps.push_back(s.number(at + "sweep", Quantity::dimensionless, kNaN));
    if (!s.flag(at + "keep", false)) on.setZero();
    if (s.has(at + "masses")) {
      const auto masses = require_numbers(s, at + "masses", Quantity::mass, raw.planes.size());
      const auto angles = require_numbers(s, at + "angles", Quantity::angle, raw.planes.size());
      for (std::size_t p = 0; p < masses.size(); ++p)
        on[static_cast<Index>(p)] += masses[p] * std::polar(1.0, v.angle_sign() * angles[p]);
    }
    reading.masses = on;
    const auto amplitudes = require_numbers(s, at + "amplitudes", raw.quantity, raw.probes.size() * speeds.size());
    if (r == 0) raw.phases = s.has(at + "phases");
    const auto phases = raw.phases ? require_numbers(s, at + "phases", Quantity::angle, amplitudes.size())
                                   : std::vector<double>(amplitudes.size(), 0);
    std::vector<bool> unread(amplitudes.size(), false);
    for (const double k : s.numbers(at + "unread", Quantity::dimensionless, {})) {
      if (k < 1 || k > static_cast<double>(unread.size()) || k != std::floor(k))
        throw s.error(at + "unread", fmt::format("positions are 1 to {}", unread.size()));
      unread[static_cast<std::size_t>(k) - 1] = true;
    }
    for (std::size_t k = 0; k < speeds.size(); ++k) {
      reading.speed = speeds[k];
      reading.probes.resize(static_cast<Index>(raw.probes.size()));
      for (std::size_t p = 0; p < raw.probes.size(); ++p) {
        const std::size_t i = k * raw.probes.size() + p;
        if (amplitudes[i] < 0) throw s.error(at + "amplitudes", "an amplitude is >= 0");
        reading.probes[static_cast<Index>(p)] =
            unread[i] ? std::complex<double>(kNaN, kNaN)
                      : amplitudes[i] * v.amplitude_factor() * std::polar(1.0, v.phase_sign() * phases[i]);
      }
      raw.readings.push_back(reading);
    }
  }
  s.finish();
  return raw;
}

/// Mean of the readings at slow roll, per probe, taken off the others.
void take_off_slow_roll(RawJob& raw, double slow_roll, const std::string& path, JobFile& file) {
  if (slow_roll <= 0) return;
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(static_cast<Index>(raw.probes.size()));
  Eigen::VectorXd n = Eigen::VectorXd::Zero(sum.size());
  for (const Reading& r : raw.readings)
    for (Index p = 0; p < sum.size() && r.speed <= slow_roll; ++p)
      if (!std::isnan(std::abs(r.probes[p]))) sum[p] += r.probes[p], n[p] += 1;
  if (n.minCoeff() == 0)
    throw Error(fmt::format("{}: no reading of {} at or below the slow-roll speed of {:g} rpm", path,
                            raw.probes[static_cast<std::size_t>(std::min_element(n.begin(), n.end()) - n.begin())],
                            slow_roll * 30 / std::numbers::pi));
  std::erase_if(raw.readings, [&](const Reading& r) { return r.speed <= slow_roll; });
  for (Reading& r : raw.readings) r.probes -= (sum.array() / n.array()).matrix();
  file.slow_roll = raw.probes;
}

}  // namespace

std::optional<diagnosis::Criterion> criterion_of(const std::string& name) {
  if (name.empty()) return {};
  return name == "min-max" ? diagnosis::Criterion::min_max : diagnosis::Criterion::least_squares;
}

std::optional<diagnosis::Drift> drift_of(const std::string& name) {
  if (name.empty()) return {};
  return name == "none"     ? diagnosis::Drift::none
         : name == "linear" ? diagnosis::Drift::linear
                            : diagnosis::Drift::automatic;
}

VectorConvention VectorConvention::stated(const std::string& phase, const std::string& amplitude,
                                          const std::string& angles) {
  VectorConvention v;
  if (!phase.empty()) v.phase = phase;
  if (!amplitude.empty()) v.amplitude = amplitude;
  if (!angles.empty()) v.angles = angles;
  v.amplitude_stated = !amplitude.empty();
  v.sense_stated = !phase.empty() && !angles.empty();
  return v;
}

double VectorConvention::amplitude_factor() const {
  return amplitude == "pp" ? 0.5 : amplitude == "rms" ? std::numbers::sqrt2 : 1;
}

void VectorConvention::check() const {
  const auto one_of = [](const std::string& flag, const std::string& value, std::vector<std::string> allowed) {
    if (std::find(allowed.begin(), allowed.end(), value) == allowed.end())
      throw Error::in_field(flag, value, fmt::format("{}", fmt::join(allowed, ", ")));
  };
  one_of("--phase", phase, {"lag", "lead"});
  one_of("--amplitude", amplitude, {"0p", "peak", "pp", "rms"});
  one_of("--angles", angles, {"with", "against"});
}

JobFile read_job(const std::string& path, VectorConvention convention, double slow_roll, bool may_be_empty) {
  convention.check();
  JobFile file;
  RawJob raw =
      path.ends_with(".toml") ? read_toml_job(path, convention, may_be_empty, file) : read_csv_job(path, convention);
  if (slow_roll <= 0) slow_roll = file.plan.slow_roll;
  if (!raw.phases && slow_roll > 0)
    throw Error(path + ": a slow roll is a vector: it cannot be taken off readings without phase");
  if (!raw.readings.empty()) take_off_slow_roll(raw, slow_roll, path, file);
  file.convention = convention;
  file.probes = raw.probes;
  file.quantity = raw.quantity;
  file.unit = raw.unit;
  file.job.phases = raw.phases;
  // Speeds within half a percent are one: a drive never returns to the same digit.
  std::vector<double> speeds;
  for (const Reading& r : raw.readings) speeds.push_back(r.speed);
  if (raw.readings.empty())
    for (const double w : file.stated_speeds)
      if (w > slow_roll || slow_roll <= 0) speeds.push_back(w);
  std::sort(speeds.begin(), speeds.end());
  for (const double w : speeds)
    if (file.speeds.empty() || w > file.speeds.back() * 1.005) file.speeds.push_back(w);
  if (file.speeds.empty()) throw Error(path + ": no reading above the slow roll");
  diagnosis::BalancingJob& job = file.job;
  job.planes = raw.planes;
  for (std::size_t k = 0; k < file.speeds.size(); ++k) {
    for (const std::string& probe : raw.probes) {
      job.rows.push_back(
          file.speeds[k] > 0 ? fmt::format("{} at {:.5g} rpm", probe, file.speeds[k] * 30 / std::numbers::pi) : probe);
      job.speed.push_back(static_cast<int>(k));
    }
  }
  const auto rows = static_cast<Index>(job.rows.size()), probes = static_cast<Index>(raw.probes.size());
  for (const Reading& r : raw.readings) {
    std::size_t k = 0;
    while (k + 1 < file.speeds.size() && r.speed > file.speeds[k] * 1.005) ++k;
    const Index first = static_cast<Index>(k) * probes;
    // The same run and speed again is a repeat: a run of its own.
    for (const diagnosis::BalancingRun& b : job.runs) {
      if (b.name != r.run || (b.masses - r.masses).norm() <= 1e-9 * (1e-30 + r.masses.norm())) continue;
      throw Error(fmt::format("{}: run {} has different masses in two of its rows", path, r.run));
    }
    auto place = std::find_if(job.runs.begin(), job.runs.end(), [&](const diagnosis::BalancingRun& b) {
      return (b.name == r.run || b.name.starts_with(r.run + " (")) && std::isnan(b.vibration[first].real());
    });
    if (place == job.runs.end()) {
      const auto same = std::count_if(job.runs.begin(), job.runs.end(), [&](const diagnosis::BalancingRun& b) {
        return b.name == r.run || b.name.starts_with(r.run + " (");
      });
      job.runs.push_back({same == 0 ? r.run : fmt::format("{} ({})", r.run, same + 1), r.time, r.masses,
                          Eigen::VectorXcd::Constant(rows, {kNaN, kNaN})});
      place = job.runs.end() - 1;
    }
    place->vibration.segment(first, probes) = r.probes;
  }
  return file;
}

}  // namespace whirl::balancing
