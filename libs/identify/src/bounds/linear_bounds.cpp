#include "bounds/linear_bounds.hpp"

#include <fmt/ranges.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>
#include <map>
#include <set>

#include "bounds/trapping.hpp"
#include "problem/sindy_prepare.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/identify/sindy_library.hpp"

namespace whirl::identification {
namespace {

using detail::BoundRow;

std::string trimmed(const std::string& s) {
  const auto first = s.find_first_not_of(" \t"), last = s.find_last_not_of(" \t");
  return first == std::string::npos ? "" : s.substr(first, last - first + 1);
}

/// Adds `sign` times the sum in `text` to the weights, its numbers to `number`.
void add_side(const std::string& text, double sign, LinearBound& bound, double& number) {
  const auto refuse = [&] {
    return Error::in_field("bound", bound.text,
                           "a sum of NUMBER*[NAME], <= or >=, and such a sum, e.g. \"[v': x] + 2*[v': v] <= -1\"");
  };
  std::size_t at = 0;
  bool any = false;
  while (at < text.size()) {
    if (text[at] == ' ') {
      ++at;
      continue;
    }
    double weight = sign;
    if (text[at] == '+' || text[at] == '-') {
      if (text[at] == '-') weight = -weight;
      ++at;
    } else if (any) {
      throw refuse();
    }
    std::string name;
    char last = 0;  // what stood before: '*', a number 'n' or a name 'x'
    while (at < text.size() && ((last != 'n' && last != 'x') || (text[at] != '+' && text[at] != '-'))) {
      const char c = text[at];
      const bool letter = std::isalpha(static_cast<unsigned char>(c)) || c == '_';
      if (c == ' ') {
        ++at;
      } else if (c == '*' && (last == 'n' || last == 'x')) {
        last = '*';
        ++at;
      } else if (((c >= '0' && c <= '9') || c == '.') && (last == 0 || last == '*')) {
        char* end = nullptr;
        weight *= std::strtod(text.c_str() + at, &end);
        at = static_cast<std::size_t>(end - text.c_str());
        last = 'n';
      } else if ((c == '[' || letter) && name.empty()) {
        std::size_t end = c == '[' ? text.find(']', at) : at;
        if (end == std::string::npos) throw refuse();
        while (letter && end < text.size() && (std::isalnum(static_cast<unsigned char>(text[end])) || text[end] == '_'))
          ++end;
        name = letter ? text.substr(at, end - at) : trimmed(text.substr(at + 1, end - at - 1));
        if (name.empty()) throw refuse();
        at = letter ? end : end + 1;
        last = 'x';
      } else {
        throw refuse();
      }
    }
    if (last == 0 || last == '*') throw refuse();
    any = true;
    if (!std::isfinite(weight)) throw refuse();
    if (name.empty()) {
      number += weight;
    } else {
      bound.weights.emplace_back(name, weight);
    }
  }
  if (!any) throw refuse();
}

/// The part linear about the origin as a sum of parameters: J = fixed + sum p_k slope_k.
struct LinearPart {
  Eigen::MatrixXd fixed;
  std::vector<Eigen::MatrixXd> slope;
};

LinearPart linear_part(const IdentifiedModel& model, const Eigen::MatrixXd& ties) {
  const auto n = static_cast<Eigen::Index>(model.states.size());
  LinearPart part{Eigen::MatrixXd::Zero(n, n),
                  std::vector<Eigen::MatrixXd>(static_cast<std::size_t>(ties.cols()), Eigen::MatrixXd::Zero(n, n))};
  std::map<std::string, double, std::less<>> origin;
  for (const std::string& s : model.states) origin[s] = 0;
  for (const std::string& s : model.inputs) origin[s] = 0;
  Eigen::Index estimated = 0;
  for (std::size_t e = 0; e < model.equations.size(); ++e) {
    for (const EquationTerm& t : model.equations[e].terms) {
      Eigen::RowVectorXd row(n);
      for (Eigen::Index j = 0; j < n; ++j) {
        row[j] = expr::evaluate(
            expr::differentiate(expr::Expr::parse(t.function), model.states[static_cast<std::size_t>(j)]), origin);
      }
      if (!row.allFinite())
        throw Error(fmt::format("{}: {} has no slope at the origin: the decay of the linear part is not defined",
                                model.equations[e].lhs, t.function));
      const auto at = static_cast<Eigen::Index>(e);
      if (t.coefficient.sd == 0) {
        part.fixed.row(at) += t.coefficient.value * row;
        continue;
      }
      for (Eigen::Index k = 0; k < ties.cols(); ++k)
        part.slope[static_cast<std::size_t>(k)].row(at) += ties(estimated, k) * row;
      ++estimated;
    }
  }
  return part;
}

/// Eigenvalues that decay too slowly, as rows: Re(lambda) to first order in the parameters.
std::vector<BoundRow> decay_rows(const LinearPart& part, const Eigen::VectorXd& p, double least_decay) {
  Eigen::MatrixXd j = part.fixed;
  for (std::size_t k = 0; k < part.slope.size(); ++k) j += p[static_cast<Eigen::Index>(k)] * part.slope[k];
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(j), transposed(Eigen::MatrixXd(j.transpose()));
  constexpr double kClose = 0.2;
  std::vector<BoundRow> rows, oscillating;
  for (Eigen::Index i = 0; i < j.rows(); ++i) {
    const std::complex<double> value = solver.eigenvalues()[i];
    if (value.imag() < 0) continue;  // of a pair one
    const Eigen::VectorXcd right = solver.eigenvectors().col(i);
    Eigen::Index same = 0;
    (transposed.eigenvalues().array() - value).abs().minCoeff(&same);
    const Eigen::VectorXcd left = transposed.eigenvectors().col(same);
    const std::complex<double> norm = left.transpose() * right;
    if (std::abs(norm) < 1e-12) continue;  // coalescing: no first order
    BoundRow row{Eigen::VectorXd(p.size()), 0, ""};
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const std::complex<double> moved = left.transpose() * part.slope[static_cast<std::size_t>(k)] * right;
      row.a[k] = (moved / norm).real();
    }
    row.b = value.real();
    row.text = fmt::format("decay of the linear part >= {:g} 1/s", least_decay);
    if (value.imag() > 0)
      oscillating.push_back(std::move(row));
    else
      rows.push_back(std::move(row));
  }
  // Real ones that come close part steeply in either direction; their mean does not.
  std::sort(rows.begin(), rows.end(), [](const BoundRow& a, const BoundRow& b) { return a.b > b.b; });
  for (std::size_t i = 0; i + 1 < rows.size(); ++i) {
    if (rows[i].b - rows[i + 1].b > kClose * std::max(std::abs(rows[i].b), std::abs(rows[i + 1].b))) continue;
    rows[i].a = 0.5 * (rows[i].a + rows[i + 1].a);
    rows[i].b = 0.5 * (rows[i].b + rows[i + 1].b);
    rows.erase(rows.begin() + static_cast<std::ptrdiff_t>(i) + 1);
  }
  rows.insert(rows.end(), oscillating.begin(), oscillating.end());
  for (BoundRow& row : rows) row.b = row.a.dot(p) - row.b - least_decay;
  return rows;
}

double slowest(const LinearPart& part, const Eigen::VectorXd& p) {
  Eigen::MatrixXd j = part.fixed;
  for (std::size_t k = 0; k < part.slope.size(); ++k) j += p[static_cast<Eigen::Index>(k)] * part.slope[k];
  return -Eigen::EigenSolver<Eigen::MatrixXd>(j, false).eigenvalues().real().maxCoeff();
}

/// "v': x^2*v" as it is written in models; the name itself when it is none of an equation and a term.
std::string canonical(const std::string& name) {
  const auto colon = name.find(':');
  if (colon == std::string::npos) return name;
  try {
    return trimmed(name.substr(0, colon)) + ": " + expr::Expr::parse(name.substr(colon + 1)).str();
  } catch (const Error&) {
    return name;
  }
}

std::vector<BoundRow> linear_rows(const IdentifyOptions& options, const std::set<std::string>& names,
                                  const IdentifiedModel& model) {
  std::vector<BoundRow> rows;
  for (const LinearBound& bound : options.bounds.linear) {
    BoundRow row{Eigen::VectorXd::Zero(static_cast<Eigen::Index>(model.parameters.size())), bound.limit, bound.text};
    for (const auto& [given, weight] : bound.weights) {
      const std::string name = names.contains(given) ? given : canonical(given);
      if (!names.contains(name))
        throw Error::in_field("bound", fmt::format("{} in {}", name, bound.text),
                              fmt::format("one of {}", fmt::join(names, ", ")));
      for (std::size_t k = 0; k < model.parameters.size(); ++k) {
        if (model.parameters[k].first == name) row.a[static_cast<Eigen::Index>(k)] += weight;
      }
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace

LinearBound linear_bound(const std::string& text) {
  LinearBound bound;
  bound.text = trimmed(text);
  const std::size_t at = std::min(text.find("<="), text.find(">="));
  if (at == std::string::npos)
    throw Error::in_field("bound", text, "an inequality with <= or >=, e.g. \"[v': x] + 2*[v': v] <= -1\"");
  const double sign = text[at] == '<' ? 1 : -1;
  double number = 0;
  add_side(text.substr(0, at), sign, bound, number);
  add_side(text.substr(at + 2), -sign, bound, number);
  if (bound.weights.empty()) throw Error::in_field("bound", text, "with at least one coefficient, e.g. [v': x]");
  bound.limit = -number;
  return bound;
}

void detail::check_bounds(const IdentifyOptions& o) {
  if (!o.bounds.any()) return;
  if (o.method != Method::sindy || o.sindy.discrete || !o.sindy.refine || o.sindy.hidden > 0 ||
      !o.sindy.equations.denominators.empty()) {
    throw Error(
        "bounds between coefficients, the decay of the linear part and trapping need differential equations refined on "
        "free "
        "runs (--method sindy), without hidden states or denominators");
  }
  if (!o.sindy.equations.signs.empty())
    throw Error(
        "sign bounds and bounds between coefficients exclude each other: write a sign as a bound, [v': x] <= 0");
  check_trapping(o);
}

std::optional<Trapping> detail::hold_bounds(const IdentifyOptions& options, const Recording& like,
                                            IdentifiedModel& model) {
  constexpr int kSteps = 60;
  if (!options.bounds.any() || model.summary.status == Status::unusable) return {};
  const auto [names, ties] = unknowns_of(options, like, model);
  const auto n = static_cast<Eigen::Index>(model.parameters.size());
  std::vector<BoundRow> rows = linear_rows(options, names, model);
  if (static_cast<Eigen::Index>(model.parameter_covariance.size()) != n * n || n == 0)
    throw Error("bounds between coefficients need the refinement on free runs, which did not end");
  if (options.bounds.trapping) return hold_trapping({names, ties}, rows, like, model);
  const Eigen::MatrixXd covariance = Eigen::Map<const Eigen::MatrixXd>(model.parameter_covariance.data(), n, n);
  Eigen::VectorXd p0(n);
  for (Eigen::Index k = 0; k < n; ++k) p0[k] = model.parameters[static_cast<std::size_t>(k)].second.value;
  Eigen::VectorXd p = p0, multipliers;
  const std::size_t linear = rows.size();
  const auto solve = [&] {
    if (!nearest(p0, covariance, rows, p, multipliers))
      throw Error(fmt::format("the bounds cannot be kept together by these terms: {}",
                              rows.size() > linear ? rows.back().text : rows.front().text));
  };
  if (!rows.empty()) solve();
  if (std::isfinite(options.bounds.least_decay)) {
    const LinearPart part = linear_part(model, ties);
    const double scale = std::max(std::abs(slowest(part, p0)), std::abs(options.bounds.least_decay)),
                 enough = 1e-9 * std::max(scale, 1e-12);
    int step = 0;
    for (; slowest(part, p) < options.bounds.least_decay - enough; ++step) {
      if (step == kSteps)
        throw Error(fmt::format("no coefficients of these terms near the records let the linear part decay at {:g} 1/s",
                                options.bounds.least_decay));
      rows.resize(linear);
      // A tenth of the tolerance inside, so that the last step ends within it.
      for (BoundRow& r : decay_rows(part, p, options.bounds.least_decay + 0.1 * enough)) rows.push_back(std::move(r));
      solve();
    }
  }
  Eigen::MatrixXd free = covariance;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!(multipliers[static_cast<Eigen::Index>(i)] > 1e-9)) continue;
    const BoundRow& row = rows[i];
    const Eigen::VectorXd c = free * row.a;
    const double variance = row.a.dot(c), asked = row.a.dot(p0) - row.b;
    model.summary.warn(
        fmt::format("the bound {} is active: the records require {:.3g} more, {:.2g} standard deviations; intervals "
                    "are those along the bound",
                    row.text, asked, asked / std::sqrt(row.a.dot(covariance * row.a))));
    if (variance > 1e-12 * row.a.dot(covariance * row.a)) free -= c * c.transpose() / variance;
  }
  if (p != p0) write(p, free, ties, model);
  return {};
}

}  // namespace whirl::identification
