#include "bounds/trapping.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <map>

#include "problem/sindy_prepare.hpp"
#include "record/bridge_gaps.hpp"
#include "rules/rules.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::identification::detail {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// constant + linear x + x' quadratic[i] x.
struct Quadratic {
  VectorXd constant;
  MatrixXd linear;
  std::vector<MatrixXd> quadratic;

  explicit Quadratic(Index n)
      : constant(VectorXd::Zero(n)),
        linear(MatrixXd::Zero(n, n)),
        quadratic(static_cast<std::size_t>(n), MatrixXd::Zero(n, n)) {}
  void add(double factor, const Quadratic& other) {
    constant += factor * other.constant;
    linear += factor * other.linear;
    for (std::size_t i = 0; i < quadratic.size(); ++i) quadratic[i] += factor * other.quadratic[i];
  }
  /// The same of y = d x.
  Quadratic scaled(const VectorXd& d) const {
    Quadratic out = *this;
    out.constant = d.cwiseProduct(constant);
    out.linear = d.asDiagonal() * linear * d.cwiseInverse().asDiagonal();
    for (std::size_t i = 0; i < quadratic.size(); ++i) {
      out.quadratic[i] = d[static_cast<Index>(i)] *
                         (d.cwiseInverse().asDiagonal() * quadratic[i] * d.cwiseInverse().asDiagonal()).eval();
    }
    return out;
  }
  /// Symmetric part of the slope at m.
  MatrixXd symmetric(const VectorXd& m) const {
    MatrixXd a = linear;
    for (std::size_t i = 0; i < quadratic.size(); ++i)
      a.row(static_cast<Index>(i)) += 2 * (quadratic[i] * m).transpose();
    return 0.5 * (a + a.transpose());
  }
};

bool of_degree_two(const expr::Expr& e, const std::vector<std::string>& states) {
  for (const std::string& v : expr::variables(e)) {
    if (std::find(states.begin(), states.end(), v) == states.end()) return false;
    for (const std::string& w : states) {
      const expr::Expr second = expr::differentiate(expr::differentiate(e, v), w);
      for (const std::string& z : states) {
        const expr::Expr third = expr::differentiate(second, z);
        for (const double at : {0.37, -0.81, 1.7}) {
          std::map<std::string, double, std::less<>> point;
          for (std::size_t i = 0; i < states.size(); ++i) point[states[i]] = at * (1 + 0.3 * static_cast<double>(i));
          if (!(std::abs(expr::evaluate(third, point)) < 1e-12)) return false;
        }
      }
    }
  }
  return true;
}

Quadratic expansion(const std::string& lhs, const std::string& function, double factor,
                    const std::vector<std::string>& states) {
  const expr::Expr e = expr::Expr::parse(function);
  const auto row = static_cast<std::size_t>(
      std::find_if(states.begin(), states.end(), [&](const std::string& s) { return lhs == s + "'"; }) -
      states.begin());
  if (row == states.size() || !of_degree_two(e, states))
    throw Error(
        fmt::format("{}: {} is beyond degree 2 in the states: --trapping is for quadratic systems", lhs, function));
  std::map<std::string, double, std::less<>> origin;
  for (const std::string& s : states) origin[s] = 0;
  const auto n = static_cast<Index>(states.size());
  Quadratic out(n);
  out.constant[static_cast<Index>(row)] = factor * expr::evaluate(e, origin);
  for (Index j = 0; j < n; ++j) {
    const expr::Expr slope = expr::differentiate(e, states[static_cast<std::size_t>(j)]);
    out.linear(static_cast<Index>(row), j) = factor * expr::evaluate(slope, origin);
    for (Index k = 0; k < n; ++k) {
      out.quadratic[row](j, k) =
          0.5 * factor * expr::evaluate(expr::differentiate(slope, states[static_cast<std::size_t>(k)]), origin);
    }
  }
  return out;
}

/// Right-hand sides as a sum over the parameters.
struct Family {
  Quadratic fixed;
  std::vector<Quadratic> slope;

  Quadratic at(const VectorXd& p) const {
    Quadratic q = fixed;
    for (std::size_t k = 0; k < slope.size(); ++k) q.add(p[static_cast<Index>(k)], slope[k]);
    return q;
  }
  Family scaled(const VectorXd& d) const {
    Family f{fixed.scaled(d), {}};
    for (const Quadratic& q : slope) f.slope.push_back(q.scaled(d));
    return f;
  }
};

