#include "evidence/part_agreement.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

#include "evidence/verdict.hpp"
#include "rules/rules.hpp"
#include "trajectory/trajectory_runs.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/least_squares.hpp"

namespace whirl::identification::detail {
namespace {

/// What a part of the records says of the coefficients: information and gradient, in units of the residual variance
/// and of the standard deviation that each coefficient has by all parts.
struct Part {
  std::size_t record = 0;   // its number
  double from = 0, to = 0;  // s
  Eigen::MatrixXd information;
  Eigen::VectorXd gradient;
};

/// Moments in directions that the information shows.
struct Energy {
  double value = 0;
  double directions = 0;
};

/// g' N^-1 g in the directions that are known to a hundredth at least of what all parts tell: the rest is not told by
/// this part.
Energy energy(const Part& part) {
  constexpr double kShown = 1e-4;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(part.information);
  Energy e;
  for (Eigen::Index k = 0; k < part.gradient.size(); ++k) {
    const double shown = eigen.eigenvalues()[k];
    if (!(shown > kShown)) continue;
    e.value += std::pow(eigen.eigenvectors().col(k).dot(part.gradient), 2) / shown;
    ++e.directions;
  }
  return e;
}
Energy energy(const std::vector<Part>& parts) {
  Energy all;
  for (const Part& p : parts) {
    const Energy e = energy(p);
    all.value += e.value;
    all.directions += e.directions;
  }
  return all;
}

/// Runs joined into `count` parts of consecutive ones; no part holds runs of two records.
std::vector<Part> joined(const std::vector<Part>& runs, std::size_t count) {
  std::vector<Part> parts;
  std::size_t last = count;
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::size_t own = r * count / runs.size();
    if (own != last || runs[r].record != runs[r - 1].record) {
      parts.push_back(runs[r]);
    } else {
      parts.back().information += runs[r].information;
      parts.back().gradient += runs[r].gradient;
      parts.back().to = runs[r].to;
    }
    last = own;
  }
  return parts;
}

/// Runs of a few periods over all records, their starts fitted.
struct Runs {
  RunRecords records;
  std::vector<std::size_t> record;  // number, per stretch
  std::vector<TrajectoryRun> cut;
  TrajectoryModel model;
  Eigen::VectorXd sd;
  double variance = 0;  // of the residuals in units of sd
};
std::optional<Runs> fitted_runs(const std::vector<Recording>& records, const SindyOptions& options,
                                const IdentifiedModel& model) {
  constexpr Eigen::Index kMost = 10000;
  constexpr double kPeriods = 1.5;
  std::vector<Stretch> stretches = finite_stretches(records, options);
  Runs runs{{}, {}, {}, trajectory_model(model, options.states), smooth_stretches(stretches), 0};
  runs.records = runs_of(options, stretches);
  for (const Stretch& s : stretches) runs.record.push_back(s.record);
  if (static_cast<Eigen::Index>(runs.model.states.size()) != runs.records.states.front().cols()) return {};
  runs.sd = runs.sd.cwiseMax(1e-9 * stretches.front().raw.cwiseAbs().maxCoeff());
  const double period = 2 * std::numbers::pi / characteristic_rate(stretches);
  const auto length = std::max<Eigen::Index>(20, std::lround(kPeriods * period / stretches.front().dt));
  TrajectoryModel known = runs.model;
  for (TrajectoryParameter& p : known.parameters) p.free = false;
  TrajectoryOptions starts;
  starts.output_sd = runs.sd;
  starts.max_iterations = 5;
  const TrajectoryFit fit =
      fit_trajectory(known, runs.records.records, cut_trajectory_runs(runs.records, length, kMost), starts);
  if (fit.diverged) return {};
  runs.cut = fit.runs;
  const double freedom = static_cast<double>(fit.rows) -
                         static_cast<double>(fit.runs.size() * runs.model.states.size() + runs.model.parameters.size());
  runs.variance = fit.cost / freedom;
  return freedom > 0 ? std::optional(runs) : std::nullopt;
}

std::vector<Part> parts_of(const Runs& runs) {
  std::vector<Part> parts;
  const std::vector<TrajectorySums> sums = sums_by_run(runs.model, runs.records.records, runs.cut, runs.sd);
  for (std::size_t r = 0; r < sums.size(); ++r) {
    if (sums[r].diverged) continue;
    const Recording& record = runs.records.records[runs.cut[r].record];
    const auto time = [&](Eigen::Index i) { return record.t0 + record.dt * static_cast<double>(i); };
    const auto n = static_cast<Eigen::Index>(runs.model.states.size()), p = sums[r].gradient.size() - n;
    const Eigen::MatrixXd normal = sums[r].normal.selfadjointView<Eigen::Lower>();
    // The best start for any coefficients.
    const Eigen::MatrixXd towards =
        Eigen::MatrixXd(normal.bottomRightCorner(n, n)).ldlt().solve(Eigen::MatrixXd(normal.bottomLeftCorner(n, p)));
    parts.push_back({runs.record[runs.cut[r].record], time(runs.cut[r].first),
                     time(runs.cut[r].first + runs.cut[r].count), marginal_information(normal, p) / runs.variance,
                     (sums[r].gradient.head(p) - towards.transpose() * sums[r].gradient.tail(n)) / runs.variance});
  }
  return parts;
}

/// Turns the coefficients so that all parts together have the identity as information, about the coefficients that all
/// ask for. The matrix that turns back; empty where all parts together do not tell the coefficients.
Eigen::MatrixXd whitened(std::vector<Part>& parts) {
  const Eigen::Index p = parts.front().gradient.size();
  Eigen::MatrixXd total = Eigen::MatrixXd::Zero(p, p);
  Eigen::VectorXd gradient = Eigen::VectorXd::Zero(p);
  for (const Part& part : parts) {
    total += part.information;
    gradient += part.gradient;
  }
  const Eigen::MatrixXd covariance = invert_information(total).covariance;
  if (covariance.size() == 0) return {};
  const Eigen::LLT<Eigen::MatrixXd> root(covariance);
  if (root.info() != Eigen::Success) return {};
  const Eigen::MatrixXd l = root.matrixL();
  const Eigen::VectorXd shift = covariance * gradient;
  for (Part& part : parts) {
    part.gradient = l.transpose() * (part.gradient - part.information * shift);
    part.information = l.transpose() * part.information * l;
  }
  return l;
}

/// How parts of the records differ.
struct Difference {
  double chance = 1;  ///< of as much where they are the same
  std::vector<Part> parts;
  double noise = 1;  ///< variance of gradients of runs inside a part over what white noise gives
};
constexpr std::array<std::size_t, 3> kCounts = {1, 2, 8};  // of parts: the records, halves, eighths

/// Of the records, of halves and of eighths, where they differ most clearly.
Difference clearest(const std::vector<Part>& runs) {
  constexpr double kLeastRuns = 10;
  const auto p = static_cast<double>(runs.front().gradient.size());
  const Energy all = energy(runs);
  Difference most;
  for (const std::size_t count : kCounts) {
    const std::vector<Part> parts = joined(runs, count);
    const Energy between = energy(parts);
    const double freedom = between.directions - p, inside = all.directions - between.directions;
    if (parts.size() < 2 || !(freedom > 0)) continue;
    const double scatter = inside < kLeastRuns ? 1 : std::max(1.0, (all.value - between.value) / inside);
    const double ratio = between.value / freedom / scatter;
    if (!std::isfinite(ratio)) continue;
    const double chance =
        inside < kLeastRuns ? chi_squared_tail(freedom, ratio * freedom) : fisher_f_tail(freedom, inside, ratio);
    if (inside >= kLeastRuns && chi_squared_tail(inside, scatter * inside) < rules::kNotWhite)
      most.noise = std::max(most.noise, scatter);
    if (chance < most.chance) most = {chance, parts, most.noise};
  }
  return most;
}

/// What one part asks for: change of a coefficient and its standard deviation.
struct Asked {
  const Part* part = nullptr;
  double change = 0, sd = INFINITY;
  double clearly() const { return change / sd; }
};
Asked asked(const Part& part, const Eigen::RowVectorXd& row) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(part.information);
  Asked a{&part, 0, 0};
  for (Eigen::Index k = 0; k < row.size(); ++k) {
    const double shown = std::max(eigen.eigenvalues()[k], 1e-9);
    const double along = row.dot(eigen.eigenvectors().col(k));
    a.change += along * eigen.eigenvectors().col(k).dot(part.gradient) / shown;
    a.sd += along * along / shown;
  }
  a.sd = std::sqrt(a.sd);
  return a;
}

