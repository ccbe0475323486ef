#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "solve.hpp"
#include "whirl/diagnosis/influence_prior.hpp"
#include "whirl/diagnosis/modal_influence.hpp"
#include "whirl/diagnosis/rotor_influence.hpp"
#include "whirl/diagnosis/standards.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::balancing {
namespace {

using Eigen::Index;

/// Influence coefficients of an earlier job, sorted as this one; in its own convention there.
Eigen::MatrixXcd read_influence(const std::string& path, const JobFile& file) {
  const io::Json json = io::load_json(path);
  const io::JsonReader document(json, path);
  const std::string convention = document.at("convention").text();
  if (document.has("quantity") && document.at("quantity").text() != to_string(file.quantity))
    throw Error(fmt::format("{}: the influence on a {}; the readings of this job are a {}", path,
                            document.at("quantity").text(), to_string(file.quantity)));
  VectorConvention v;
  v.phase = convention.find("phase lead") != std::string::npos ? "lead" : "lag";
  v.amplitude = convention.find("p-p") != std::string::npos   ? "pp"
                : convention.find("rms") != std::string::npos ? "rms"
                                                              : "0p";
  const auto rows = static_cast<Index>(file.job.rows.size()), planes = static_cast<Index>(file.job.planes.size());
  Eigen::MatrixXcd a = Eigen::MatrixXcd::Constant(rows, planes, std::nan(""));
  for (const io::JsonReader& c : document.at("influence").items())
    for (Index m = 0; m < rows; ++m)
      for (Index p = 0; p < planes; ++p)
        if (c.at("reading").text() == file.job.rows[static_cast<std::size_t>(m)] &&
            c.at("plane").text() == file.job.planes[static_cast<std::size_t>(p)])
          a(m, p) = std::polar(c.at(per_kg(file.quantity)).number() * v.amplitude_factor(),
                               v.phase_sign() * c.at("phase_rad").number());
  for (Index m = 0; m < rows; ++m)
    for (Index p = 0; p < planes; ++p)
      if (std::isnan(std::abs(a(m, p))))
        throw Error(fmt::format("{}: no influence of plane {} on {}; names and speeds must be those of this job", path,
                                file.job.planes[static_cast<std::size_t>(p)],
                                file.job.rows[static_cast<std::size_t>(m)]));
  return a;
}

/// Angles of the probes with rotation from the model's x axis: as the job states them, else by the names x and y.
double probe_angle(const JobFile& file, std::size_t row) {
  const std::string& name = file.job.rows[row];
  for (std::size_t p = 0; p < file.probes.size(); ++p) {
    const std::string& probe = file.probes[p];
    if (name != probe && !name.starts_with(probe + " ")) continue;
    if (p < file.plan.probe_angles.size()) return file.plan.probe_angles[p];
    if (probe == "x" || probe == "X") return 0;
    if (probe == "y" || probe == "Y") return std::numbers::pi / 2;
  }
  throw Error(
      fmt::format("--prior: the angle of the probe of '{}' is not known to the model: name the probes x and y, or "
                  "state probe_angles_deg in [setup] of runs.toml",
                  name));
}

/// The middle of the mark when its edge triggers, rad.
double mark_of(const JobFile& file) {
  return file.plan.keyphasor + (file.plan.edge == "leading" ? -0.5 : 0.5) * file.plan.notch;
}

/// Name of the probe of each reading.
std::string probe_of(const JobFile& file, std::size_t row) {
  const std::string& name = file.job.rows[row];
  for (const std::string& probe : file.probes)
    if (name == probe || name.starts_with(probe + " ")) return probe;
  return name;
}

/// Angle of a probe named as a point of the modes: as stated, else by the direction in its name or in that of the
/// point.
double modal_probe_angle(const JobFile& file, const ModalModel& modes, std::size_t row) {
  const std::string probe = probe_of(file, row);
  for (std::size_t p = 0; p < file.probes.size() && p < file.plan.probe_angles.size(); ++p)
    if (file.probes[p] == probe) return file.plan.probe_angles[p];
  for (const auto* names : {&modes.responses, &modes.references})
    for (const std::string& name : *names) {
      if (name != probe && !name.starts_with(probe + ":")) continue;
      const double turned = name.find(":-") != std::string::npos ? std::numbers::pi : 0;
      if (name.ends_with("X")) return turned;
      if (name.ends_with("Y")) return turned + std::numbers::pi / 2;
    }
  return probe_angle(file, row);
}

diagnosis::InfluencePrior modes_prior(const std::string& path, const JobFile& file, const JobOptions& o,
                                      Summary& warnings) {
  const auto modes = io::load<ModalModel>(path);
  if (!(o.rotor.radius > 0)) throw Error("--prior: modes need --radius-mm, where the masses are added");
  diagnosis::ModalReadings r;
  r.planes = file.job.planes;
  r.radius = o.rotor.radius;
  r.mark = mark_of(file);
  for (std::size_t m = 0; m < file.job.rows.size(); ++m) {
    r.probes.push_back(probe_of(file, m));
    r.speed.push_back(file.speeds[static_cast<std::size_t>(file.job.speed[m])]);
    r.angle.push_back(modal_probe_angle(file, modes, m));
  }
  const auto [low, high] = std::ranges::minmax(r.speed);
  constexpr double hz = 2 * std::numbers::pi;
  if (low < hz * modes.band_low || high > hz * modes.band_high)
    warnings.warn(fmt::format("the modes hold from {:g} to {:g} Hz, the runs turn at {:.4g} to {:.4g} Hz",
                              modes.band_low, modes.band_high, low / hz, high / hz));
  return diagnosis::modal_prior(modes, r, o.prior.common, o.prior.each);
}

diagnosis::InfluencePrior model_prior(const std::string& path, const JobFile& file, const JobOptions& o,
                                      Summary& warnings) {
  const IdentifiedModel model = io::load<IdentifiedModel>(path);
  if (!model.rotor) throw Error(path + ": the model has no rotor parameters; identify with --method weak");
  if (file.job.planes.size() != 1)
    throw Error(
        fmt::format("{}: a model of one disk has one plane, the job has {}; the modes of impacts on the planes "
                    "(modes.json of whirl modes) have all of them",
                    path, file.job.planes.size()));
  if (!(o.rotor.radius > 0)) throw Error("--prior: a model needs --radius-mm, where the masses are added");
  diagnosis::RotorReadings r;
  r.mass = o.rotor.mass > 0 ? o.rotor.mass : model.rotor->gain > 0 ? 1 / model.rotor->gain : 0;
  if (!(r.mass > 0)) throw Error("--prior: a model needs --mass-kg, of the disk");
  r.radius = o.rotor.radius;
  for (std::size_t m = 0; m < file.job.rows.size(); ++m) {
    r.speed.push_back(file.speeds[static_cast<std::size_t>(file.job.speed[m])]);
    r.probe.push_back(probe_angle(file, m));
  }
  r.mark = mark_of(file);
  for (const diagnosis::BalancingRun& run : file.job.runs)
    for (const std::complex<double> z : run.vibration)
      if (std::isfinite(std::abs(z))) r.amplitude = std::max(r.amplitude, std::abs(z));
  return diagnosis::rotor_prior(*model.rotor, model.rotor_covariance, r, o.prior.common, o.prior.each, warnings);
}

diagnosis::InfluencePrior read_prior(const JobFile& file, const JobOptions& o, Summary& warnings) {
  const std::string path = o.prior.from.string();
  const io::Json json = io::load_json(path);
  const io::JsonReader document(json, path);
  const bool computed = document.has("schema") && !document.at("schema").text().starts_with("whirl.balancing/");
  if (computed && file.quantity != Quantity::displacement)
    throw Error(fmt::format("{}: gives the influence on a displacement; the readings of this job are a {}", path,
                            to_string(file.quantity)));
  if (document.has("schema") && document.at("schema").text().starts_with("whirl.model/"))
    return model_prior(path, file, o, warnings);
  if (document.has("schema") && document.at("schema").text().starts_with("whirl.modes/"))
    return modes_prior(path, file, o, warnings);
  if (document.has("schema")) document.require_schema("whirl.balancing", 1);
  return diagnosis::relative_prior(read_influence(path, file), o.prior.common, o.prior.each, file.job.speed);
}

double noise_of(const JobFile& file, const JobOptions& o) {
  if (o.noise > 0) return o.noise;
  try {
    const diagnosis::InfluenceFit fit = diagnosis::fit_influence(file.job, influence_options(o));
    if (fit.noise.allFinite()) return fit.noise.maxCoeff();
  } catch (const Error&) {
  }
  throw Error("--prior: the runs do not tell their scatter; state --noise-um, the sd of one reading");
}

}  // namespace

