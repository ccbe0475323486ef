#include "whirl/diagnosis/next_run.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "influence_fit.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

constexpr double kWanted = 0.4;     // effect of a trial, part of the readings
constexpr double kTooSmall = 0.15;  // below it the trial is made again
constexpr double kWorth = 0.8;      // a correction must bring the criterion below this part

/// Which planes the runs tell, every row of them.
std::vector<bool> planes_told(const BalancingJob& job) {
  const auto planes = static_cast<Index>(job.planes.size());
  std::vector<bool> told(job.planes.size(), true);
  const RunDesign design(job, false);
  const std::vector<bool> used(job.runs.size(), true);
  for (std::size_t m = 0; m < job.rows.size(); ++m) {
    const Eigen::MatrixXcd x = design.rows_of(job, static_cast<Index>(m), used);
    Eigen::ColPivHouseholderQR<Eigen::MatrixXcd> all(x);
    all.setThreshold(1e-9);
    for (Index p = 0; p < planes; ++p) {
      // Told when the column is no combination of the others.
      Eigen::MatrixXcd without(x.rows(), x.cols() - 1);
      without << x.leftCols(1 + p), x.rightCols(planes - 1 - p);
      Eigen::ColPivHouseholderQR<Eigen::MatrixXcd> rest(without);
      rest.setThreshold(1e-9);
      told[static_cast<std::size_t>(p)] = told[static_cast<std::size_t>(p)] && x.rows() > 0 && rest.rank() < all.rank();
    }
  }
  return told;
}

double rms(const Eigen::VectorXcd& v) {
  double sum = 0, n = 0;
  for (Index m = 0; m < v.size(); ++m)
    if (!std::isnan(std::abs(v[m]))) sum += std::norm(v[m]), n += 1;
  return n > 0 ? std::sqrt(sum / n) : 0;
}

double largest(const Eigen::VectorXcd& v) {
  double most = 0;
  for (Index m = 0; m < v.size(); ++m)
    if (!std::isnan(std::abs(v[m]))) most = std::max(most, std::abs(v[m]));
  return most;
}

class Planner {
 public:
  Planner(const BalancingJob& job, const BalancingPlan& plan, const InfluenceOptions& options)
      : job_(job), plan_(plan), options_(options), planes_(static_cast<Index>(job.planes.size())) {}

  NextRun run() {
    next_.masses = Eigen::VectorXcd::Zero(planes_);
    if (job_.runs.empty() || !as_found()) {
      next_.why = "every influence is a difference to the rotor without masses";
      return next_;
    }
    const Eigen::VectorXcd& last = job_.runs.back().vibration;
    if (plan_.target > 0 && largest(last) <= plan_.target) {
      next_.masses = job_.runs.back().masses;
      return end(true, "every reading of the last run is at or below the target");
    }
    told_ = planes_told(job_);
    if (std::all_of(told_.begin(), told_.end(), [](bool t) { return t; })) return with_influence();
    for (Index p = 0; p < planes_; ++p)
      if (!told_[static_cast<std::size_t>(p)]) return trial(p);
    return next_;
  }

 private:
  const BalancingRun* as_found() const {
    for (const BalancingRun& run : job_.runs)
      if (run.masses.norm() == 0) return &run;
    return nullptr;
  }

  NextRun end(bool held, std::string why) {
    next_.step = BalancingStep::done;
    next_.target_held = held;
    next_.why = std::move(why);
    if (!held && plan_.target > 0) next_.summary.warn("the target is not held");
    return next_;
  }

  /// Runs with a mass on this plane alone: the last of them.
  const BalancingRun* trial_of(Index p) const {
    const BalancingRun* found = nullptr;
    for (const BalancingRun& run : job_.runs)
      if (run.masses[p] != 0.0 && std::abs(std::abs(run.masses[p]) - run.masses.norm()) < 1e-12 * run.masses.norm())
        found = &run;
    return found;
  }

  double limited(double mass) const { return std::min(mass, plan_.limit); }