/// Spread of a coefficient over parts, weighted by what each tells.
double spread(const std::vector<Part>& parts, const Eigen::RowVectorXd& row) {
  if (parts.size() < 2) return 0;
  const auto n = static_cast<double>(parts.size());
  double squares = 0;
  for (const Part& part : parts) {
    const double share = std::max(part.information.trace() / static_cast<double>(row.size()), 0.1 / n);
    squares += std::pow(row.dot(part.gradient), 2) / share;
  }
  return std::sqrt(squares * n / (n - 1));
}

/// Variance of a coefficient by what runs scatter about their mean, over that by white noise.
double scatter(const std::vector<Part>& runs, const Eigen::RowVectorXd& row) {
  double squares = 0;
  for (const Part& run : runs) squares += std::pow(row.dot(run.gradient), 2);
  return squares / row.squaredNorm();
}

std::string place(const Part& part, const std::vector<Recording>& records) {
  const std::string seconds = fmt::format("{:.3g} to {:.3g} s", part.from, part.to);
  if (records.size() == 1) return seconds;
  const std::string& source = records[part.record].source;
  return fmt::format("{} from {}", source.empty() ? fmt::format("record {}", part.record + 1) : source, seconds);
}

void widen(const Eigen::VectorXd& by, IdentifiedModel& model) {
  Eigen::Index i = 0;
  for (Equation& e : model.equations) {
    for (EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) t.coefficient = Estimate::from_sd(t.coefficient.value, by[i++] * t.coefficient.sd);
    }
  }
  i = 0;
  for (auto& [name, value] : model.parameters) value = Estimate::from_sd(value.value, by[i++] * value.sd);
  Eigen::Map<Eigen::MatrixXd> covariance(model.parameter_covariance.data(), by.size(), by.size());
  if (model.parameter_covariance.size() == static_cast<std::size_t>(by.size() * by.size()))
    covariance = by.asDiagonal() * covariance * by.asDiagonal();
}

