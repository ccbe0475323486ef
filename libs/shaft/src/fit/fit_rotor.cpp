#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "fit/evidence.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/reduction.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// A descent that ends with so much more than the scatter of the vectors is in a false minimum, or no geometry fits.
constexpr double kFalseMinimum = 1.5;
constexpr double kStartFactorStiffness = 2, kStartFactorDamping = 4;  // further starts lie within these of the file's
constexpr int kTryIterations = 15;
constexpr double kWorth = 0.05;            // a descent that takes less of a misfit is not gone on with
constexpr int kPasses = 12, kSettled = 2;  // descents about the values found at most; steps of one that moves nothing
constexpr double kHeld = 1e-3;             // prior of an unknown that does not move, in its units

void check_fit(const Rotor& rotor, const FitSetup& setup, const std::vector<OrderRun>& runs) {
  if (runs.empty()) throw Error("a fit needs at least one run");
  if (rotor.probes.empty()) throw Error("the rotor has no [[probe]]: a fit needs the places of those of the records");
  if (rotor.unbalances.empty())
    throw Error("the rotor has no [[unbalance]]: a fit needs the stations at which it may be (a size of 0 will do)");
  for (const OrderRun& run : runs)
    if (run.vectors.rows() != static_cast<Index>(rotor.probes.size()))
      throw Error::in_field("run " + run.name, fmt::format("{} channels", run.vectors.rows()),
                            fmt::format("one of each probe, {}", rotor.probes.size()));
  for (const Trial& t : setup.trials) {
    if (std::ranges::find(runs, t.run, &OrderRun::name) == runs.end()) {
      std::string known;
      for (const OrderRun& run : runs) known += (known.empty() ? "" : ", ") + run.name;
      throw Error::in_field("trial.run", t.run, "the name of a run: " + known);
    }
    require_range("trial.position", t.position, 0, rotor.length() * (1 + 1e-9), "m");
  }
}

/// A start beside that of the file.
VectorXd other_start(const ParameterSet& set, std::mt19937_64& random) {
  std::uniform_real_distribution<double> even(-1, 1);
  VectorXd t = set.start();
  for (Index k = 0; k < set.structural; ++k) {
    const Parameter& p = set.all[static_cast<std::size_t>(k)];
    if (!p.logarithmic) continue;
    t[k] += even(random) * std::log(p.kind == UnknownKind::stiffness ? kStartFactorStiffness : kStartFactorDamping);
  }
  return t;
}

class RotorFitter {
 public:
  RotorFitter(const Rotor& drawn, const FitSetup& setup, const std::vector<OrderRun>& runs, const FitOptions& options)
      : drawn_(drawn), setup_(setup), runs_(runs), options_(options) {
    double lowest = std::numeric_limits<double>::infinity(), highest = 0;
    for (const OrderRun& run : runs) {
      lowest = std::min(lowest, run.speed.minCoeff());
      highest = std::max(highest, run.speed.maxCoeff());
    }
    set_ = make_parameters(drawn, setup, lowest, highest);
  }

  RotorFit fit() {
    point_.t = set_.start();
    FitProblem problem(model_at(point_.t), runs_);
    search(problem);
    judge(problem);
    return std::move(result_);
  }

 private:
  std::shared_ptr<FitModel> model_at(const VectorXd& t) const {
    return std::make_shared<FitModel>(drawn_, set_, setup_.trials, t, options_.modes);
  }

  /// Descends twice: first with the drawing as it is and with the damping that turns with the shaft held, which on the
  /// way to a solution far off takes values at which the rotor is unstable.
  void descend_in_stages(FitProblem& problem, FitPoint& point, SquareSum& sum, int iterations) {
    ParameterSet held = set_;
    for (Parameter& p : held.all) {
      if (p.kind == UnknownKind::material_damping || p.kind == UnknownKind::joint_damping) p.prior_sd = kHeld;
      if (is_tolerance(p.kind)) p.prior_sd *= kHeld;
    }
    problem.set_model(std::make_shared<FitModel>(drawn_, held, setup_.trials, point.t, options_.modes));
    problem.linearise(point, sum);
    result_.iterations += descend(problem, point, sum, iterations).iterations;
    problem.set_model(model_at(point.t));
    problem.linearise(point, sum);
    result_.iterations += descend(problem, point, sum, iterations).iterations;
  }

