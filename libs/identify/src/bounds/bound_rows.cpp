#include "bounds/bound_rows.hpp"

#include <algorithm>
#include <cmath>

#include "problem/sindy_prepare.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/identify/sindy_library.hpp"

namespace whirl::identification::detail {

bool nearest(const Eigen::VectorXd& p0, const Eigen::MatrixXd& covariance, const std::vector<BoundRow>& rows,
             Eigen::VectorXd& p, Eigen::VectorXd& multipliers) {
  constexpr int kPasses = 20000;
  const auto m = static_cast<Eigen::Index>(rows.size());
  Eigen::MatrixXd a(m, p0.size());
  Eigen::VectorXd excess(m);
  for (Eigen::Index i = 0; i < m; ++i) {
    const BoundRow& row = rows[static_cast<std::size_t>(i)];
    const double unit = std::sqrt(row.a.dot(covariance * row.a));
    if (!(unit > 0)) {  // nothing that is estimated moves it
      if (row.a.dot(p0) > row.b + 1e-12 * std::max(1.0, std::abs(row.b))) return false;
      a.row(i).setZero();
      excess[i] = 0;
      continue;
    }
    a.row(i) = row.a.transpose() / unit;
    excess[i] = (row.a.dot(p0) - row.b) / unit;
  }
  const Eigen::MatrixXd g = a * covariance * a.transpose();
  multipliers = Eigen::VectorXd::Zero(m);
  // In standard deviations, of which a clean record lies very many away from a bound that it breaks.
  const double scale = std::max(1.0, excess.cwiseAbs().maxCoeff());
  for (int pass = 0; pass < kPasses; ++pass) {
    double change = 0;
    for (Eigen::Index i = 0; i < m; ++i) {
      if (!(g(i, i) > 0)) continue;
      const double next = std::max(0.0, multipliers[i] + (excess[i] - g.row(i).dot(multipliers)) / g(i, i));
      change = std::max(change, std::abs(next - multipliers[i]));
      multipliers[i] = next;
    }
    if (change < 1e-10 * scale) {
      p = p0 - covariance * (a.transpose() * multipliers);
      return true;
    }
    if (multipliers.maxCoeff() > 1e9 * scale) break;
  }
  return false;
}

Unknowns unknowns_of(const IdentifyOptions& options, const Recording& like, const IdentifiedModel& model) {
  Unknowns u;
  const auto n = static_cast<Eigen::Index>(model.parameters.size());
  std::vector<Eigen::RowVectorXd> rows;
  if (!options.library) {
    const detail::SindyData data(options.sindy);
    for (const auto& [lhs, terms] : data.candidates()) {
      for (const expr::Expr& term : terms) u.names.insert(lhs + ": " + term.str());
    }
    u.ties = Eigen::MatrixXd::Identity(n, n);  // set term by term in this order
    return u;
  }
  const expr::CandidateLibrary library = like.has("X1") ? *options.library : in_channel_names(*options.library);
  const auto name_of = [&](const expr::TiedGroup& group) {
    const auto same = [&](const expr::TiedGroup& g) { return g.name == group.name; };
    const bool alone = std::count_if(library.groups.begin(), library.groups.end(), same) == 1;
    return alone ? group.name : library.lhs[group.entries.front().equation] + ": " + group.name;
  };
  for (const expr::TiedGroup& g : library.groups) u.names.insert(name_of(g));
  for (std::size_t i = 0; i < library.lhs.size(); ++i) {
    for (const expr::TiedGroup& g : library.groups) {
      const auto at = std::find_if(model.parameters.begin(), model.parameters.end(),
                                   [&](const auto& p) { return p.first == name_of(g); });
      if (at == model.parameters.end()) continue;
      for (const expr::TiedEntry& e : g.entries) {
        if (e.equation == i) rows.emplace_back(Eigen::RowVectorXd::Unit(n, at - model.parameters.begin()) * e.factor);
      }
    }
  }
  u.ties.resize(static_cast<Eigen::Index>(rows.size()), n);
  for (std::size_t r = 0; r < rows.size(); ++r) u.ties.row(static_cast<Eigen::Index>(r)) = rows[r];
  return u;
}

void write(const Eigen::VectorXd& p, const Eigen::MatrixXd& covariance, const Eigen::MatrixXd& ties,
           IdentifiedModel& model) {
  const auto estimate = [](double value, double variance) {
    const double sd = std::sqrt(std::max(variance, 0.0));
    // A sd of 0 would mark a coefficient that is given.
    return Estimate::from_sd(value, std::max(sd, 1e-12 * std::max(std::abs(value), 1e-300)));
  };
  for (std::size_t k = 0; k < model.parameters.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    model.parameters[k].second = estimate(p[at], covariance(at, at));
  }
  model.parameter_covariance.assign(covariance.data(), covariance.data() + covariance.size());
  Eigen::Index row = 0;
  for (Equation& e : model.equations) {
    for (EquationTerm& t : e.terms) {
      if (t.coefficient.sd == 0) continue;
      const Eigen::VectorXd tie = ties.row(row++).transpose();
      t.coefficient = estimate(tie.dot(p), tie.dot(covariance * tie));
    }
  }
}

}  // namespace whirl::identification::detail
