#include "whirl/lagrange/derive.hpp"

#include <fmt/format.h>
#include <ginac/ginac.h>

#include <algorithm>
#include <sstream>

#include "whirl/core/error.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl {
namespace {

using GiNaC::ex;
using GiNaC::symbol;

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

// The two languages differ in the sign function only. The text is parsed by `expr` first: its messages name the place, and
// its limits protect the computer algebra from hostile input.
ex to_ginac(const std::string& text, const GiNaC::symtab& names, const char* what) {
  if (text.empty()) return 0;
  try {
    (void)Expr::parse(text);
    GiNaC::parser reader(names, true);
    return reader(replaced(text, "sgn(", "csgn("));
  } catch (const Error& e) {
    throw Error(fmt::format("{} '{}': {}", what, text, e.what()));
  } catch (const std::exception& e) {
    throw Error(fmt::format("{} '{}': {}", what, text, e.what()));
  }
}

std::string to_text(const ex& e) {
  std::ostringstream out;
  out << e;
  return replaced(out.str(), "csgn(", "sgn(");
}

// sin^2 -> 1 - cos^2 of the coordinates, so that equal expressions become equal sums.
ex reduced(const ex& e, const std::vector<symbol>& coordinates) {
  ex result = e.expand();
  for (const symbol& q : coordinates) {
    for (int power = 6; power >= 2; --power) {
      const ex square = 1 - GiNaC::pow(GiNaC::cos(q), 2);
      result = result.subs(GiNaC::pow(GiNaC::sin(q), power) ==
                           GiNaC::pow(square, power / 2) * GiNaC::pow(GiNaC::sin(q), power % 2));
      result = result.expand();
    }
  }
  return result;
}

}  // namespace

LagrangeEquations derive(const LagrangeProblem& problem) {
  const std::size_t n = problem.coordinates.size();
  if (n == 0) throw Error("coordinates: at least one is needed");
  if (!problem.forces.empty() && problem.forces.size() != n) {
    throw Error(fmt::format("forces: {} given for {} coordinates: must be one each or none", problem.forces.size(), n));
  }
  GiNaC::symtab names;
  std::vector<symbol> q, dq;
  const auto declare = [&](const std::string& name) {
    if (names.count(name) != 0) throw Error("name '" + name + "' is declared twice");
    symbol s(name);
    names[name] = s;
    return s;
  };
  for (const std::string& name : problem.coordinates) {
    q.push_back(declare(name));
    dq.push_back(declare("d" + name));
  }
  for (const std::string& name : problem.parameters) declare(name);

  const ex kinetic = to_ginac(problem.kinetic, names, "kinetic energy");
  const ex potential = to_ginac(problem.potential, names, "potential energy");
  const ex rayleigh = to_ginac(problem.rayleigh, names, "Rayleigh function");

  LagrangeEquations result;
  GiNaC::matrix mass(static_cast<unsigned>(n), static_cast<unsigned>(n));
  for (std::size_t i = 0; i < n; ++i) {
    const ex momentum = kinetic.diff(dq[i]);
    ex h = kinetic.diff(q[i]) - potential.diff(q[i]) - rayleigh.diff(dq[i]);
    if (!problem.forces.empty()) h += to_ginac(problem.forces[i], names, "force");
    std::vector<std::string> row;
    for (std::size_t j = 0; j < n; ++j) {
      const ex entry = reduced(momentum.diff(dq[j]), q);
      mass(static_cast<unsigned>(i), static_cast<unsigned>(j)) = entry;
      row.push_back(to_text(entry));
      h -= momentum.diff(q[j]) * dq[j];
    }
    h = reduced(h, q);
    result.mass.push_back(std::move(row));
    result.rhs.push_back(to_text(h));
    std::vector<std::string> summands;
    if (GiNaC::is_a<GiNaC::add>(h)) {
      for (std::size_t k = 0; k < h.nops(); ++k) summands.push_back(to_text(h.op(k)));
    } else if (!h.is_zero()) {
      summands.push_back(to_text(h));
    }
    // GiNaC orders summands by addresses of its symbols: sorted, the text is the same in every run.
    std::sort(summands.begin(), summands.end());
    result.terms.push_back(std::move(summands));
  }
  result.determinant = to_text(reduced(mass.determinant(), q));
  return result;
}

}  // namespace whirl
