#include "whirl/lagrange/physical.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "relations.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::lagrange {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Directions of the parameters, each in units of its own size, that the relations see and those that they do not.
struct Directions {
  MatrixXd seen;                  ///< orthonormal columns
  MatrixXd unseen;                ///< one unit entry per parameter of `references`
  std::vector<Index> references;  ///< parameters that must be given: the earliest declared ones
};

Directions directions(const MatrixXd& scaled) {
  MatrixXd rows = scaled;
  for (Index r = 0; r < rows.rows(); ++r) {
    if (const double norm = rows.row(r).norm(); norm > 0) rows.row(r) /= norm;
  }
  Eigen::CompleteOrthogonalDecomposition<MatrixXd> decomposition(rows.rows(), rows.cols());
  decomposition.setThreshold(1e-8);
  decomposition.compute(rows);
  const Index rank = decomposition.rank();
  const MatrixXd all = decomposition.colsPermutation() * decomposition.matrixZ().transpose();
  Directions found{all.leftCols(rank), all.rightCols(all.cols() - rank), {}};
  MatrixXd& basis = found.unseen;
  Index column = 0;
  for (Index p = 0; p < basis.rows() && column < basis.cols(); ++p) {
    Index pivot = 0;
    if (basis.row(p).tail(basis.cols() - column).cwiseAbs().maxCoeff(&pivot) < 1e-6) continue;
    basis.col(column).swap(basis.col(column + pivot));
    basis.col(column) /= basis(p, column);
    for (Index c = 0; c < basis.cols(); ++c) {
      if (c != column) basis.col(c) -= basis(p, c) * basis.col(column);
    }
    found.references.push_back(p);
    ++column;
  }
  return found;
}

/// The exponent as a small fraction; false when it is none.
bool fraction(double& exponent) {
  const double twelfths = std::round(12 * exponent);
  if (std::abs(12 * exponent - twelfths) > 1e-4) return false;
  exponent = twelfths / 12;
  return true;
}

/// What the parameters have to meet: relations to the unknowns of the fit and to values measured apart.
struct Task {
  RelationProblem problem;
  std::map<std::string, expr::Expr, std::less<>> exact;
  expr::UnitMap units;
  MatrixXd covariance;              ///< of the observed values
  std::vector<std::string> unused;  ///< not known and in no relation
};

bool occurs(const std::string& name, const std::vector<expr::Expr>& relations) {
  return std::any_of(relations.begin(), relations.end(), [&](const expr::Expr& e) {
    const std::vector<std::string> names = expr::variables(e);
    return std::find(names.begin(), names.end(), name) != names.end();
  });
}

Task make_task(const expr::CandidateLibrary& library, const UnknownEstimates& fit,
               const std::vector<PhysicalParameter>& parameters) {
  Task task;
  RelationProblem& problem = task.problem;
  for (const PhysicalParameter& p : parameters) {
    if (!p.unit.empty()) task.units[p.name] = expr::Unit::parse(p.unit);
    if (p.exact()) task.exact.emplace(p.name, expr::Expr(p.value.value));
  }
  for (const expr::TiedGroup& group : library.groups) {
    if (group.coefficient.empty()) throw Error(fmt::format("group '{}' has no meaning in parameters", group.name));
    problem.relations.push_back(expr::substitute(expr::Expr::parse(group.coefficient), task.exact));
  }
  std::vector<std::pair<std::string, Estimate>> given;
  const std::vector<expr::Expr> relations = problem.relations;
  for (const PhysicalParameter& p : parameters) {
    if (p.exact() || !occurs(p.name, relations)) {
      if (!p.known()) task.unused.push_back(p.name);
      continue;
    }
    if (p.known()) given.emplace_back(p.name, p.value);
    problem.names.push_back(p.name);
    problem.units.push_back(p.unit);
  }
  const Index groups = fit.value.size(), rows = groups + static_cast<Index>(given.size());
  problem.observed.resize(rows);
  problem.observed.head(groups) = fit.value;
  task.covariance = MatrixXd::Zero(rows, rows);
  task.covariance.topLeftCorner(groups, groups) = fit.covariance;
  for (Index row = groups; row < rows; ++row) {
    const auto& [name, value] = given[static_cast<std::size_t>(row - groups)];
    problem.relations.push_back(expr::Expr::symbol(name));
    problem.observed[row] = value.value;
    task.covariance(row, row) = value.sd * value.sd;
  }
  return task;
}