  NextRun trial(Index p) {
    next_.step = BalancingStep::trial;
    next_.plane = static_cast<int>(p);
    const BalancingRun& found = *as_found();
    double size = plan_.trial;
    std::string measure;
    for (Index q = 0; q < planes_; ++q) {
      const BalancingRun* other = trial_of(q);
      if (q == p || other == nullptr) continue;
      const double effect = rms(other->vibration - found.vibration) / std::max(rms(found.vibration), 1e-300);
      // Another plane may act far more or less: never more than twice what was on the rotor already.
      size = std::abs(other->masses[q]) * std::clamp(kWanted / std::max(effect, 1e-9), 0.4, 2.0);
      measure = fmt::format("; the mass on {} changed the readings by {:.0f} %",
                            job_.planes[static_cast<std::size_t>(q)], 100 * effect);
    }
    const auto [angle, reason] = trial_angle(found, p);
    next_.masses[p] = std::polar(limited(size), angle);
    next_.why = fmt::format("no run tells the influence of plane {}{}; {}", job_.planes[static_cast<std::size_t>(p)],
                            measure, reason);
    place();
    return next_;
  }

  std::pair<double, std::string> trial_angle(const BalancingRun& found, Index p) const {
    Index m = -1;
    for (Index k = 0; k < found.vibration.size(); ++k)
      if (!std::isnan(std::abs(found.vibration[k])) && plan_.high_spot.size() > k && !std::isnan(plan_.high_spot[k]) &&
          (m < 0 || std::abs(found.vibration[k]) > std::abs(found.vibration[m])))
        m = k;
    if (m < 0) {
      // Without probe angles any place serves; planes apart, so that not all trials add up by chance.
      return {2 * std::numbers::pi * static_cast<double>(p) / static_cast<double>(planes_),
              "any angle will do: the positions of the probes are not stated"};
    }
    const double high = std::arg(found.vibration[m]) + plan_.high_spot[m];
    const std::string& row = job_.rows[static_cast<std::size_t>(m)];
    if (plan_.heavy_ahead.size() > m && !std::isnan(plan_.heavy_ahead[m]))
      return {high + plan_.heavy_ahead[m] + std::numbers::pi,
              fmt::format("opposite to the heavy spot that the high spot of {} tells", row)};
    return {high + std::numbers::pi / 2,
            fmt::format(
                "at a right angle to the high spot of {}: on neither side of the critical speed the worst place", row)};
  }

  NextRun with_influence() {
    InfluenceFit fit = fit_influence(job_, options_);
    // Too few runs to know the scatter, but a machine that repeats reads no tenth of the vibration wrong.
    InfluenceOptions coarse = options_;
    coarse.noise = 0.03 * rms(fit.baseline);
    if (options_.noise <= 0 && !(fit.repeat_share > kRepeats) && fit.noise.allFinite() &&
        fit.noise.maxCoeff() > 3 * coarse.noise)
      fit = fit_influence(job_, coarse);
    if (look_again(fit)) return next_;
    if (repeated_in_vain(fit)) return end(false, why_end_);
    if (enlarge_trial(fit)) return next_;
    return correction(fit);
  }

  /// A contradiction that nothing decides, or that the last run stands alone in: that run again.
  bool look_again(const InfluenceFit& fit) {
    const int last_run = static_cast<int>(job_.runs.size()) - 1;
    for (const Contradiction& c : fit.contradictions) {
      const bool last_too = std::find(c.or_run.begin(), c.or_run.end(), last_run) != c.or_run.end();
      if (c.or_run.empty() && c.run != last_run) continue;
      const BalancingRun& run = job_.runs[static_cast<std::size_t>(last_too ? last_run : c.run)];
      next_.step = BalancingStep::repeat;
      next_.masses = run.masses;
      next_.why = fmt::format("run '{}' contradicts {}{}: look what is on the rotor, and read again", run.name,
                              c.or_run.empty() ? "the others" : "others and nothing tells which is wrong",
                              c.slip.empty() || last_too ? "" : ", looks as if " + c.slip);
      predict(fit);
      return true;
    }
    return false;
  }

