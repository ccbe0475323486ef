#include "ties.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "rational_rows.hpp"
#include "whirl/core/error.hpp"

namespace whirl::lagrange::algebra {
namespace {

/// A function of the states in one equation.
struct Place {
  std::size_t equation;
  expr::Expr function;
};

/// A monomial in the parameters with the numbers by which it multiplies the places.
struct Unknown {
  expr::Expr coefficient;
  std::vector<GiNaC::numeric> factors;
};

struct Table {
  std::vector<Place> places;
  std::vector<Unknown> unknowns;
  std::vector<expr::Expr> known;

  void add(std::size_t place, const expr::Expr& monomial, const GiNaC::numeric& factor) {
    auto it =
        std::find_if(unknowns.begin(), unknowns.end(), [&](const Unknown& u) { return u.coefficient == monomial; });
    if (it == unknowns.end()) it = unknowns.insert(unknowns.end(), {monomial, {}});
    it->factors.resize(std::max(it->factors.size(), place + 1));
    it->factors[place] += factor;
  }
};

/// Monomials of a coefficient over one denominator that is a product, e.g. 1/m + e^2/J_bar.
std::vector<ex> monomials(const ex& coefficient) {
  const ex fraction = coefficient.normal().numer_denom();
  const ex denominator = GiNaC::factor(fraction.op(1));
  std::vector<ex> result;
  for (const ex& summand : summands(fraction.op(0).expand())) result.push_back(summand / denominator);
  return result;
}

std::pair<GiNaC::numeric, ex> split_number(const ex& monomial) {
  GiNaC::numeric number = 1;
  ex rest = 1;
  for (std::size_t i = 0; i < (GiNaC::is_a<GiNaC::mul>(monomial) ? monomial.nops() : 1); ++i) {
    const ex factor = GiNaC::is_a<GiNaC::mul>(monomial) ? monomial.op(i) : monomial;
    if (GiNaC::is_a<GiNaC::numeric>(factor)) {
      number = number * GiNaC::ex_to<GiNaC::numeric>(factor);
    } else {
      rest *= factor;
    }
  }
  return {number, rest};
}

/// Order of declaration: x, x', y, ... and m, K1, ...; the computer algebra's own order changes from run to run.
class Order {
 public:
  explicit Order(const LagrangeProblem& problem) {
    for (const std::string& name : problem.coordinates) add_motion(name);
    for (const PrescribedSignal& signal : problem.prescribed) add_motion(signal.name);
    for (const std::string& name : problem.inputs) rank_.emplace(name, rank_.size());
    for (const PhysicalParameter& p : problem.parameters) rank_.emplace(p.name, rank_.size());
  }
  template <class Pair>
  void sort(std::vector<Pair>& by_first) const {
    std::sort(by_first.begin(), by_first.end(), [this](const Pair& a, const Pair& b) {
      const std::vector<std::size_t> ra = ranks(a.first), rb = ranks(b.first);
      return ra != rb ? ra < rb : compare(a.first, b.first) < 0;
    });
  }