Family family_of(const IdentifiedModel& model, const MatrixXd& ties) {
  const auto n = static_cast<Index>(model.states.size());
  Family f{Quadratic(n), std::vector<Quadratic>(static_cast<std::size_t>(ties.cols()), Quadratic(n))};
  Index estimated = 0;
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      const Quadratic one = expansion(e.lhs, t.function, 1, model.states);
      if (t.coefficient.sd == 0) {
        f.fixed.add(t.coefficient.value, one);
        continue;
      }
      for (Index k = 0; k < ties.cols(); ++k) f.slope[static_cast<std::size_t>(k)].add(ties(estimated, k), one);
      ++estimated;
    }
  }
  return f;
}

/// What every product x_i x_j x_k gains in energy: rows of products, one column per state whose weight it takes.
MatrixXd gains(const Quadratic& q) {
  const Index n = q.linear.rows();
  std::vector<Eigen::RowVectorXd> rows;
  for (Index i = 0; i < n; ++i) {
    for (Index j = i; j < n; ++j) {
      for (Index k = j; k < n; ++k) {
        Eigen::RowVectorXd row = Eigen::RowVectorXd::Zero(n);
        row[i] += q.quadratic[static_cast<std::size_t>(i)](j, k);
        row[j] += q.quadratic[static_cast<std::size_t>(j)](k, i);
        row[k] += q.quadratic[static_cast<std::size_t>(k)](i, j);
        rows.push_back(row);
      }
    }
  }
  MatrixXd out(static_cast<Index>(rows.size()), n);
  for (std::size_t r = 0; r < rows.size(); ++r) out.row(static_cast<Index>(r)) = rows[r];
  return out;
}

/// Parameters whose quadratic terms preserve the energy of unit weights, those nearest to p0.
struct Preserving {
  VectorXd p;
  MatrixXd covariance;
  double cost = 0;  ///< squared standard deviations
  Index conditions = 0;
};

Preserving preserving(const Family& f, const VectorXd& p0, const MatrixXd& covariance) {
  const VectorXd fixed = gains(f.fixed).rowwise().sum();
  MatrixXd e(fixed.size(), p0.size());
  for (std::size_t k = 0; k < f.slope.size(); ++k) e.col(static_cast<Index>(k)) = gains(f.slope[k]).rowwise().sum();
  // In standard deviations, so that the rank is one of numbers alike.
  const VectorXd sd = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  const VectorXd excess = e * p0 + fixed;
  MatrixXd whitened = e * sd.asDiagonal();
  VectorXd asked = excess;
  for (Index r = 0; r < e.rows(); ++r) {
    const double scale = whitened.row(r).norm();
    if (!(scale > 0)) {
      if (std::abs(excess[r]) > 1e-9 * std::max(1.0, std::abs(fixed[r])))
        throw Error("the given terms alone do not preserve an energy: no choice of the others makes them trapping");
      continue;
    }
    e.row(r) /= scale;
    asked[r] /= scale;
  }
  const MatrixXd c = covariance * e.transpose();
  const auto inverse = Eigen::CompleteOrthogonalDecomposition<MatrixXd>(MatrixXd(e * c));
  const VectorXd multipliers = inverse.solve(asked);
  Preserving out{p0 - c * multipliers, covariance - c * inverse.solve(c.transpose()), asked.dot(multipliers),
                 inverse.rank()};
  // What rounding leaves.
  out.p -= e.completeOrthogonalDecomposition().solve(e * out.p + (asked - e * p0));
  out.covariance = 0.5 * (out.covariance + out.covariance.transpose()).eval();
  return out;
}

double beyond(double conditions) { return conditions + 4 * std::sqrt(2 * conditions) + 6; }

/// Weights of the states for which the terms preserve the energy best: those of the gains' null space nearest to equal
/// shares of the motion. Empty where no positive ones are.
VectorXd weights_of(const Quadratic& q, const VectorXd& spread) {
  const VectorXd unit = spread.cwiseAbs2().cwiseInverse();
  MatrixXd g = gains(q.scaled(spread.cwiseInverse()));  // weights of the states in units of their spread
  g /= std::max(g.cwiseAbs().maxCoeff(), 1e-300);
  const Eigen::JacobiSVD<MatrixXd> svd(g, Eigen::ComputeFullV);
  const Index n = spread.size();
  VectorXd w = VectorXd::Zero(n);
  for (Index i = 0; i < n; ++i) {
    if (i + 1 < n && i < svd.singularValues().size() && svd.singularValues()[i] > 0.1 * svd.singularValues()[0])
      continue;
    w += svd.matrixV().col(i) * svd.matrixV().col(i).sum();
  }
  if (!(w.minCoeff() > 1e-3 * w.maxCoeff())) return {};
  return w.cwiseProduct(unit) / w.maxCoeff() * spread.cwiseAbs2().minCoeff();
}