/// What a solution says about any term of the parameters.
class Reader {
 public:
  Reader(const Task& task, const RelationSolution& solution, VectorXd scale, Directions space, MatrixXd spread,
         bool intervals)
      : task_(task),
        solution_(solution),
        scale_(std::move(scale)),
        space_(std::move(space)),
        spread_(std::move(spread)),
        intervals_(intervals) {}

  PhysicalQuantity quantity(const std::string& name, const expr::Expr& term) const {
    const auto [value, gradient] = evaluate(term);
    const double sd = std::sqrt(std::max(0.0, (gradient * spread_ * gradient.transpose())(0, 0)));
    const std::vector<std::string>& names = task_.problem.names;
    const auto itself = std::find(names.begin(), names.end(), name);
    const std::optional<expr::Unit> unit = expr::unit_of(term, task_.units);
    // An angle's own text: in products rad is the number one.
    const std::string text = itself != names.end()
                                 ? task_.problem.units[static_cast<std::size_t>(itself - names.begin())]
                             : unit ? unit->str()
                                    : "";
    return {name, text, intervals_ ? Estimate::from_sd(value[0], sd) : Estimate{value[0]}};
  }

  /// The fit sees every direction that moves the term.
  bool determined(const expr::Expr& term) const {
    const auto [value, gradient] = evaluate(term);
    const VectorXd slope = scale_.cwiseProduct(gradient.row(0).transpose());
    return space_.unseen.cols() == 0 || (slope.transpose() * space_.unseen).norm() < 1e-6 * (slope.norm() + 1e-300);
  }

  /// Parameter k over powers of those that must be given; nothing where no small fractions do it.
  std::optional<expr::Expr> combination(Index k) const {
    const std::vector<std::string>& names = task_.problem.names;
    expr::Expr product = expr::Expr::symbol(names[static_cast<std::size_t>(k)]);
    if (std::find(space_.references.begin(), space_.references.end(), k) != space_.references.end()) return {};
    for (std::size_t r = 0; r < space_.references.size(); ++r) {
      double exponent = space_.unseen(k, static_cast<Index>(r));
      if (!fraction(exponent)) return {};
      product = product * pow(expr::Expr::symbol(names[static_cast<std::size_t>(space_.references[r])]), -exponent);
    }
    if (!determined(product)) return {};
    return product;
  }

  const MatrixXd& spread() const { return spread_; }
  const std::vector<Index>& references() const { return space_.references; }

 private:
  std::pair<VectorXd, MatrixXd> evaluate(const expr::Expr& term) const {
    std::pair<VectorXd, MatrixXd> result;
    Relations({expr::substitute(term, task_.exact)}, task_.problem.names)
        .evaluate(solution_.p, result.first, result.second);
    return result;
  }

  const Task& task_;
  const RelationSolution& solution_;
  VectorXd scale_;
  Directions space_;
  MatrixXd spread_;
  bool intervals_;
};

/// Misfit of more than 1e-3 of the values without excess relations, or far beyond chi^2's spread with them, is no
/// solution.
void judge(PhysicalParameters& result, double chi_square, bool intervals) {
  const double bound = result.excess + 6 * std::sqrt(2.0 * result.excess) + 10;
  if (!std::isfinite(chi_square) || (result.excess == 0 && chi_square > 1e-3)) {
    result.summary.fail("no parameters give the unknowns of the fit");
  } else if (result.excess > 0 && intervals && chi_square > bound) {
    result.summary.warn(
        fmt::format("the fit contradicts the relations between its unknowns: chi^2 {:.3g} for {} excess relation{}",
                    chi_square, result.excess, result.excess > 1 ? "s" : ""));
  }
}