  /// From the file's values; where that ends in a misfit, from others.
  void search(FitProblem& problem) {
    descend_in_stages(problem, point_, sum_, options_.max_iterations);
    settle(problem);
    const auto false_minimum = [&] {
      const FitMisfit m = misfit_of(problem, set_.size());
      return !(m.chi_square < kFalseMinimum) || m.above_scatter();
    };
    std::mt19937_64 random(1);
    bool better = true, open = false_minimum();
    for (int k = 0; k < options_.restarts && open; ++k) {
      ++result_.starts;
      // By the noise of the runs: what a false minimum leaves from block to block hides the way to another.
      problem.reset_noise();
      problem.set_model(model_at(point_.t));
      problem.linearise(point_, sum_);
      FitPoint other{other_start(set_, random)};
      SquareSum sum;
      descend_in_stages(problem, other, sum, kTryIterations);
      better = sum.cost < sum_.cost;
      if (!better) continue;
      point_ = other;
      settle(problem);
      open = false_minimum();
    }
    if (!better) settle(problem);
  }

  /// Descends about the values found, with the noise that the residuals show, until neither moves them. Where a run
  /// says little of a coefficient the way is a long, bent valley: a descent that merely ran out of steps is not the
  /// end.
  void settle(FitProblem& problem) {
    settled_ = false;
    for (int pass = 0; pass < kPasses && !settled_; ++pass) {
      renew_noise(problem);
      problem.set_model(model_at(point_.t));
      problem.linearise(point_, sum_);
      const double before = sum_.cost;
      const DescentReport report = descend(problem, point_, sum_, options_.max_iterations);
      result_.iterations += report.iterations;
      settled_ =
          report.end != Descent::exhausted && (report.end != Descent::converged || report.iterations <= kSettled);
      // What no way explains is contradicted wherever its valley ends.
      const bool contradicted = sum_.cost > kFalseMinimum * static_cast<double>(problem.equations());
      if (contradicted && before - sum_.cost < kWorth * before) break;
    }
    problem.linearise(point_, sum_);
  }

  void judge(FitProblem& problem) {
    result_.misfit = misfit_of(problem, set_.size());
    result_.rotor = with_values(drawn_, set_, point_.t, true);
    const double inflation = std::max(1.0, result_.misfit.chi_square);
    const InverseInformation inverse = invert_information(sum_.normal, 1e-14);
    result_.covariance = inflation * inverse.covariance;
    result_.summary.condition_number = inverse.condition_number;
    const VectorXd units = relative_units(problem, point_.t);
    const MatrixXd open = open_information(set_, problem.information(), units) / inflation;
    const VectorXd relative =
        1.959964 * invert_information(open, 1e-14).covariance.diagonal().cwiseMax(0).cwiseSqrt().cwiseProduct(units);
    for (Index k = 0; k < set_.size(); ++k) result_.unknowns.push_back(unknown(k, relative[k]));
    result_.weak = weak_directions(set_, point_.t, open, units);
    if (options_.next) result_.next = next_runs(problem, point_.t, units);
    for (Index p = 0; p < set_.probes; ++p) {
      double worst = 0;
      for (std::size_t r = 0; r < runs_.size(); ++r) worst = std::max(worst, problem.noise(r, p));
      result_.noise.push_back(worst);
    }
    for (std::size_t r = 0; r < runs_.size(); ++r) {
      Eigen::MatrixXcd residual = problem.residuals()[r].value;
      for (Index p = 0; p < set_.probes; ++p)
        residual.row(p).array() *= (runs_[r].samples.transpose().array() / 2).rsqrt() * problem.noise(r, p);
      result_.residuals.push_back(std::move(residual));
    }
    result_.model = std::make_shared<FitModel>(problem.model());
    summarise();
  }