double largest(const MatrixXd& s) {
  return Eigen::SelfAdjointEigenSolver<MatrixXd>(s, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
}

/// The shift nearest to m whose largest eigenvalue is at most `level`, by cutting planes; false: none.
bool shift_below(const Quadratic& q, double level, double tolerance, VectorXd& m) {
  constexpr int kCuts = 60;
  const Index n = m.size();
  const VectorXd start = m;
  const MatrixXd s0 = q.symmetric(VectorXd::Zero(n));
  std::vector<BoundRow> rows;
  VectorXd multipliers;
  for (int step = 0; step < kCuts; ++step) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(q.symmetric(m));
    if (eigen.eigenvalues().maxCoeff() <= level) return true;
    for (Index i = 0; i < n; ++i) {
      if (eigen.eigenvalues()[i] <= level) continue;
      const VectorXd v = eigen.eigenvectors().col(i);
      BoundRow row{VectorXd(n), level - tolerance - v.dot(s0 * v), ""};
      for (Index j = 0; j < n; ++j) row.a[j] = v.dot((q.symmetric(VectorXd::Unit(n, j)) - s0) * v);
      rows.push_back(std::move(row));
    }
    if (!nearest(start, MatrixXd::Identity(n, n), rows, m, multipliers)) return false;
  }
  return false;
}

/// The shift of the least eigenvalue, or of the smallest trapping ball where there are trapping ones.
VectorXd best_shift(const Quadratic& q, const VectorXd& centre, double margin) {
  const double tolerance = 0.01 * margin;
  VectorXd best = centre;
  double high = largest(q.symmetric(centre)),
         low = Eigen::SelfAdjointEigenSolver<MatrixXd>(MatrixXd(q.linear + q.linear.transpose())).eigenvalues()[0] / 2;
  double smallest = INFINITY;
  const auto take = [&](const VectorXd& m) {
    const double value = largest(q.symmetric(m));
    high = std::min(high, value);
    if (value > -margin) {
      if (!std::isfinite(smallest)) best = m;
      return;
    }
    VectorXd force = q.constant + q.linear * m;
    for (std::size_t i = 0; i < q.quadratic.size(); ++i) force[static_cast<Index>(i)] += m.dot(q.quadratic[i] * m);
    if (const double radius = force.norm() / -value; radius < smallest) {
      smallest = radius;
      best = m;
    }
  };
  take(centre);
  VectorXd m = centre;
  if (high > -margin && low < -margin && shift_below(q, -margin, tolerance, m)) take(m);
  for (int step = 0; step < 12 && high - low > tolerance; ++step) {
    const double level = 0.5 * (low + high);
    m = centre;
    if (shift_below(q, level, tolerance, m)) {
      take(m);
    } else {
      low = level;
    }
  }
  return best;
}

/// The parameters nearest to those of `from` that lose energy about m at `margin`; false: none. `cost`: of the planes.
bool parameters_below(const Family& f, const Preserving& from, const VectorXd& m, double margin,
                      std::vector<BoundRow> rows, VectorXd& p, double& cost) {
  constexpr int kCuts = 200;
  const Index n = m.size();
  for (int step = 0; step < kCuts; ++step) {
    VectorXd multipliers;
    if (rows.empty()) {
      p = from.p;
    } else if (!nearest(from.p, from.covariance, rows, p, multipliers)) {
      return false;
    }
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(f.at(p).symmetric(m));
    if (eigen.eigenvalues().maxCoeff() <= -margin) {
      cost = 0;
      if (!rows.empty()) {
        cost = multipliers.dot([&] {
          VectorXd reached(multipliers.size());
          for (std::size_t i = 0; i < rows.size(); ++i) reached[static_cast<Index>(i)] = rows[i].a.dot(from.p - p);
          return reached;
        }());
      }
      return true;
    }
    for (Index i = 0; i < n; ++i) {
      if (eigen.eigenvalues()[i] <= -margin) continue;
      const VectorXd v = eigen.eigenvectors().col(i);
      BoundRow row{VectorXd(p.size()), -1.01 * margin - v.dot(f.fixed.symmetric(m) * v), ""};
      for (Index k = 0; k < p.size(); ++k) row.a[k] = v.dot(f.slope[static_cast<std::size_t>(k)].symmetric(m) * v);
      rows.push_back(std::move(row));
    }
  }
  return false;
}

struct Held {
  Preserving energy;
  VectorXd p, shift;  // of the scaled states
  double cost = INFINITY;
};