 private:
  void add_motion(const std::string& name) {
    for (const char* primes : {"", "'", "''"}) rank_.emplace(name + primes, rank_.size());
  }
  std::vector<std::size_t> ranks(const expr::Expr& e) const {
    std::vector<std::size_t> result;
    for (const std::string& name : expr::variables(e)) {
      const auto it = rank_.find(name);
      result.push_back(it == rank_.end() ? rank_.size() : it->second);
    }
    std::sort(result.begin(), result.end());
    return result;
  }
  std::map<std::string, std::size_t, std::less<>> rank_;
};

Table tabulate(const std::vector<ex>& accelerations, const GiNaC::exmap& exact, const LagrangeProblem& problem,
               const Names& names) {
  const Order order(problem);
  Table table;
  table.known.resize(accelerations.size());
  for (std::size_t i = 0; i < accelerations.size(); ++i) {
    GiNaC::exmap by_states;
    for (const ex& summand : summands(accelerations[i])) {
      const Split part = split(summand, names);
      by_states[part.states] += part.parameters;
    }
    std::vector<std::pair<expr::Expr, ex>> sorted;
    for (const auto& [states, parameters] : by_states) sorted.emplace_back(names.to(states), parameters);
    order.sort(sorted);
    for (const auto& [function, coefficient] : sorted) {
      std::vector<std::pair<expr::Expr, GiNaC::numeric>> unknown;
      for (const ex& monomial : monomials(reduced(coefficient, names))) {
        const ex value = monomial.subs(exact);
        if (!names.uses(value, Names::Kind::parameter)) {
          table.known[i] = table.known[i] + names.to(value.evalf()) * function;
          continue;
        }
        const auto [number, rest] = split_number(monomial);
        unknown.emplace_back(names.to(rest), number);
      }
      if (unknown.empty()) continue;
      order.sort(unknown);
      table.places.push_back({i, function});
      for (const auto& [monomial, number] : unknown) table.add(table.places.size() - 1, monomial, number);
    }
  }
  for (Unknown& u : table.unknowns) u.factors.resize(table.places.size());
  return table;
}

}  // namespace

expr::CandidateLibrary tied_library(const std::vector<ex>& accelerations, const std::vector<std::string>& moving,
                                    const LagrangeProblem& problem, const GiNaC::exmap& exact, const Names& names,
                                    std::vector<std::string>& notes) {
  std::map<std::string, expr::Expr, std::less<>> renamed;
  const auto rename = [&](const std::string& name) { return library_name(problem, name); };
  for (const auto& [name, unused] : problem.names) {
    if (!names.has(name) || !names.uses(names.at(name), Names::Kind::state))
      throw Error(fmt::format("names: '{}' is no variable", name));
  }
  const auto add_names = [&](const std::string& name) {
    for (const char* primes : {"", "'", "''"}) renamed[name + primes] = expr::Expr::symbol(rename(name + primes));
  };
  for (const std::string& name : problem.coordinates) add_names(name);
  for (const PrescribedSignal& signal : problem.prescribed) add_names(signal.name);
  for (const std::string& name : problem.inputs) renamed[name] = expr::Expr::symbol(rename(name));

  Table table = tabulate(accelerations, exact, problem, names);
  // Rows: places; columns: unknowns. A column without pivot is a combination of pivot columns before it: its unknown is
  // never seen apart from theirs.
  std::vector<Row> rows;
  for (std::size_t p = 0; p < table.places.size(); ++p) {
    Row row;
    for (const Unknown& u : table.unknowns) row.push_back(u.factors[p]);
    rows.push_back(std::move(row));
  }
  const std::vector<std::size_t> pivots = echelon(rows);
  expr::UnitMap units;
  for (const PhysicalParameter& p : problem.parameters) {
    if (!p.unit.empty()) units[p.name] = expr::Unit::parse(p.unit);
  }
  std::vector<expr::TiedGroup> groups;
  for (std::size_t g = 0; g < pivots.size(); ++g) {
    const Unknown& u = table.unknowns[pivots[g]];
    expr::Expr coefficient = u.coefficient;
    for (std::size_t c = pivots[g] + 1; c < rows[g].size(); ++c) {
      if (!rows[g][c].is_zero()) coefficient = coefficient + names.to(rows[g][c]) * table.unknowns[c].coefficient;
    }
    std::vector<expr::Expr> terms(accelerations.size());
    for (std::size_t p = 0; p < table.places.size(); ++p) {
      const Place& place = table.places[p];
      terms[place.equation] =
          terms[place.equation] + names.to(u.factors[p]) * expr::substitute(place.function, renamed);
    }
    const std::optional<expr::Unit> unit = expr::unit_of(coefficient, units);
    groups.push_back(expr::tied_group(coefficient.str(), terms, coefficient.str(), unit ? unit->str() : ""));
  }
  if (pivots.size() < table.unknowns.size()) {
    notes.push_back(fmt::format("{} products of parameters form {} independent combinations", table.unknowns.size(),
                                pivots.size()));
  }
  std::vector<expr::Expr> known;
  for (const expr::Expr& e : table.known) known.push_back(expr::substitute(e, renamed));
  if (std::all_of(known.begin(), known.end(), [](const expr::Expr& e) { return e.is_number(0); })) known.clear();
  std::vector<std::string> lhs;
  for (const std::string& name : moving) lhs.push_back(rename(name + "'") + "'");
  return expr::make_library(std::move(lhs), std::move(groups), std::move(known));
}

}  // namespace whirl::lagrange::algebra
