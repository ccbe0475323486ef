#include "solve.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "as_found.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/diagnosis/amplitudes.hpp"
#include "whirl/diagnosis/left_out.hpp"
#include "whirl/diagnosis/standards.hpp"

namespace whirl::balancing {
namespace {

using Eigen::Index;

}  // namespace

JobOptions with_plan(JobOptions o, const JobFile& file) {
  const JobPlan& p = file.plan;
  const auto take = [](double& asked, double stated) {
    if (asked == 0) asked = stated;
  };
  if (o.noise == 0) o.noise = reading_unit(file).to_si(o.noise_written);
  take(o.limit, p.limit);
  take(o.noise, p.noise);
  take(o.places.first_hole, p.places.first_hole);
  take(o.places.piece, p.places.piece);
  take(o.places.hole, p.places.hole);
  take(o.rotor.mass, p.rotor.mass);
  take(o.rotor.radius, p.rotor.radius);
  take(o.rotor.grade, p.rotor.grade);
  take(o.rotor.service_speed, p.rotor.service_speed);
  if (o.places.holes == 0) o.places.holes = p.places.holes;
  if (!o.criterion) o.criterion = p.criterion;
  if (!o.drift) o.drift = p.drift;
  o.drop_dependent = o.drop_dependent || p.drop_dependent;
  return o;
}

const io::UnitSuffix& reading_unit(const JobFile& file) {
  const io::UnitSuffix* written = io::find_unit(file.unit);
  if (written != nullptr && written->quantity == file.quantity) return *written;
  return file.quantity == Quantity::displacement ? *io::find_unit("um")
         : file.quantity == Quantity::velocity   ? *io::find_unit("mm_s")
                                                 : *io::find_unit("m_s2");
}

double written_angle(double angle, double sign) {
  const double degree = std::fmod(sign * angle / kRadPerDegree, 360);
  return degree < -1e-9 ? degree + 360 : std::abs(degree);
}

const char* criterion_name(const JobOptions& o) {
  return o.criterion == diagnosis::Criterion::min_max ? "min-max" : "least-squares";
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
  std::optional<diagnosis::AmplitudeFit> amplitudes;  ///< a job without phases
  Eigen::VectorXcd prescribed;                        ///< by every plane: what is put on the rotor
};

}  // namespace

std::vector<diagnosis::Places> places_of(const JobOptions& o, const VectorConvention& convention, std::size_t planes) {
  if (o.places.holes == 0 && o.places.piece == 0 && o.places.hole == 0) return {};
  diagnosis::Places places;
  places.piece = o.places.piece;
  places.most = o.places.hole;
  for (int k = 0; k < o.places.holes; ++k)
    places.angles.push_back(convention.angle_sign() * o.places.first_hole + 2 * std::numbers::pi * k / o.places.holes);
  return std::vector<diagnosis::Places>(planes, places);
}

diagnosis::InfluenceOptions influence_options(const JobOptions& o) {
  diagnosis::InfluenceOptions options;
  options.noise = o.noise;
  options.exclude = !o.all_runs;
  options.drift = o.drift.value_or(diagnosis::Drift::automatic);
  return options;
}

