// Unknowns of a library out of an identified model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/lagrange/physical.hpp"

namespace whirl::lagrange {
namespace {

/// A function without number in one equation, and a dense index for it.
class Places {
 public:
  Eigen::Index index(std::size_t equation, const expr::Expr& function, bool add) {
    for (std::size_t i = 0; i < places_.size(); ++i) {
      if (places_[i].first == equation && places_[i].second == function) return static_cast<Eigen::Index>(i);
    }
    if (!add) return -1;
    places_.emplace_back(equation, function);
    return static_cast<Eigen::Index>(places_.size()) - 1;
  }
  Eigen::Index size() const { return static_cast<Eigen::Index>(places_.size()); }
  const expr::Expr& function(Eigen::Index i) const { return places_[static_cast<std::size_t>(i)].second; }
  std::size_t equation(Eigen::Index i) const { return places_[static_cast<std::size_t>(i)].first; }

 private:
  std::vector<std::pair<std::size_t, expr::Expr>> places_;
};

/// number * function for every summand of the multiplied-out term.
std::vector<std::pair<double, expr::Expr>> monomials(const expr::Expr& e) {
  const expr::Expr sum = expr::expand(e);
  std::vector<std::pair<double, expr::Expr>> result;
  if (sum.kind() != expr::Expr::Kind::sum) {
    if (!sum.is_number(0)) result.push_back(expr::split_coefficient(sum));
    return result;
  }
  for (const expr::Expr& term : sum.args()) result.push_back(expr::split_coefficient(term));
  return result;
}

/// Coefficients that are one random number: the same size and sd in several equations of a tied fit.
struct Variable {
  Estimate coefficient;           ///< magnitude
  Eigen::VectorXd column;         ///< of places, signs included
  std::ptrdiff_t parameter = -1;  ///< of the model with this coefficient; -1: none
  double sign = 1;                ///< of that parameter
};

/// Index of the parameter that an untied fit keeps for a term: "v': x^3", or "x^3" alone; -1: none.
std::ptrdiff_t parameter_of(const IdentifiedModel& model, const std::string& lhs, const std::string& function) {
  for (const std::string& name : {lhs + ": " + function, function}) {
    for (std::size_t p = 0; p < model.parameters.size(); ++p) {
      if (model.parameters[p].first == name) return static_cast<std::ptrdiff_t>(p);
    }
  }
  return -1;
}

bool same(const Estimate& a, const Estimate& b) {
  return std::abs(std::abs(a.value) - std::abs(b.value)) <= 1e-12 * std::abs(a.value) &&
         (std::abs(a.sd - b.sd) <= 1e-9 * a.sd || (std::isnan(a.sd) && std::isnan(b.sd)));
}

Eigen::MatrixXd library_matrix(const expr::CandidateLibrary& library, Places& places) {
  std::vector<std::tuple<Eigen::Index, Eigen::Index, double>> entries;
  for (std::size_t g = 0; g < library.groups.size(); ++g) {
    for (const expr::TiedEntry& entry : library.groups[g].entries) {
      for (const auto& [number, function] : monomials(entry.function)) {
        entries.emplace_back(places.index(entry.equation, function, true), g, entry.factor * number);
      }
    }
  }
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(places.size(), static_cast<Eigen::Index>(library.groups.size()));
  for (const auto& [place, group, number] : entries) a(place, group) += number;
  return a;
}

const Equation& equation_of(const IdentifiedModel& model, const std::string& lhs) {
  for (const Equation& e : model.equations) {
    if (e.lhs == lhs) return e;
  }
  std::string found;
  for (const Equation& e : model.equations) found += " " + e.lhs;
  throw Error(fmt::format(
      "the model has no equation for {} (it has{}): choose the names of the derivation to match, [names]", lhs, found));
}

/// What the model states, as numbers with their places in the derived equations.
class Statements {
 public:
  Statements(const IdentifiedModel& model, const expr::CandidateLibrary& library, Places& places)
      : model_(model), places_(places) {
    for (std::size_t i = 0; i < library.lhs.size(); ++i) {
      const Equation& equation = equation_of(model, library.lhs[i]);
      for (const EquationTerm& term : equation.terms) add(i, equation.lhs, term);
      if (library.known.empty()) continue;
      for (const auto& [number, function] : monomials(library.known[i])) {
        const Eigen::Index place = places_.index(i, function, false);
        if (place < 0) continue;
        variables_.push_back({{number, 0, number, number}, Eigen::VectorXd::Zero(places_.size())});
        variables_.back().column[place] = -1;
      }
    }
    const auto count = static_cast<Eigen::Index>(variables_.size());
    columns.resize(places_.size(), count);
    value.resize(count);
    sd.resize(count);
    for (Eigen::Index v = 0; v < count; ++v) {
      columns.col(v) = at(v).column;
      value[v] = at(v).coefficient.value;
      sd[v] = at(v).coefficient.sd;
    }
    const std::size_t m = model.parameters.size();
    joint_ = m > 0 && model.parameter_covariance.size() == m * m &&
             std::all_of(variables_.begin(), variables_.end(),
                         [](const Variable& v) { return v.coefficient.sd == 0 || v.parameter >= 0; });
  }