  /// Made again with more where the effect was too small to stand on.
  bool enlarge_trial(const InfluenceFit& fit) {
    if (loaded_runs() > 2 * planes_ + 1) return false;
    const double level = rms(fit.baseline);
    for (Index p = 0; p < planes_; ++p) {
      double most = 0;
      for (const BalancingRun& run : job_.runs) most = std::max(most, std::abs(run.masses[p]));
      const double effect = rms(fit.influence.col(p) * most) / std::max(level, 1e-300);
      const double sd = fit.sd(0, p) * most;
      const bool lost = !std::isnan(sd) && effect * level < 5 * sd;
      if ((effect >= kTooSmall && !lost) || most * 1.5 > plan_.limit) continue;
      next_.step = BalancingStep::trial;
      next_.plane = static_cast<int>(p);
      const double size = limited(most * std::clamp(kWanted / std::max(effect, 1e-9), 1.5, 5.0));
      // Where the influence says that it does good.
      const std::complex<double> good = -fit.influence.col(p).dot(fit.baseline);
      next_.masses[p] = std::polar(size, std::arg(good));
      next_.why =
          fmt::format("the trial on plane {} changed the readings by {:.0f} % only: more mass, where it lowers them",
                      job_.planes[static_cast<std::size_t>(p)], 100 * effect);
      place();
      predict(fit);
      return true;
    }
    return false;
  }

  Index loaded_runs() const {
    return std::count_if(job_.runs.begin(), job_.runs.end(), [](const BalancingRun& r) { return r.masses.norm() > 0; });
  }

  std::vector<Index> kept(const InfluenceFit& fit) const {
    std::vector<Index> planes;
    const PlaneIndependence independence = plane_independence(fit.influence);
    for (Index p = 0; p < planes_; ++p)
      if (!plan_.drop_dependent || independence.significance[static_cast<std::size_t>(p)] >= 0.2) planes.push_back(p);
    return planes;
  }

  CorrectionProblem problem(const InfluenceFit& fit) const {
    CorrectionProblem problem;
    const std::vector<Index> planes = kept(fit);
    problem.influence = fit.influence(Eigen::all, planes);
    problem.vibration = fit.baseline;
    if (std::isfinite(plan_.limit))
      problem.limit = Eigen::VectorXd::Constant(static_cast<Index>(planes.size()), plan_.limit);
    return problem;
  }

  NextRun correction(const InfluenceFit& fit) {
    const CorrectionProblem p = problem(fit);
    const std::vector<Index> planes = kept(fit);
    const Eigen::VectorXcd w = solve_correction(p, plan_.criterion).masses;
    for (std::size_t k = 0; k < planes.size(); ++k) next_.masses[planes[k]] = w[static_cast<Index>(k)];
    next_.step = BalancingStep::correction;
    place();
    CorrectionProblem full;
    full.influence = fit.influence;
    full.vibration = fit.baseline;
    const BalancingRun& last = job_.runs.back();
    const double now = objective(full, plan_.criterion, last.masses),
                 then = objective(full, plan_.criterion, next_.masses);
    const Eigen::VectorXcd change = fit.influence * (next_.masses - last.masses);
    const double scatter = fit.noise.allFinite() ? fit.noise.maxCoeff() : 0;
    if (then > kWorth * now || rms(change) < 2 * scatter) {
      next_.masses = last.masses;
      next_.placed.clear();
      return end(false, then > kWorth * now
                            ? fmt::format("these planes cannot bring the readings below {:.0f} % of what they are now",
                                          100 * then / std::max(now, 1e-300))
                            : std::string("a further change would be within the scatter of the readings"));
    }
    next_.why = fmt::format("every plane's influence is known; {} {}",
                            plan_.criterion == Criterion::min_max ? "the largest reading" : "the root of the squares",
                            then < 1e-6 * now ? "is zero by this fit (no more readings than planes): the run will tell"
                                              : fmt::format("falls to {:.0f} % of the last run's", 100 * then / now));
    predict(fit);
    if (largest(full.residual(next_.masses)) > plan_.allowed)
      next_.summary.warn("with the correction a reading is predicted above what is allowed: run up slowly");
    return next_;
  }