  FitUnknown unknown(Index k, double relative) const {
    const Parameter& p = set_.all[static_cast<std::size_t>(k)];
    FitUnknown u{p.kind, p.index, p.row, p.column, p.part, p.name, p.unit, {}, relative, relative <= kIdentifiable};
    const double t = point_.t[k], sd = std::sqrt(std::max(0.0, result_.covariance(k, k)));
    u.estimate.value = p.value(t);
    u.estimate.sd = sd * (p.logarithmic ? u.estimate.value : std::abs(p.scale));
    const double one = p.value(t - 1.959964 * sd), two = p.value(t + 1.959964 * sd);
    u.estimate.low = std::min(one, two);
    u.estimate.high = std::max(one, two);
    return u;
  }

  void summarise() {
    Summary& s = result_.summary;
    const FitMisfit& m = result_.misfit;
    s.chi_square = m.chi_square;
    s.trust = "Its parameters may be used within their intervals, in the speeds of the records.";
    if (!m.explained) {
      std::string because = fmt::format(
          ": geometry, supports or unbalance stations differ from the file beyond its tolerances ({:.1f} standard "
          "deviations)",
          m.most());
      if (m.band_deviations > kBandLimit)
        because += fmt::format("; most at {:.0f} to {:.0f} rpm of {}", m.band_from * 30 / M_PI, m.band_to * 30 / M_PI,
                               m.band_run);
      s.add({FindingCode::model_error,
             Consequence::no_trust,
             {{"chi_square", m.chi_square}, {"deviations", m.most()}},
             m.band_run},
            because);
      s.trust = result_.starts > options_.restarts
                    ? fmt::format(
                          "Do not trust this model: the records contradict the rotor file, or none of {} starts led "
                          "to its values.",
                          result_.starts)
                    : "Do not trust this model: the records contradict the rotor file.";
      if (setup_.trials.empty() && setup_.tolerance.probe_gain == 0)
        s.trust += " Nothing states the gains of the probes: give fit.tolerance.probe_gain_percent.";
    }
    if (!settled_) {
      const auto steps = static_cast<double>(result_.iterations);
      s.add({FindingCode::work_limit, Consequence::no_trust, {{"steps", steps}}, "the rotor"});
      if (m.explained) s.trust = trust_text(s.findings.back());
    }
    if (const Finding* distrust = s.distrust()) result_.rotor.not_trusted = to_string(distrust->code);
    std::string open;
    for (const FitUnknown& u : result_.unknowns)
      if (!u.identifiable && u.kind != UnknownKind::runout) open += (open.empty() ? "" : ", ") + u.name;
    if (!open.empty()) s.warn("not identifiable from these records: " + open);
  }

  const Rotor& drawn_;
  const FitSetup& setup_;
  const std::vector<OrderRun>& runs_;
  const FitOptions& options_;
  ParameterSet set_;
  FitPoint point_;
  SquareSum sum_;
  bool settled_ = false;
  RotorFit result_;
};

}  // namespace

RotorFit fit_rotor(const Rotor& rotor, const FitSetup& setup, const std::vector<OrderRun>& runs,
                   const FitOptions& options) {
  check(rotor);
  check_fit(rotor, setup, runs);
  for (const Actuator& a : rotor.actuators)
    if (a.bias_stiffness != 0)
      throw Error::in_field(
          "actuator " + a.name + ".bias_stiffness", fmt::format("{:g} N/m", a.bias_stiffness),
          "0 in a fit: records of a rotor that its magnets hold have forces that the fit does not take");
  require_range("modes", options.modes, 2, 1000);
  return RotorFitter(rotor, setup, runs, options).fit();
}

}  // namespace whirl::shaft