  /// Of two sums of variables. NaN times zero is no uncertainty.
  double covariance(const Eigen::RowVectorXd& a, const Eigen::RowVectorXd& b) const {
    double sum = 0;
    for (Eigen::Index i = 0; i < a.size(); ++i) {
      for (Eigen::Index j = 0; j < b.size(); ++j) {
        const double factor = a[i] * b[j];
        if (std::abs(factor) <= 1e-12) continue;
        const Variable &v = at(i), &w = at(j);
        if (joint_ && v.parameter >= 0 && w.parameter >= 0) {
          const std::size_t place =
              static_cast<std::size_t>(v.parameter) * model_.parameters.size() + static_cast<std::size_t>(w.parameter);
          sum += factor * v.sign * w.sign * model_.parameter_covariance[place];
        } else if (i == j) {
          sum += factor * sd[i] * sd[i];
        }
      }
    }
    return sum;
  }

  /// Size of the terms at a place, for rounding.
  double size(Eigen::Index place) const { return (columns.row(place).cwiseAbs() * value.cwiseAbs()).value(); }
  bool joint() const { return joint_; }
  const std::string& extra() const { return extra_; }

  Eigen::MatrixXd columns;    ///< places x variables
  Eigen::VectorXd value, sd;  ///< of the variables

 private:
  const Variable& at(Eigen::Index v) const { return variables_[static_cast<std::size_t>(v)]; }

  void add(std::size_t i, const std::string& lhs, const EquationTerm& term) {
    Eigen::VectorXd column = Eigen::VectorXd::Zero(places_.size());
    bool inside = false;
    for (const auto& [number, function] : monomials(expr::Expr::parse(term.function))) {
      const Eigen::Index place = places_.index(i, function, false);
      if (place >= 0) column[place] += number;
      inside = inside || place >= 0;
    }
    if (!inside) {
      extra_ += (extra_.empty() ? "" : ", ") + term.function + " in " + lhs;
      return;
    }
    const double sign = term.coefficient.value < 0 ? -1 : 1;
    auto it = std::find_if(variables_.begin(), variables_.end(),
                           [&](const Variable& v) { return same(v.coefficient, term.coefficient); });
    if (it == variables_.end()) {
      it = variables_.insert(variables_.end(), {term.coefficient, Eigen::VectorXd::Zero(places_.size())});
      it->coefficient.value = std::abs(it->coefficient.value);
      if (term.coefficient.sd != 0) it->parameter = parameter_of(model_, lhs, term.function);
      it->sign = sign;
    }
    it->column += sign * column;
  }

