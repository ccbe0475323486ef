#include "session_text.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "record_vectors.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/io/units.hpp"

namespace whirl::balancing {
namespace {

using Eigen::Index;

std::string quoted(const std::string& flag, const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    for (const char c : name)
      if (c == '"' || c == '\\' || static_cast<unsigned char>(c) < 0x20)
        throw Error::in_field(flag, name, "a name without quotes, backslashes and control characters");
    text += fmt::format("{}\"{}\"", text.empty() ? "" : ", ", name);
  }
  return text;
}

std::string exact_number(double v) { return fmt::format("{:.10g}", v); }

std::string list(const std::vector<double>& values, double unit = 1) {
  std::string text;
  for (const double v : values) text += (text.empty() ? "" : ", ") + exact_number(v / unit);
  return text;
}

double parse(const std::string& flag, const std::string& word, std::string_view part) {
  double value = 0;
  if (part.starts_with('+')) part.remove_prefix(1);
  const auto [end, error] = std::from_chars(part.data(), part.data() + part.size(), value);
  if (error != std::errc() || end != part.data() + part.size() || !std::isfinite(value))
    throw Error::in_field(flag, word, "SIZE@ANGLE, as 48.3@270");
  return value;
}

/// "48.3@270 12@5": size and angle in degrees, apart by spaces, commas or semicolons. "-" is no reading, "0" no mass.
std::vector<std::pair<double, double>> vectors(const std::string& flag, const std::string& text) {
  std::vector<std::pair<double, double>> found;
  std::size_t at = 0;
  constexpr std::string_view kApart = " ,;\t";
  while ((at = text.find_first_not_of(kApart, at)) != std::string::npos) {
    const std::size_t end = std::min(text.find_first_of(kApart, at), text.size());
    const std::string word = text.substr(at, end - at);
    at = end;
    const std::size_t angle = word.find('@');
    if (word == "-") {
      found.emplace_back(std::nan(""), 0);
    } else if (angle == std::string::npos) {
      if (parse(flag, word, word) != 0) throw Error::in_field(flag, word, "SIZE@ANGLE, as 48.3@270");
      found.emplace_back(0, 0);
    } else {
      const double size = parse(flag, word, std::string_view(word).substr(0, angle));
      if (size < 0) throw Error::in_field(flag, word, "a size >= 0");
      found.emplace_back(size, parse(flag, word, std::string_view(word).substr(angle + 1)));
    }
  }
  return found;
}

double wrapped(double degrees) {
  const double d = std::fmod(degrees, 360);
  return d < 0 ? d + 360 : d + 0.0;
}

const char* drift_name(const JobOptions& o) {
  return o.drift == diagnosis::Drift::none ? "none" : o.drift == diagnosis::Drift::linear ? "linear" : "automatic";
}

}  // namespace

std::string new_job_text(const NewJob& job, const std::string& path) {
  const JobOptions& o = job.options;
  const auto need = [&](bool there, const char* flag, const char* what) {
    if (!there) throw Error(fmt::format("{} does not exist yet; a new job needs {}: {}", path, flag, what));
  };
  need(!job.planes.empty(), "--planes", "names of the planes, as A,B");
  need(!job.probes.empty(), "--probes", "names of the probes, as DE,NDE");
  need(!job.convention.phase.empty(), "--phase",
       "lag (angle from the keyphasor's pulse to the next positive peak) or lead");
  need(!job.convention.amplitude.empty(), "--amplitude", "0p, pp or rms");
  need(!job.convention.angles.empty(), "--angles", "with or against the rotation");
  job.convention.check();
  if (job.trial <= 0 && (o.rotor.mass <= 0 || o.rotor.radius <= 0))
    throw Error(path + ": the first trial mass needs --trial-gram, or --mass-kg of the rotor and --radius-mm");
  if (!job.probe_angles.empty() && job.probe_angles.size() != job.probes.size())
    throw Error(fmt::format("--probe-deg: {} angles for {} probes", job.probe_angles.size(), job.probes.size()));
  std::string text = fmt::format(
      "# Balancing job of `whirl balance --session`. Runs may be corrected here by hand.\n[job]\nplanes = [{}]\nprobes "
      "= [{}]\nunit = \"{}\"\n",
      quoted("--planes", job.planes), quoted("--probes", job.probes), job.unit);
  if (!job.speeds.empty()) text += fmt::format("speeds_rpm = [{}]\n", list(job.speeds, kRadPerSecPerRpm));
  text += fmt::format("phase = \"{}\"\namplitude = \"{}\"\nangles = \"{}\"\n", job.convention.phase,
                      job.convention.amplitude, job.convention.angles);
  const auto entry = [&](const char* key, double value, double unit = 1) {
    if (value != 0) text += fmt::format("{} = {}\n", key, exact_number(value / unit));
  };
  text += "\n[setup]\n";
  text += fmt::format("edge = \"{}\"  # of the mark, that triggers\n", job.edge);
  entry("keyphasor_angle_deg", job.keyphasor, kRadPerDegree);
  entry("notch_width_deg", job.notch, kRadPerDegree);
  if (!job.probe_angles.empty())
    text += fmt::format("probe_angles_deg = [{}]\n", list(job.probe_angles, kRadPerDegree));
  entry("critical_speed_rpm", job.critical_speed, kRadPerSecPerRpm);
  text += "\n[plan]\n";
  entry("trial_mass_gram", job.trial, 1e-3);
  entry("limit_mass_gram", o.limit, 1e-3);
  const auto size = [&](const char* key, double value) {
    if (value != 0)
      text += fmt::format("{}_{} = {}\n", key, job.unit, exact_number(io::find_unit(job.unit)->from_si(value)));
  };
  size("target_amplitude", job.target);
  size("allowed_amplitude", job.allowed);
  size("noise", o.noise);
  entry("slow_roll_speed_rpm", job.slow_roll, kRadPerSecPerRpm);
  if (o.places.holes > 0) text += fmt::format("holes = {}\n", o.places.holes);
  entry("first_hole_deg", o.places.first_hole, kRadPerDegree);
  entry("piece_mass_gram", o.places.piece, 1e-3);
  entry("hole_mass_gram", o.places.hole, 1e-3);
  text += fmt::format("criterion = \"{}\"\ndrift = \"{}\"\n", criterion_name(o), drift_name(o));
  if (o.drop_dependent) text += "drop_dependent = true\n";
  text += "\n[machine]\n";
  entry("mass_kg", o.rotor.mass);
  entry("radius_mm", o.rotor.radius, 1e-3);
  entry("grade", o.rotor.grade);
  entry("service_speed_rpm", o.rotor.service_speed, kRadPerSecPerRpm);
  return text;
}