SolvedJob solve_with_prior(const std::string& title, const JobFile& file, const JobOptions& o) {
  if (o.criterion == diagnosis::Criterion::min_max || o.limit > 0 || o.places.holes > 0 || o.places.piece > 0 ||
      o.places.hole > 0)
    throw Error("--prior balances by least squares with free masses: no --criterion, --limit-gram, holes or pieces");
  Summary warnings;
  const diagnosis::InfluencePrior prior = read_prior(file, o, warnings);
  const diagnosis::BayesianBalance b = diagnosis::balance_with_prior(file.job, prior, noise_of(file, o));
  const double sign = file.convention.angle_sign(), kind = 1 / file.convention.amplitude_factor(),
               phase = file.convention.phase_sign();
  BalancingSheet s = empty_sheet(title, file.convention, o);
  const Eigen::VectorXcd left = b.baseline + b.influence * b.masses;
  const diagnosis::PlaneIndependence independence = diagnosis::plane_independence(b.influence);
  for (std::size_t p = 0; p < file.job.planes.size(); ++p) {
    BalancingSheet::Plane plane;
    plane.name = file.job.planes[p];
    plane.mass = b.magnitude[p];
    plane.angle = counted(b.angle[p], sign);
    plane.independent = independence.significance[p];
    s.planes.push_back(std::move(plane));
  }
  for (Index m = 0; m < b.baseline.size(); ++m) {
    const auto i = static_cast<std::size_t>(m);
    const double before = std::abs(b.baseline[m]), unknown = std::nan("");
    s.rows.push_back({file.job.rows[i], file.speeds[static_cast<std::size_t>(file.job.speed[i])],
                      scaled({before, unknown, unknown, unknown}, kind), scaled(b.residual[i], kind),
                      phase * std::arg(b.baseline[m]), phase * std::arg(left[m]), 2 * before, 2 * b.residual[i].value,
                      before * kind});
    for (std::size_t p = 0; p < s.planes.size(); ++p) {
      const std::complex<double> a = b.influence(m, static_cast<Index>(p));
      s.influence.push_back({file.job.rows[i], s.planes[p].name, std::abs(a) * kind,
                             b.influence_sd(m, static_cast<Index>(p)) * kind, phase * std::arg(a)});
    }
  }
  for (const diagnosis::BalancingRun& run : file.job.runs) s.runs.emplace_back(run.name, run.vibration);
  s.before = b.baseline;
  s.after = left;
  s.repeatability = std::nan("");
  s.objective = left.norm() * kind;
  s.summary = b.summary;
  for (const std::string& warning : warnings.warnings) s.summary.warn(warning);
  warn_of_differing_rates(file, s.summary);
  io::Json out = balancing_document(s);
  out.set("surprise", b.surprise);
  return {std::move(s), std::move(out)};
}

}  // namespace whirl::balancing