  const IdentifiedModel& model_;
  Places& places_;
  std::vector<Variable> variables_;
  std::string extra_;  ///< terms that the derivation lacks
  bool joint_ = false;
};

UnknownEstimates from_equations(const IdentifiedModel& model, const expr::CandidateLibrary& library) {
  UnknownEstimates result;
  Places places;
  const Eigen::MatrixXd a = library_matrix(library, places);
  const Statements stated(model, library, places);
  if (!stated.extra().empty())
    result.notes.push_back("terms of the model that the derivation lacks: " + stated.extra());
  if (!stated.joint() && model.rotor_covariance.empty() && library.groups.size() > 1) {
    result.notes.push_back("the model states no covariances: unknowns count as independent");
  }

  // a unknowns = sum of variable * column; each place weighted by its own sd.
  Eigen::VectorXd weight(places.size());
  for (Eigen::Index p = 0; p < weight.size(); ++p) {
    const double variance = (stated.columns.row(p).transpose().array() * stated.sd.array()).square().sum();
    const double floor = 1e-9 * stated.size(p);
    weight[p] = 1 / std::max({variance > 0 ? std::sqrt(variance) : 0.0, floor, std::numeric_limits<double>::min()});
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(Eigen::MatrixXd(weight.asDiagonal() * a));
  const Eigen::MatrixXd map = qr.solve(Eigen::MatrixXd(weight.asDiagonal() * stated.columns));
  result.value = map * stated.value;
  const Eigen::VectorXd misfit = stated.columns * stated.value - a * result.value;
  const Eigen::MatrixXd spread = stated.columns - a * map;
  for (Eigen::Index p = 0; p < misfit.size(); ++p) {
    const double variance = stated.covariance(spread.row(p), spread.row(p));
    const double width = variance < 0 ? 0 : std::sqrt(variance);  // rounding
    if (std::abs(misfit[p]) > 1e-9 * stated.size(p) && !(std::abs(misfit[p]) <= 4 * width)) {
      throw Error(fmt::format(
          "the model does not keep the ties of the derivation: in {} the coefficient of {} is off by {:.3g}; the "
          "machine is less symmetric than the energies say: give it more parameters",
          library.lhs[places.equation(p)], places.function(p).str(), misfit[p]));
    }
  }
  result.covariance = Eigen::MatrixXd::Zero(map.rows(), map.rows());
  for (Eigen::Index g = 0; g < map.rows(); ++g) {
    for (Eigen::Index h = 0; h < map.rows(); ++h) result.covariance(g, h) = stated.covariance(map.row(g), map.row(h));
  }
  return result;
}

/// The library's group that is the given one of the hand-written rotor library; -1: none.
Eigen::Index find_group(const expr::CandidateLibrary& library, const expr::TiedGroup& wanted) {
  for (std::size_t g = 0; g < library.groups.size(); ++g) {
    const expr::CandidateLibrary pair{library.lhs, {}, {library.groups[g], wanted}, {}};
    bool equal = library.lhs == std::vector<std::string>{"X2'", "X4'"};
    if (!equal) break;
    for (const expr::Expr& rest : expr::right_hand_sides(pair, {expr::Expr(1), expr::Expr(-1)}))
      equal = equal && expr::expand(rest).is_number(0);
    if (equal) return static_cast<Eigen::Index>(g);
  }
  return -1;
}

}  // namespace

UnknownEstimates unknown_estimates(const IdentifiedModel& model, const expr::CandidateLibrary& library) {
  const auto n = static_cast<Eigen::Index>(library.groups.size());
  std::vector<std::size_t> by_name;
  for (const expr::TiedGroup& group : library.groups) {
    for (std::size_t p = 0; p < model.parameters.size(); ++p) {
      if (model.parameters[p].first == group.name) by_name.push_back(p);
    }
  }
  if (static_cast<Eigen::Index>(by_name.size()) == n) {
    UnknownEstimates result{Eigen::VectorXd(n), Eigen::MatrixXd::Zero(n, n), {}};
    const std::size_t m = model.parameters.size();
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::size_t pi = by_name[static_cast<std::size_t>(i)];
      const Estimate& e = model.parameters[pi].second;
      result.value[i] = e.value;
      result.covariance(i, i) = e.sd * e.sd;
      if (model.parameter_covariance.size() != m * m) continue;
      for (Eigen::Index j = 0; j < n; ++j) {
        result.covariance(i, j) = model.parameter_covariance[pi * m + by_name[static_cast<std::size_t>(j)]];
      }
    }
    if (n > 1 && model.parameter_covariance.empty())
      result.notes.push_back("the model states no covariances: unknowns count as independent");
    return result;
  }
  UnknownEstimates result = from_equations(model, library);
  if (model.rotor_covariance.size() == 25) {
    const expr::CandidateLibrary rotor = expr::tied_rotor_library(false);
    for (std::size_t i = 0; i < 5; ++i) {
      for (std::size_t j = 0; j < 5; ++j) {
        const Eigen::Index a = find_group(library, rotor.groups[i]), b = find_group(library, rotor.groups[j]);
        if (a >= 0 && b >= 0) result.covariance(a, b) = model.rotor_covariance[5 * i + j];
      }
    }
  }
  return result;
}

}  // namespace whirl::lagrange