std::string run_text(const RunMade& run, const VectorConvention& typed, const JobFile& file,
                     const Eigen::VectorXcd& proposed, const std::string& name) {
  const VectorConvention& v = file.convention;
  std::vector<double> amplitudes, phases, grams, degrees, unread;
  std::string note, sweep;
  if (!run.record.empty()) {
    const RecordVectors found = read_vectors(run.record, file, run.steady);
    sweep = fmt::format("sweep = {:.6g}\n", found.sweep);
    for (const std::complex<double> z : found.readings) {
      amplitudes.push_back(io::find_unit(file.unit)->from_si(std::abs(z) / v.amplitude_factor()));
      phases.push_back(wrapped(v.phase_sign() * std::arg(z) / kRadPerDegree));
    }
    note = run.steady ? "  # steady vectors of a run-up" : "  # from a record";
  } else {
    for (auto [size, angle] : vectors("--readings", run.readings)) {
      if (std::isnan(size)) {
        unread.push_back(static_cast<double>(amplitudes.size() + 1));
        size = 0;
      }
      amplitudes.push_back(size * typed.amplitude_factor() / v.amplitude_factor());
      phases.push_back(typed.phase == v.phase ? angle : wrapped(-angle));
    }
    const std::size_t wanted = file.probes.size() * file.stated_speeds.size();
    if (amplitudes.size() != wanted)
      throw Error(
          fmt::format("--readings: {} readings are needed ({} at each of {} speeds, speed by speed), {} were found; "
                      "write - for a reading that is missing",
                      wanted, fmt::join(file.probes, ", "), file.stated_speeds.size(), amplitudes.size()));
    if (typed.phase != v.phase || typed.amplitude != v.amplitude || typed.angles != v.angles)
      note = fmt::format("  # typed as phase {}, amplitudes {}, angles {}", typed.phase, typed.amplitude, typed.angles);
  }
  if (run.masses.empty()) {
    for (Index p = 0; p < proposed.size(); ++p) {
      grams.push_back(std::round(1e9 * std::abs(proposed[p])) * 1e-6);
      degrees.push_back(
          grams.back() == 0 ? 0 : std::round(1e4 * written_angle(std::arg(proposed[p]), v.angle_sign())) * 1e-4);
    }
  } else {
    for (const auto& [size, angle] : vectors("--masses", run.masses)) {
      if (std::isnan(size)) throw Error::in_field("--masses", run.masses, "a mass for each plane, 0 for none");
      grams.push_back(size);
      degrees.push_back(typed.angles == v.angles || size == 0 ? angle : wrapped(-angle));
    }
    if (grams.size() != file.job.planes.size())
      throw Error(fmt::format("--masses: one for each of {} is needed, {} were found; 0 for none",
                              fmt::join(file.job.planes, ", "), grams.size()));
  }
  std::string text = fmt::format(
      "\n[[run]]{}\nname = {}\nmasses_gram = [{}]\nangles_deg = [{}]\namplitudes_{} = [{}]\nphases_deg = [{}]\n{}",
      note, quoted("--run", {name}), list(grams), list(degrees), file.unit, list(amplitudes), list(phases), sweep);
  if (!unread.empty()) text += fmt::format("unread = [{}]  # positions of readings that are missing\n", list(unread));
  return text;
}

std::string without_last_run(const std::string& text, const std::string& path) {
  const std::size_t at = text.rfind("\n[[run]]");
  if (at == std::string::npos) throw Error(path + ": there is no run to take back");
  return text.substr(0, at);
}

}  // namespace whirl::balancing