  /// Two corrections that did not bring what was foretold: the rotor does not follow its influence coefficients.
  bool repeated_in_vain(const InfluenceFit& fit) {
    std::vector<double> value;
    CorrectionProblem own;
    own.influence = fit.influence;
    for (const BalancingRun& run : job_.runs) {
      if ((run.masses.array() != std::complex<double>()).count() < std::min<Index>(2, planes_)) continue;
      value.push_back(plan_.criterion == Criterion::min_max ? largest(run.vibration) : rms(run.vibration));
    }
    const std::size_t n = value.size();
    if (n < 4 || value[n - 1] < 0.9 * *std::min_element(value.begin(), value.end() - 2)) return false;
    why_end_ = "the last corrections did not lower the readings";
    next_.masses = job_.runs.back().masses;
    next_.summary.warn(
        "the rotor does not follow its influence coefficients: a loose part, rubbing, a thermal bow or another cause "
        "than unbalance");
    return true;
  }

  void place() {
    if (plan_.places.empty()) return;
    for (Index p = 0; p < planes_; ++p) {
      if (next_.masses[p] == 0.0) continue;
      // One plane at a time: the vector itself is what shall be met.
      CorrectionProblem own;
      own.influence = Eigen::MatrixXcd::Ones(1, 1);
      own.vibration = Eigen::VectorXcd::Constant(1, -next_.masses[p]);
      const Placement placement = place_masses(own, Criterion::least_squares, next_.masses.segment(p, 1),
                                               {plan_.places[static_cast<std::size_t>(p)]});
      for (PlacedMass mass : placement.masses) {
        mass.plane = static_cast<int>(p);
        next_.placed.push_back(mass);
      }
      next_.masses[p] = placement.sum[0];
    }
  }

  void predict(const InfluenceFit& fit) { next_.predicted = predicted_residual(fit, next_.masses); }

  const BalancingJob& job_;
  const BalancingPlan& plan_;
  const InfluenceOptions& options_;
  Index planes_;
  std::vector<bool> told_;
  std::string why_end_;
  NextRun next_;
};

}  // namespace

std::string step_name(BalancingStep step) {
  switch (step) {
    case BalancingStep::as_found:
      return "as found";
    case BalancingStep::trial:
      return "trial";
    case BalancingStep::repeat:
      return "repeat";
    case BalancingStep::correction:
      return "correction";
    default:
      return "done";
  }
}

NextRun next_run(const BalancingJob& job, const BalancingPlan& plan, const InfluenceOptions& options) {
  if (!job.runs.empty()) job.check();
  if (!(plan.trial > 0)) throw Error::in_field("trial mass", fmt::format("{}", plan.trial), "positive");
  if (!(plan.limit > 0)) throw Error::in_field("largest mass", fmt::format("{}", plan.limit), "positive");
  if (!plan.places.empty() && plan.places.size() != job.planes.size())
    throw Error(fmt::format("balancing plan: {} sets of places for {} planes", plan.places.size(), job.planes.size()));
  return Planner(job, plan, options).run();
}

std::vector<Foretold> check_last_run(const BalancingJob& job, const InfluenceOptions& options) {
  std::vector<Foretold> result;
  if (job.runs.size() < 2) return result;
  BalancingJob before = job;
  const BalancingRun last = before.runs.back();
  before.runs.pop_back();
  const std::vector<bool> told = planes_told(before);
  if (!std::all_of(told.begin(), told.end(), [](bool t) { return t; })) return result;
  const InfluenceFit fit = fit_influence(before, options);
  for (Index m = 0; m < fit.baseline.size(); ++m) {
    if (std::isnan(std::abs(last.vibration[m]))) continue;
    RunDesign design(before, fit.with_drift);
    const Eigen::RowVectorXcd x = design.row(last);
    const std::complex<double> foretold = (x * fit.unknowns(m))(0);
    const double leverage = (x * fit.cofactor[static_cast<std::size_t>(m)] * x.adjoint())(0, 0).real();
    const double sd = std::sqrt(0.5 * fit.scatter(m, m).real() * (1 + std::max(0.0, leverage)));
    const double radius = sd * circle_radius(2 * fit.spare);
    Foretold f;
    f.predicted = {std::abs(foretold), sd, std::isnan(radius) ? kNaN : std::max(std::abs(foretold) - radius, 0.0),
                   std::abs(foretold) + radius};
    f.measured = std::abs(last.vibration[m]);
    f.inside = !(std::abs(last.vibration[m] - foretold) > radius);
    result.push_back(f);
  }
  return result;
}

}  // namespace whirl::diagnosis