/// Shift and parameters in turn; the cost falls from turn to turn.
Held hold(const Family& f, const VectorXd& p0, const MatrixXd& covariance, const VectorXd& centre,
          const std::vector<BoundRow>& bounds) {
  constexpr int kTurns = 20;
  Held held{preserving(f, p0, covariance), {}, centre, INFINITY};
  held.p = held.energy.p;
  const Eigen::SelfAdjointEigenSolver<MatrixXd> plain(f.at(held.p).symmetric(VectorXd::Zero(centre.size())));
  const double margin = 1e-3 * std::max(plain.eigenvalues().cwiseAbs().maxCoeff(), 1e-12);
  VectorXd p = held.p;
  for (int turn = 0; turn < kTurns; ++turn) {
    const VectorXd m = best_shift(f.at(p), centre, margin);
    double cost = 0;
    if (!parameters_below(f, held.energy, m, margin, bounds, p, cost)) break;
    const double before = held.cost;
    if (held.energy.cost + cost >= before) break;
    held.p = p;
    held.shift = m;
    held.cost = held.energy.cost + cost;
    if (cost == 0 || before - held.cost < 1e-3 * held.cost) break;
  }
  return held;
}

/// Error of free runs over a characteristic period, as a share of the motion, of the worst state.
double share_missed(const IdentifiedModel& model, const Recording& record) {
  const Recording whole = longest_whole_stretch(record);
  return worst_nrmse(score(model, whole, characteristic_period(whole, model.states)));
}

}  // namespace

void check_trapping(const IdentifyOptions& o) {
  if (!o.bounds.trapping) return;
  if (!o.sindy.inputs.empty() || o.sindy.order != 1)
    throw Error("--trapping is for quadratic systems of first order without inputs and time");
  if (std::isfinite(o.bounds.least_decay)) throw Error("--trapping and --stable-1s exclude each other");
  const auto check = [&](const std::string& lhs, const expr::Expr& term) {
    if (!of_degree_two(term, o.sindy.states))
      throw Error(
          fmt::format("{}: {} is no term of degree 2 in the states: --trapping is for quadratic systems "
                      "(--degree 2, or a --library of such terms)",
                      lhs, term.str()));
  };
  if (o.library) return;  // its variables are not yet those of the channels
  const SindyData data(o.sindy);
  for (const auto& [lhs, terms] : data.candidates()) {
    for (const expr::Expr& term : terms) check(lhs, term);
  }
}

Trapping hold_trapping(const Unknowns& unknowns, const std::vector<BoundRow>& bounds, const Recording& like,
                       IdentifiedModel& model) {
  const auto n = static_cast<Index>(model.parameters.size()), states = static_cast<Index>(model.states.size());
  const MatrixXd covariance = Eigen::Map<const MatrixXd>(model.parameter_covariance.data(), n, n);
  VectorXd p0(n), mean(states), spread(states);
  for (Index k = 0; k < n; ++k) p0[k] = model.parameters[static_cast<std::size_t>(k)].second.value;
  const Recording whole = longest_whole_stretch(like);
  for (Index i = 0; i < states; ++i) {
    const Eigen::ArrayXd x = whole[model.states[static_cast<std::size_t>(i)]].array();
    mean[i] = x.mean();
    spread[i] = std::max(std::sqrt((x - x.mean()).square().mean()), 1e-300);
  }
  const Family family = family_of(model, unknowns.ties);
  VectorXd d = VectorXd::Ones(states);
  Held held = hold(family, p0, covariance, mean, bounds);
  // Other weights where those of 1 are not what the records say.
  if (!(held.cost <= beyond(static_cast<double>(held.energy.conditions)))) {
    const VectorXd weights = weights_of(family.at(p0), spread);
    if (weights.size() > 0) {
      const VectorXd other = weights.cwiseSqrt();
      Held again = hold(family.scaled(other), p0, covariance, other.cwiseProduct(mean), bounds);
      if (again.cost < held.cost) {
        held = std::move(again);
        d = other;
      }
    }
  }
  if (!std::isfinite(held.cost))
    throw Error(
        "no trapping model of these terms lies near the records: about every shift of the states some direction gains "
        "energy. Without --trapping the equations are those that fit the records best");
  const double before = share_missed(model, like);
  write(held.p, held.energy.covariance, unknowns.ties, model);
  const double after = share_missed(model, like);
  if (held.cost > beyond(static_cast<double>(held.energy.conditions))) {
    model.summary.warn(fmt::format(
        "the records contradict a trapping model: it lies {:.3g} standard deviations from the most likely one; over "
        "one period free runs miss {:.2g} % of the motion, {:.2g} % without the constraint",
        std::sqrt(held.cost), 100 * after, 100 * before));
    if (!(after < rules::kLost)) model.summary.fail("no trapping model of these terms follows the records");
  }
  return certify(model, held.shift.cwiseQuotient(d), d.cwiseAbs2());
}

}  // namespace whirl::identification::detail