void list_parameters(const Reader& reader, const RelationProblem& problem, PhysicalParameters& result) {
  std::vector<Index> found;
  for (Index k = 0; k < static_cast<Index>(problem.names.size()); ++k) {
    const std::string& name = problem.names[static_cast<std::size_t>(k)];
    if (reader.determined(expr::Expr::symbol(name))) {
      found.push_back(k);
      result.parameters.push_back(reader.quantity(name, expr::Expr::symbol(name)));
      continue;
    }
    result.undetermined.push_back(name);
    if (const std::optional<expr::Expr> product = reader.combination(k)) {
      result.combinations.push_back(reader.quantity(product->str(), *product));
    }
  }
  result.covariance = reader.spread()(found, found);
}

void warn_of_undetermined(const Reader& reader, const RelationProblem& problem, PhysicalParameters& result) {
  if (result.undetermined.empty()) return;
  std::string list, ask;
  for (const std::string& name : result.undetermined) list += (list.empty() ? "" : ", ") + name;
  for (const Index r : reader.references())
    ask += (ask.empty() ? "" : " and ") + problem.names[static_cast<std::size_t>(r)];
  result.summary.warn(fmt::format("not determined by this fit: {}{}", list,
                                  ask.empty() ? "" : "; a value of " + ask + " would determine what hangs on it"));
}

}  // namespace

PhysicalParameters physical_parameters(const expr::CandidateLibrary& library, const UnknownEstimates& fit,
                                       const std::vector<PhysicalParameter>& parameters,
                                       const std::vector<std::string>& report) {
  const Index groups = static_cast<Index>(library.groups.size());
  if (fit.value.size() != groups || fit.covariance.rows() != groups || fit.covariance.cols() != groups) {
    throw Error(fmt::format("{} unknowns estimated, the library has {}", fit.value.size(), groups));
  }
  PhysicalParameters result;
  for (const std::string& note : fit.notes) result.summary.warn(note);
  Task task = make_task(library, fit, parameters);
  RelationProblem& problem = task.problem;
  result.undetermined = task.unused;
  if (!problem.observed.allFinite()) {
    result.summary.fail("an unknown of the fit is not a number");
    return result;
  }
  const Index n = static_cast<Index>(problem.names.size()), rows = problem.observed.size();
  if (n == 0) return result;
  problem.whitening = whitening(problem.observed, task.covariance);
  const bool intervals = task.covariance.diagonal().allFinite() && (task.covariance.diagonal().array() > 0).any();

  const Relations relations(problem.relations, problem.names);
  const RelationSolution solution = solve(problem, relations);
  const VectorXd scale = problem.scale(solution.p);
  const MatrixXd scaled = problem.whitening * solution.jacobian * scale.asDiagonal();
  const Directions space = directions(scaled);
  result.excess = static_cast<int>(rows - space.seen.cols());
  result.summary.residual = solution.chi_square;
  judge(result, solution.chi_square, intervals);
  if (result.summary.status == Status::unusable) return result;
  // Directions that the fit does not see get no variance here and are not reported.
  const MatrixXd basis = scale.asDiagonal() * space.seen;
  const MatrixXd inverse = basis * minimal_norm(scaled * space.seen, MatrixXd::Identity(rows, rows));
  const Reader reader(task, solution, scale, space, inverse * inverse.transpose(), intervals);

  list_parameters(reader, problem, result);
  for (const std::string& text : report) {
    const expr::Expr term = expr::Expr::parse(text);
    if (reader.determined(term)) {
      result.reported.push_back(reader.quantity(text, term));
    } else {
      result.summary.warn(fmt::format("{} is not determined", text));
    }
  }
  warn_of_undetermined(reader, problem, result);
  if (!intervals) result.summary.warn("the fit states no uncertainties: no intervals");
  return result;
}

}  // namespace whirl::lagrange