namespace {

Balanced solve(const JobFile& file, const JobOptions& o) {
  Balanced b;
  if (file.job.phases) {
    b.fit = diagnosis::fit_influence(file.job, influence_options(o));
  } else {
    b.amplitudes = diagnosis::fit_amplitudes(file.job, influence_options(o));
    b.fit = b.amplitudes->fit;
  }
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
  std::vector<Index> index;
  for (Index k = 0; k < first; ++k) index.push_back(k);
  for (const int p : b.planes) index.push_back(first + p);
  for (Eigen::MatrixXcd& g : reduced.cofactor) g = Eigen::MatrixXcd(g(index, index));
  for (Eigen::MatrixXcd& g : reduced.gain) g = Eigen::MatrixXcd(g(index, Eigen::all));
  reduced.influence = b.problem.influence;
  b.problem.vibration = b.fit.baseline;
  if (o.limit > 0) b.problem.limit = Eigen::VectorXd::Constant(kept, o.limit);
  const auto criterion = o.criterion.value_or(diagnosis::Criterion::least_squares);
  b.correction = diagnosis::solve_correction(b.problem, criterion);
  const bool formula = criterion == diagnosis::Criterion::least_squares && !b.correction.limited;
  b.uncertainty = b.amplitudes ? diagnosis::amplitude_uncertainty(*b.amplitudes, b.problem, b.planes, criterion,
                                                                  b.correction.masses)
                  : formula    ? diagnosis::correction_uncertainty(reduced, b.problem, b.correction.masses)
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

/// Options in um speak of displacement only.
void require_displacement(const char* flag, bool given, const JobFile& file) {
  if (given && file.quantity != Quantity::displacement)
    throw Error(fmt::format("{}: is of a displacement; the readings are a {}", flag, to_string(file.quantity)));
}

/// In the reader's convention; NaN in a job without phases.
double phase_of(std::complex<double> vector, const JobFile& file) {
  return file.job.phases ? std::arg(vector) * file.convention.phase_sign() : kNaN;
}

/// |reading| by row; without interval where there are no phases. What a solved equation leaves of its rounding is 0.
std::vector<Estimate> readings_with(const Balanced& b, const Eigen::VectorXcd& masses) {
  constexpr double kRounding = 1e-9;  // of the largest reading as found
  std::vector<Estimate> readings;
  if (b.amplitudes) {
    const Eigen::VectorXcd vectors = b.fit.baseline + b.fit.influence * masses;
    for (const std::complex<double> z : vectors) readings.push_back({std::abs(z), kNaN, kNaN, kNaN});
  } else {
    readings = diagnosis::predicted_residual(b.fit, masses);
  }
  const double largest = b.fit.baseline.cwiseAbs().maxCoeff();
  for (Estimate& r : readings)
    if (r.value < kRounding * largest) r.value = 0;
  return readings;
}

void add_left_out(BalancingSheet& sheet, const JobFile& file, const diagnosis::InfluenceFit& fit) {
  const double amplitude = 1 / file.convention.amplitude_factor();
  const diagnosis::LeaveStatesOut out = diagnosis::leave_states_out(file.job, fit);
  for (const diagnosis::LeftOutState& state : out.states) {
    BalancingSheet::LeftOut row;
    for (const int r : state.runs)
      row.runs += (row.runs.empty() ? "" : ", ") + file.job.runs[static_cast<std::size_t>(r)].name;
    row.told = state.told;
    row.foretold = state.foretold.cwiseAbs() * amplitude;
    row.measured = state.measured.cwiseAbs() * amplitude;
    row.error = state.error * amplitude;
    sheet.left_out.push_back(std::move(row));
  }
  sheet.left_out_error = out.error * amplitude;
  sheet.left_out_share = out.share;
}

/// The masses of each plane, as places a fitter can go to.
std::vector<BalancingSheet::OtherMass> places_to_go(const JobFile& file, const std::vector<int>& planes,
                                                    const Eigen::VectorXcd& masses) {
  std::vector<BalancingSheet::OtherMass> out;
  for (Index p = 0; p < masses.size(); ++p)
    out.push_back({file.job.planes[static_cast<std::size_t>(planes[static_cast<std::size_t>(p)])], std::abs(masses[p]),
                   written_angle(std::arg(masses[p]), file.convention.angle_sign()) * kRadPerDegree});
  return out;
}

std::string text_of(const std::vector<BalancingSheet::OtherMass>& masses) {
  std::string text;
  for (const BalancingSheet::OtherMass& m : masses)
    text += fmt::format("{}{:.3g} g at {:.0f} deg on {}", text.empty() ? "" : " with ", m.mass * 1e3,
                        m.angle / kRadPerDegree, m.plane);
  return text;
}

/// Vectors and masses counted in opposite senses mirror the answer. Where the sense is not stated and the runs do not
/// show it, both answers are reported.
void add_other_sense(BalancingSheet& sheet, const JobFile& file, const JobOptions& o, const Balanced& b) {
  if (file.convention.sense_stated || !file.job.phases) return;
  JobFile other = file;
  other.convention.angles = file.convention.angles == "with" ? "against" : "with";
  for (diagnosis::BalancingRun& run : other.job.runs) run.masses = run.masses.conjugate().eval();
  const Balanced mirrored = solve(other, o);
  if (mirrored.fit.angles_reversed) return;  // the runs show it
  const Eigen::VectorXcd ours = b.correction.masses, theirs = mirrored.correction.masses.conjugate();
  // Written angles count the other way there: alike answers are mirrored vectors.
  constexpr double kAlike = 0.05;
  const bool alike = ours.size() == theirs.size() && (ours - theirs).norm() <= kAlike * ours.norm();
  sheet.summary.add({FindingCode::sense_not_stated,
                     alike ? Consequence::warning : Consequence::unusable,
                     {},
                     text_of(places_to_go(other, mirrored.planes, mirrored.correction.masses))});
}

/// The kind of the amplitudes scales the readings, not the masses.
void note_unstated_amplitude(const JobFile& file, BalancingSheet& sheet) {
  if (file.convention.amplitude_stated) return;
  sheet.summary.notes.emplace_back(
      "--amplitude is not stated: readings are printed as read, be they peak, pp or rms. The masses do not depend on "
      "it, the zones do: none is given");
}

/// Other masses that the lengths allow.
void add_other_answers(BalancingSheet& sheet, const JobFile& file, const JobOptions& o, const Balanced& b) {
  if (!b.amplitudes) return;
  std::string text;
  for (std::size_t k = 0; k < b.amplitudes->or_influence.size(); ++k) {
    diagnosis::CorrectionProblem problem = b.problem;
    problem.influence = b.amplitudes->or_influence[k](Eigen::all, b.planes);
    problem.vibration = b.amplitudes->or_baseline[k];
    const Eigen::VectorXcd w =
        diagnosis::solve_correction(problem, o.criterion.value_or(diagnosis::Criterion::least_squares)).masses;
    sheet.other_answers.push_back(places_to_go(file, b.planes, w));
    text += (text.empty() ? "" : ", or ") + text_of(sheet.other_answers.back());
  }
  if (text.empty()) return;
  sheet.summary.add({FindingCode::answer_ambiguous,
                     Consequence::unusable,
                     {{"answers", static_cast<double>(1 + b.amplitudes->or_influence.size())}},
                     text});
}

BalancingSheet sheet_of(const std::string& title, const JobFile& file, const JobOptions& o, const Balanced& b) {
  BalancingSheet sheet = empty_sheet(title, file.convention, o);
  sheet.quantity = file.quantity;
  const double sign = file.convention.angle_sign(), amplitude = 1 / file.convention.amplitude_factor();
  for (Index k = 0; k < static_cast<Index>(b.planes.size()); ++k) {
    BalancingSheet::Plane plane;
    plane.name = file.job.planes[static_cast<std::size_t>(b.planes[static_cast<std::size_t>(k)])];
    plane.mass = b.uncertainty.magnitude(k, b.correction.masses);
    plane.angle = counted(b.uncertainty.angle(k, b.correction.masses), sign);
    plane.independent = b.independence.significance[static_cast<std::size_t>(b.planes[static_cast<std::size_t>(k)])];
    if (b.placement)
      for (const diagnosis::PlacedMass& m : b.placement->masses)
        if (m.plane == k) plane.placed.emplace_back(m.mass, written_angle(m.angle, sign) * kRadPerDegree);
    sheet.planes.push_back(std::move(plane));
  }
  const std::vector<Estimate> before = readings_with(b, Eigen::VectorXcd::Zero(b.prescribed.size())),
                              after = readings_with(b, b.prescribed);
  const Eigen::VectorXcd left = b.fit.baseline + b.fit.influence * b.prescribed;
  const Eigen::VectorXd measured = measured_as_found(file.job);
  sheet.phases = file.job.phases;
  sheet.unit = file.unit;
  for (Index m = 0; m < b.fit.baseline.size(); ++m) {
    const auto i = static_cast<std::size_t>(m);
    const double speed = file.speeds[static_cast<std::size_t>(file.job.speed[i])];
    sheet.rows.push_back({file.job.rows[i], speed, scaled(before[i], amplitude), scaled(after[i], amplitude),
                          phase_of(b.fit.baseline[m], file), phase_of(left[m], file), 2 * before[i].value,
                          2 * after[i].value, measured[m] * amplitude});
  }
  for (Index m = 0; m < b.fit.influence.rows(); ++m)
    for (Index p = 0; p < b.fit.influence.cols(); ++p)
      sheet.influence.push_back(
          {file.job.rows[static_cast<std::size_t>(m)], file.job.planes[static_cast<std::size_t>(p)],
           std::abs(b.fit.influence(m, p)) * amplitude, b.amplitudes ? kNaN : b.fit.sd(m, p) * amplitude,
           phase_of(b.fit.influence(m, p), file)});
  if (file.job.phases) {
    for (const diagnosis::BalancingRun& run : file.job.runs) sheet.runs.emplace_back(run.name, run.vibration);
    add_left_out(sheet, file, b.fit);
  }
  sheet.before = b.fit.baseline;
  sheet.after = left;
  sheet.repeatability = b.fit.repeatability * amplitude;
  sheet.repeat_share = b.fit.repeat_share;
  if (b.fit.with_drift) {
    double span = 0;
    for (const diagnosis::BalancingRun& run : file.job.runs)
      span = std::max(span, file.job.runs.back().time - run.time);
    sheet.drift = b.fit.drift.cwiseAbs().maxCoeff() * span * amplitude;
  }
  sheet.objective = b.correction.objective * amplitude;
  sheet.bound = b.correction.bound * amplitude;
  sheet.summary = b.fit.summary;
  add_other_answers(sheet, file, o, b);
  add_other_sense(sheet, file, o, b);
  warn_of_differing_rates(file, sheet.summary);
  note_unstated_amplitude(file, sheet);
  return sheet;
}

void add_budget(BalancingSheet& sheet, const JobFile& file, const JobOptions& o, const Balanced& b) {
  if (!o.zones.empty() && (o.zones.size() != 3 || !std::is_sorted(o.zones.begin(), o.zones.end()) || !(o.zones[0] > 0)))
    throw Error("--zones-um: three rising limits, of zones A, B and C");
  require_displacement("--zones-um", !o.zones.empty(), file);
  sheet.zones = o.zones;
  const double speed = o.rotor.service_speed > 0 ? o.rotor.service_speed : file.speeds.back();
  if (!(o.rotor.mass > 0) || !(o.rotor.radius > 0) || !(speed > 0)) return;
  sheet.grade = o.rotor.grade > 0 ? o.rotor.grade : 6.3;
  const double permitted =
      diagnosis::permissible_unbalance(sheet.grade, o.rotor.mass, speed) / static_cast<double>(b.planes.size());
  Eigen::VectorXcd on(static_cast<Index>(b.planes.size()));
  for (Index k = 0; k < on.size(); ++k) on[k] = b.prescribed[b.planes[static_cast<std::size_t>(k)]];
  for (Index k = 0; k < on.size(); ++k)
    sheet.planes[static_cast<std::size_t>(k)].budget =
        diagnosis::unbalance_budget(k, b.correction.masses, b.uncertainty, on, o.rotor.radius, o.errors, permitted);
}

void add_contradictions(io::Json& out, const JobFile& file, const diagnosis::InfluenceFit& fit) {
  io::Json runs = io::Json::array();
  for (const diagnosis::Contradiction& c : fit.contradictions) {
    io::Json others = io::Json::array();
    for (const int r : c.or_run) others.push(file.job.runs[static_cast<std::size_t>(r)].name);
    runs.push(io::Json::object()
                  .set("run", file.job.runs[static_cast<std::size_t>(c.run)].name)
                  .set("chance", c.chance)
                  .set("looks_as_if", c.slip)
                  .set("left_out", c.left_out)
                  .set("or_runs", std::move(others)));
  }
  out.set("contradictions", std::move(runs)).set("angles_reversed", fit.angles_reversed);
}

/// How far the runs agree: spare runs, near-repeats, leave-one-state-out. Amplitudes in SI, as the job states them.
void add_repeatability(io::Json& out, const BalancingSheet& sheet, const diagnosis::InfluenceFit& fit) {
  io::Json states = io::Json::array(), others = io::Json::array();
  const auto numbers = [](const Eigen::VectorXd& values) {
    io::Json list = io::Json::array();
    for (const double v : values) list.push(v);
    return list;
  };
  for (const BalancingSheet::LeftOut& row : sheet.left_out)
    states.push(io::Json::object()
                    .set("runs", row.runs)
                    .set("told", row.told)
                    .set("foretold", numbers(row.foretold))
                    .set("measured", numbers(row.measured))
                    .set("error", row.error));
  for (const std::vector<BalancingSheet::OtherMass>& answer : sheet.other_answers) {
    io::Json masses = io::Json::array();
    for (const BalancingSheet::OtherMass& mass : answer)
      masses.push(io::Json::object()
                      .set("plane", mass.plane)
                      .set("mass_kg", mass.mass)
                      .set("angle_deg", mass.angle / kRadPerDegree));
    others.push(std::move(masses));
  }
  out.set("spare_runs", std::isinf(fit.spare) ? kNaN : fit.spare).set("repeat_share", fit.repeat_share);
  out.set("leave_one_state_out", io::Json::object()
                                     .set("error", sheet.left_out_error)
                                     .set("share", sheet.left_out_share)
                                     .set("states", std::move(states)));
  out.set("other_answers", std::move(others));
}

}  // namespace

BalancingSheet empty_sheet(const std::string& title, const VectorConvention& convention, const JobOptions& o) {
  BalancingSheet sheet;
  sheet.title = title;
  sheet.amplitude_stated = convention.amplitude_stated;
  sheet.amplitude = !convention.amplitude_stated    ? "as read"
                    : convention.amplitude == "pp"  ? "p-p"
                    : convention.amplitude == "rms" ? "rms"
                                                    : "0-p";
  sheet.convention = fmt::format("phase {}, amplitudes {}, mass angles {} rotation", convention.phase, sheet.amplitude,
                                 convention.angles);
  sheet.lag = convention.phase == "lag";
  sheet.kind = 1 / convention.amplitude_factor();
  sheet.criterion = criterion_name(o);
  return sheet;
}

Estimate scaled(const Estimate& e, double factor) {
  return {e.value * factor, e.sd * factor, e.low * factor, e.high * factor};
}

Estimate counted(const Estimate& angle, double sign) {
  return sign < 0 ? Estimate{-angle.value, angle.sd, -angle.high, -angle.low} : angle;
}

void warn_of_differing_rates(const JobFile& file, Summary& summary) {
  constexpr double kSlow = 5e-5;  // a rotor that stays at a speed, as it is read from a record
  constexpr double kAlike = 0.15;
  double low = INFINITY, high = -INFINITY;
  for (const double sweep : file.sweeps) {
    if (std::isnan(sweep)) continue;
    const double rate = std::abs(sweep) < kSlow ? 0 : sweep;
    low = std::min(low, rate);
    high = std::max(high, rate);
  }
  if (!(high - low > kAlike * std::max(std::abs(low), std::abs(high)))) return;
  summary.warn(fmt::format(
      "the runs were read from records whose speed changes at differing rates ({:.2g} to {:.2g} of the squared speed): "
      "such vectors do not belong together; begin the job again with --record FILE --steady, or make all runs at one "
      "rate",
      low, high));
}

SolvedJob solve_job(const std::string& title, const JobFile& file, JobOptions options,
                    const std::optional<Eigen::VectorXcd>& on_rotor) {
  require_displacement("--noise-um", options.noise > 0, file);
  options = with_plan(std::move(options), file);
  if (!options.prior.from.empty() && !file.job.phases)
    throw Error("--prior: needs readings with phase; the job has amplitudes alone");
  if (!options.prior.from.empty()) return solve_with_prior(title, file, options);
  Balanced b = solve(file, options);
  if (on_rotor) b.prescribed = *on_rotor;
  BalancingSheet sheet = sheet_of(title, file, options, b);
  add_budget(sheet, file, options, b);
  io::Json json = balancing_document(sheet);
  add_contradictions(json, file, b.fit);
  const std::string m = file.quantity == Quantity::displacement ? "_m" : "";
  json.set("repeatability" + m, sheet.repeatability).set("drift" + m, sheet.drift).set("bound" + m, sheet.bound);
  add_repeatability(json, sheet, b.fit);
  return {std::move(sheet), std::move(json)};
}

}  // namespace whirl::balancing