/// Names the coefficient on which parts differ most; false where that is less than 1 % of it.
bool tell(const Difference& difference, const Eigen::MatrixXd& rows, const std::vector<Recording>& records,
          IdentifiedModel& model) {
  Asked low, high;
  Eigen::Index most = 0;
  for (Eigen::Index j = 0; j < rows.rows(); ++j) {
    Asked least, largest;
    for (const Part& part : difference.parts) {
      const Asked a = asked(part, rows.row(j));
      if (least.part == nullptr || a.clearly() < least.clearly()) least = a;
      if (largest.part == nullptr || a.clearly() > largest.clearly()) largest = a;
    }
    if (high.part != nullptr && !(largest.clearly() - least.clearly() > high.clearly() - low.clearly())) continue;
    low = least;
    high = largest;
    most = j;
  }
  const auto& [name, value] = model.parameters[static_cast<std::size_t>(most)];
  if (!(high.change - low.change > rules::kPartsMatter * std::abs(value.value))) return false;
  model.summary.add({FindingCode::parts_differ,
                     Consequence::no_trust,
                     {{"first", value.value + low.change},
                      {"second", value.value + high.change},
                      {"deviations", (high.change - low.change) / std::hypot(high.sd, low.sd)}},
                     fmt::format("{} is {:.4g} by {} and {:.4g} by {}", name, value.value + low.change,
                                 place(*low.part, records), value.value + high.change, place(*high.part, records))});
  return true;
}

}  // namespace

void judge_parts(const std::vector<Recording>& records, const SindyOptions& options, IdentifiedModel& model) {
  if (model.summary.status == Status::unusable || options.discrete || !options.refine || options.hidden > 0 ||
      !options.equations.denominators.empty() || model.parameters.empty())
    return;
  const std::optional<Runs> fitted = fitted_runs(records, options, model);
  if (!fitted) return;
  std::vector<Part> runs = parts_of(*fitted);
  if (runs.size() < 2 || static_cast<std::size_t>(runs.front().gradient.size()) != model.parameters.size()) return;
  const Eigen::MatrixXd rows = whitened(runs);
  if (rows.size() == 0) return;
  const Difference difference = clearest(runs);
  // Noise that the model has is in its intervals.
  const bool more = difference.noise > 1 && model.noise_correlation.empty();
  Eigen::VectorXd variance = Eigen::VectorXd::Constant(rows.rows(), more ? difference.noise : 1);
  if (more) {  // not the same in all directions
    for (Eigen::Index j = 0; j < rows.rows(); ++j) variance[j] = std::max(variance[j], scatter(runs, rows.row(j)));
  }
  if (difference.chance < rules::kPartsDiffer && tell(difference, rows, records, model)) {
    for (const std::size_t count : kCounts) {
      const std::vector<Part> parts = joined(runs, count);
      for (Eigen::Index j = 0; j < rows.rows(); ++j)
        variance[j] = std::max(variance[j], 1 + std::pow(spread(parts, rows.row(j)) / rows.row(j).norm(), 2));
    }
  }
  if (variance.maxCoeff() > 1) widen(variance.cwiseSqrt(), model);
}

}  // namespace whirl::identification::detail
