#include "balance_job.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/pages/balancing_sheet.hpp"
#include "whirl/report/document.hpp"

namespace whirl::app {
namespace {

using Eigen::Index;
constexpr double kDegree = std::numbers::pi / 180;

}  // namespace

double written_angle(double angle, double sign) {
  const double degree = std::fmod(sign * angle / kDegree, 360);
  return degree < -1e-9 ? degree + 360 : std::abs(degree);
}

namespace {

/// What the command finds, before it is printed.
struct Balanced {
  diagnosis::InfluenceFit fit;
  diagnosis::CorrectionProblem problem;  ///< with the planes kept
  std::vector<int> planes;               ///< kept
  diagnosis::Correction correction;      ///< of the planes kept
  diagnosis::CorrectionUncertainty uncertainty;
  diagnosis::PlaneIndependence independence;
  std::optional<diagnosis::Placement> placement;
  Eigen::VectorXcd prescribed;  ///< by every plane: what is put on the rotor
};

}  // namespace

std::vector<diagnosis::Places> places_of(const JobOptions& o, const VectorConvention& convention, std::size_t planes) {
  if (o.holes == 0 && o.piece_gram == 0 && o.hole_gram == 0) return {};
  diagnosis::Places places;
  places.piece = o.piece_gram * 1e-3;
  places.most = o.hole_gram * 1e-3;
  for (int k = 0; k < o.holes; ++k)
    places.angles.push_back(convention.angle_sign() * o.first_hole_deg * kDegree + 2 * std::numbers::pi * k / o.holes);
  return std::vector<diagnosis::Places>(planes, places);
}

diagnosis::InfluenceOptions influence_options(const JobOptions& o) {
  diagnosis::InfluenceOptions options;
  options.noise = o.noise_um * 1e-6;
  options.exclude = !o.all_runs;
  options.drift = o.drift == "none"     ? diagnosis::Drift::none
                  : o.drift == "linear" ? diagnosis::Drift::linear
                                        : diagnosis::Drift::automatic;
  return options;
}

namespace {

Balanced solve(const JobFile& file, const JobOptions& o) {
  Balanced b;
  b.fit = diagnosis::fit_influence(file.job, influence_options(o));
  b.independence = diagnosis::plane_independence(b.fit.influence);
  for (int p = 0; p < static_cast<int>(file.job.planes.size()); ++p) {
    const double significance = b.independence.significance[static_cast<std::size_t>(p)];
    const int twin = b.independence.twin[static_cast<std::size_t>(p)];
    if (significance >= 0.2) {
      b.planes.push_back(p);
      continue;
    }
    b.fit.summary.warn(fmt::format(
        "plane {} acts almost as {} at these probes and speeds (independent part {:.0f} %): {}",
        file.job.planes[static_cast<std::size_t>(p)],
        twin < 0 ? "nothing" : "plane " + file.job.planes[static_cast<std::size_t>(twin)], 100 * significance,
        o.drop_dependent ? "it gets no mass"
                         : "masses may be large and fight each other; --drop-dependent leaves it out"));
    if (!o.drop_dependent) b.planes.push_back(p);
  }
  const auto kept = static_cast<Index>(b.planes.size());
  b.problem.influence.resize(b.fit.influence.rows(), kept);
  diagnosis::InfluenceFit reduced = b.fit;
  const Index first = b.fit.with_drift ? 2 : 1;
  for (Index k = 0; k < kept; ++k)
    b.problem.influence.col(k) = b.fit.influence.col(b.planes[static_cast<std::size_t>(k)]);
  for (Eigen::MatrixXcd& g : reduced.cofactor) {
    std::vector<Index> index;
    for (Index k = 0; k < first; ++k) index.push_back(k);
    for (const int p : b.planes) index.push_back(first + p);
    g = Eigen::MatrixXcd(g(index, index));
  }
  reduced.influence = b.problem.influence;
  b.problem.vibration = b.fit.baseline;
  if (o.limit_gram > 0) b.problem.limit = Eigen::VectorXd::Constant(kept, o.limit_gram * 1e-3);
  const auto criterion = o.criterion == "min-max" ? diagnosis::Criterion::min_max : diagnosis::Criterion::least_squares;
  b.correction = diagnosis::solve_correction(b.problem, criterion);
  const bool formula = criterion == diagnosis::Criterion::least_squares && !b.correction.limited;
  b.uncertainty = formula ? diagnosis::correction_uncertainty(reduced, b.problem, b.correction.masses)
                          : diagnosis::redrawn_uncertainty(reduced, b.problem, criterion);
  Eigen::VectorXcd masses = b.correction.masses;
  if (const auto places = places_of(o, file.convention, b.planes.size()); !places.empty()) {
    b.placement = diagnosis::place_masses(b.problem, criterion, masses, places);
    masses = b.placement->sum;
  }
  b.prescribed = Eigen::VectorXcd::Zero(static_cast<Index>(file.job.planes.size()));
  for (Index k = 0; k < kept; ++k) b.prescribed[b.planes[static_cast<std::size_t>(k)]] = masses[k];
  return b;
}

pages::BalancingSheet sheet_of(const std::string& path, const JobFile& file, const JobOptions& o, const Balanced& b) {
  pages::BalancingSheet sheet;
  const double sign = file.convention.angle_sign(), amplitude = 1 / file.convention.amplitude_factor();
  sheet.title = path;
  sheet.amplitude = file.convention.amplitude == "pp" ? "p-p" : file.convention.amplitude == "rms" ? "rms" : "0-p";
  sheet.convention = fmt::format("phase {}, amplitudes {}, mass angles {} rotation", file.convention.phase,
                                 sheet.amplitude, file.convention.angles);
  sheet.criterion = o.criterion;
  for (Index k = 0; k < static_cast<Index>(b.planes.size()); ++k) {
    pages::BalancingSheet::Plane plane;
    plane.name = file.job.planes[static_cast<std::size_t>(b.planes[static_cast<std::size_t>(k)])];
    plane.mass = b.uncertainty.magnitude(k, b.correction.masses);
    plane.angle = b.uncertainty.angle(k, b.correction.masses);
    if (sign < 0) plane.angle = {-plane.angle.value, plane.angle.sd, -plane.angle.high, -plane.angle.low};
    plane.independent = b.independence.significance[static_cast<std::size_t>(b.planes[static_cast<std::size_t>(k)])];
    if (b.placement)
      for (const diagnosis::PlacedMass& m : b.placement->masses)
        if (m.plane == k) plane.placed.emplace_back(m.mass, written_angle(m.angle, sign) * kDegree);
    sheet.planes.push_back(std::move(plane));
  }
  const std::vector<Estimate> before =
      diagnosis::predicted_residual(b.fit, Eigen::VectorXcd::Zero(b.prescribed.size()));
  const std::vector<Estimate> after = diagnosis::predicted_residual(b.fit, b.prescribed);
  const Eigen::VectorXcd left = b.fit.baseline + b.fit.influence * b.prescribed;
  const auto scaled = [&](const Estimate& e) {
    return Estimate{e.value * amplitude, e.sd * amplitude, e.low * amplitude, e.high * amplitude};
  };
  for (Index m = 0; m < b.fit.baseline.size(); ++m) {
    const auto i = static_cast<std::size_t>(m);
    const double speed = file.speeds[static_cast<std::size_t>(file.job.speed[i])];
    sheet.rows.push_back({file.job.rows[i], speed, scaled(before[i]), scaled(after[i]),
                          std::arg(b.fit.baseline[m]) * file.convention.phase_sign(),
                          std::arg(left[m]) * file.convention.phase_sign(), 2 * before[i].value, 2 * after[i].value});
  }
  for (Index m = 0; m < b.fit.influence.rows(); ++m)
    for (Index p = 0; p < b.fit.influence.cols(); ++p)
      sheet.influence.push_back({file.job.rows[static_cast<std::size_t>(m)],
                                 file.job.planes[static_cast<std::size_t>(p)],
                                 std::abs(b.fit.influence(m, p)) * amplitude, b.fit.sd(m, p) * amplitude,
                                 std::arg(b.fit.influence(m, p)) * file.convention.phase_sign()});
  for (const diagnosis::BalancingRun& run : file.job.runs) sheet.runs.emplace_back(run.name, run.vibration);
  sheet.before = b.fit.baseline;
  sheet.after = left;
  sheet.repeatability = b.fit.repeatability * amplitude;
  if (b.fit.with_drift) {
    double span = 0;
    for (const diagnosis::BalancingRun& run : file.job.runs)
      span = std::max(span, file.job.runs.back().time - run.time);
    sheet.drift = b.fit.drift.cwiseAbs().maxCoeff() * span * amplitude;
  }
  sheet.objective = b.correction.objective * amplitude;
  sheet.bound = b.correction.bound * amplitude;
  sheet.summary = b.fit.summary;
  return sheet;
}

void add_budget(pages::BalancingSheet& sheet, const JobFile& file, const JobOptions& o, const Balanced& b) {
  if (!o.zones_um.empty()) {
    if (o.zones_um.size() != 3 || !std::is_sorted(o.zones_um.begin(), o.zones_um.end()) || !(o.zones_um[0] > 0))
      throw Error("--zones-um: three rising limits, of zones A, B and C");
    for (const double limit : o.zones_um) sheet.zones.push_back(limit * 1e-6);
  }
  const double speed = o.speed_rpm > 0 ? o.speed_rpm * std::numbers::pi / 30 : file.speeds.back();
  if (!(o.mass_kg > 0) || !(o.radius_mm > 0) || !(speed > 0)) return;
  sheet.grade = o.grade > 0 ? o.grade : 6.3;
  const double permitted =
      diagnosis::permissible_unbalance(sheet.grade, o.mass_kg, speed) / static_cast<double>(b.planes.size());
  const diagnosis::PlacingErrors errors{o.mass_error_gram * 1e-3, o.angle_error_deg * kDegree,
                                        o.radius_error_mm * 1e-3};
  Eigen::VectorXcd on(static_cast<Index>(b.planes.size()));
  for (Index k = 0; k < on.size(); ++k) on[k] = b.prescribed[b.planes[static_cast<std::size_t>(k)]];
  for (Index k = 0; k < on.size(); ++k)
    sheet.planes[static_cast<std::size_t>(k)].budget =
        diagnosis::unbalance_budget(k, b.correction.masses, b.uncertainty, on, o.radius_mm * 1e-3, errors, permitted);
}

io::Json json_of(const JobFile& file, const Balanced& b, const pages::BalancingSheet& sheet) {
  io::Json out = balancing_document(sheet);
  io::Json planes = io::Json::array(), rows = io::Json::array(), influence = io::Json::array(),
           runs = io::Json::array();
  for (const auto& p : sheet.planes) {
    io::Json placed = io::Json::array();
    for (const auto& [mass, angle] : p.placed)
      placed.push(io::Json::object().set("mass_kg", mass).set("angle_deg", angle / kDegree));
    io::Json plane = io::Json::object();
    if (p.budget)
      plane.set("budget_kg_m",
                io::Json::object()
                    .set("residual", p.budget->residual)
                    .set("scatter", p.budget->scatter)
                    .set("error", p.budget->error)
                    .set("permitted", p.budget->permitted)
                    .set("tolerance", p.budget->tolerance == diagnosis::Tolerance::held       ? "held"
                                      : p.budget->tolerance == diagnosis::Tolerance::not_held ? "not held"
                                                                                              : "undecided"));
    planes.push(plane.set("plane", p.name)
                    .set("mass", to_json(p.mass, "kg"))
                    .set("angle", to_json(p.angle, "rad"))
                    .set("independent_part", p.independent)
                    .set("placed", std::move(placed)));
  }
  for (const auto& r : sheet.rows)
    rows.push(io::Json::object()
                  .set("reading", r.name)
                  .set("before", to_json(r.before, "m"))
                  .set("after", to_json(r.after, "m"))
                  .set("before_phase_rad", r.before_phase)
                  .set("after_phase_rad", r.after_phase));
  for (const auto& c : sheet.influence)
    influence.push(io::Json::object()
                       .set("reading", c.row)
                       .set("plane", c.plane)
                       .set("m_per_kg", c.magnitude)
                       .set("sd_m_per_kg", c.sd)
                       .set("phase_rad", c.phase));
  for (const diagnosis::Contradiction& c : b.fit.contradictions) {
    io::Json others = io::Json::array();
    for (const int r : c.or_run) others.push(file.job.runs[static_cast<std::size_t>(r)].name);
    runs.push(io::Json::object()
                  .set("run", file.job.runs[static_cast<std::size_t>(c.run)].name)
                  .set("chance", c.chance)
                  .set("looks_as_if", c.slip)
                  .set("or_runs", std::move(others)));
  }
  out.set("planes", std::move(planes));
  out.set("readings", std::move(rows)).set("influence", std::move(influence)).set("contradictions", std::move(runs));
  out.set("angles_reversed", b.fit.angles_reversed).set("repeatability_m", sheet.repeatability);
  out.set("drift_m", sheet.drift).set("objective_m", sheet.objective).set("bound_m", sheet.bound);
  out.set("summary", whirl::to_json(b.fit.summary));
  return out;
}

}  // namespace

io::Json balancing_document(const pages::BalancingSheet& sheet) {
  io::Json out = io::start_document("whirl.balancing", 1);
  return out.set("convention", sheet.convention).set("criterion", sheet.criterion);
}

SolvedJob solve_job(const std::string& path, const JobFile& file, const JobOptions& o,
                    const std::optional<Eigen::VectorXcd>& on_rotor) {
  Balanced b = solve(file, o);
  if (on_rotor) b.prescribed = *on_rotor;
  pages::BalancingSheet sheet = sheet_of(path, file, o, b);
  add_budget(sheet, file, o, b);
  io::Json json = json_of(file, b, sheet);
  return {std::move(sheet), std::move(json)};
}

void balance_runs(const std::string& path, const JobOptions& o, Session& session) {
  for (const auto& [flag, value] : {std::pair{"--slow-roll-rpm", o.slow_roll_rpm},
                                    {"--noise-um", o.noise_um},
                                    {"--limit-gram", o.limit_gram},
                                    {"--piece-gram", o.piece_gram},
                                    {"--hole-gram", o.hole_gram}})
    require_range(flag, value, 0, 1e9);
  const JobFile file = read_job(path, o.convention(), o.slow_roll_rpm * std::numbers::pi / 30);
  const auto [sheet, json] =
      o.prior.empty() ? solve_job(path, file, with_plan(o, file)) : solve_with_prior(path, file, with_plan(o, file));
  session.say(report::to_text(pages::balancing_sheet(sheet)));
  session.result(json);
  if (!o.out.empty()) io::save_json(o.out, json);
  if (!o.html.empty()) report::write_html(pages::balancing_sheet(sheet), o.html);
  session.finish(sheet.summary);
}

}  // namespace whirl::app
