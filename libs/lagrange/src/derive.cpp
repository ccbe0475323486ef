#include "whirl/lagrange/derive.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

#include "algebra.hpp"
#include "symmetry.hpp"
#include "ties.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/names.hpp"

namespace whirl::lagrange {
namespace {

using namespace algebra;
using Kind = Names::Kind;

/// A motion with its two rates.
struct Motion {
  symbol q, rate, acceleration;
};

Motion declare_motion(Names& names, const std::string& name) {
  return {names.declare(name, Kind::state), names.declare(name + "'", Kind::state),
          names.declare(name + "''", Kind::state)};
}

/// pivot = parameters * states, inverted; false when it is no such product.
bool invert(const ex& pivot, const Names& names, ex& inverse) {
  std::vector<Split> parts;
  for (const ex& summand : summands(pivot)) parts.push_back(split(summand, names));
  if (parts.empty()) return false;
  ex parameters = 0, states = 0;
  bool same_states = true, same_parameters = true;
  for (const Split& part : parts) {
    parameters += part.parameters;
    states += part.states;
    same_states = same_states && part.states.is_equal(parts[0].states);
    same_parameters = same_parameters && part.parameters.is_equal(parts[0].parameters);
  }
  if (!same_states && !same_parameters) return false;
  inverse = 1 / (same_states ? parameters * parts[0].states : states * parts[0].parameters);
  return true;
}

/// Solves M a = h by elimination with diagonal pivots that hold no states, or a factor of states; empty when there are
/// none.
std::vector<ex> solved(GiNaC::matrix mass, std::vector<ex> h, const Names& names) {
  const unsigned n = mass.rows();
  std::vector<bool> done(n, false);
  for (unsigned step = 0; step < n; ++step) {
    unsigned pivot = n;
    ex inverse, candidate;
    for (unsigned i = 0; i < n; ++i) {
      if (done[i] || !invert(mass(i, i), names, candidate)) continue;
      const bool constant = !names.uses(candidate, Kind::state);
      if (pivot < n && !constant) continue;
      pivot = i;
      inverse = candidate;
      if (constant) break;
    }
    if (pivot == n) return {};
    done[pivot] = true;
    for (unsigned r = 0; r < n; ++r) {
      if (r == pivot || mass(r, pivot).is_zero()) continue;
      const ex factor = mass(r, pivot) * inverse;
      for (unsigned j = 0; j < n; ++j) mass(r, j) = reduced(mass(r, j) - factor * mass(pivot, j), names);
      h[r] = reduced(h[r] - factor * h[pivot], names);
    }
  }
  for (unsigned i = 0; i < n; ++i) {
    ex inverse;
    if (!invert(mass(i, i), names, inverse)) return {};
    h[i] = reduced(h[i] * inverse, names);
  }
  return h;
}

/// Every row solved for its own acceleration; the others stay on the right.
std::vector<ex> own_accelerations(const GiNaC::matrix& mass, std::vector<ex> h, const std::vector<Motion>& motions,
                                  const LagrangeProblem& problem, const Names& names) {
  for (unsigned i = 0; i < mass.rows(); ++i) {
    ex inverse;
    if (!invert(mass(i, i), names, inverse)) {
      throw Error(fmt::format(
          "the inertia of '{}', {}, is not a product of parameters and states: the equations are not linear "
          "in unknowns; give parameters a value",
          problem.coordinates[i], names.to(mass(i, i)).str()));
    }
    for (unsigned j = 0; j < mass.cols(); ++j) {
      if (j != i) h[i] -= mass(i, j) * motions[j].acceleration;
    }
    h[i] = reduced(h[i] * inverse, names);
  }
  return h;
}

ex truncated(const ex& e, const symbol& small, int order) {
  return GiNaC::series_to_poly(e.series(small == 0, order + 1)).expand();
}

void check(const LagrangeProblem& problem) {
  if (problem.coordinates.empty()) throw Error("coordinates: at least one is needed");
  if (problem.kinetic.empty()) throw Error("kinetic: the kinetic energy is missing");
  for (const auto& [name, unused] : problem.forces) {
    if (std::find(problem.coordinates.begin(), problem.coordinates.end(), name) == problem.coordinates.end()) {
      throw Error(fmt::format("forces: '{}' is not a coordinate", name));
    }
  }
  if (const auto wrong = name_problem(problem))
    throw Error(fmt::format("names.{} = {}: {}", wrong->variable, one_line(library_name(problem, wrong->variable)),
                            wrong->reason));
}

struct Energies {
  ex kinetic, potential, rayleigh;
};

/// d/dt(dT/dq') - dT/dq + dV/dq + dR/dq' = Q, solved for mass matrix times accelerations = h.
std::pair<GiNaC::matrix, std::vector<ex>> balance(const Energies& of, const std::vector<Motion>& motions,
                                                  const std::vector<Motion>& signals, const ex& time,
                                                  const std::function<ex(std::size_t)>& force_of, Names& names) {
  const std::size_t n = motions.size();
  GiNaC::matrix mass(static_cast<unsigned>(n), static_cast<unsigned>(n));
  std::vector<ex> h;
  for (std::size_t i = 0; i < n; ++i) {
    const ex momentum = of.kinetic.diff(motions[i].rate);
    ex force = of.kinetic.diff(motions[i].q) - of.potential.diff(motions[i].q) - of.rayleigh.diff(motions[i].rate) -
               momentum.diff(GiNaC::ex_to<symbol>(time)) + force_of(i);
    for (std::size_t j = 0; j < n; ++j) {
      mass(static_cast<unsigned>(i), static_cast<unsigned>(j)) = reduced(momentum.diff(motions[j].rate), names);
      force -= momentum.diff(motions[j].q) * motions[j].rate;
    }
    for (const Motion& signal : signals) {
      force -= momentum.diff(signal.q) * signal.rate + momentum.diff(signal.rate) * signal.acceleration;
    }
    h.push_back(reduced(force, names));
  }
  return {mass, h};
}

}  // namespace

LagrangeEquations derive(const LagrangeProblem& problem) {
  check(problem);
  Names names;
  std::vector<Motion> motions, signals;
  for (const std::string& name : problem.coordinates) motions.push_back(declare_motion(names, name));
  for (const PrescribedSignal& signal : problem.prescribed) signals.push_back(declare_motion(names, signal.name));
  for (const std::string& name : problem.inputs) names.declare(name, Kind::state);
  GiNaC::exmap exact;
  for (const PhysicalParameter& p : problem.parameters) {
    const symbol s = names.declare(p.name, Kind::parameter);
    if (p.exact()) exact[s] = names.from(expr::Expr(p.value.value));
  }
  if (!names.has("t")) names.declare("t", Kind::state);
  const ex time = names.at("t");

  const auto read = [&](const std::string& text, const char* what) {
    ex e = with_values_inside_functions(names.read(text, what), exact, names);
    for (const std::string& variable : problem.positive) e = without_signs(e, names.at(variable));
    return e;
  };
  LagrangeEquations result;
  result.coordinates = problem.coordinates;
  const ex kinetic = read(problem.kinetic, "kinetic energy");
  ex potential = read(problem.potential, "potential energy"), rayleigh = read(problem.rayleigh, "Rayleigh function");
  const GiNaC::exmap tied = symmetry_ties({potential, rayleigh}, problem, names, result.notes);
  potential = potential.subs(tied);
  rayleigh = rayleigh.subs(tied);

  const auto force_of = [&](std::size_t i) {
    const auto it = problem.forces.find(problem.coordinates[i]);
    return it == problem.forces.end() ? ex(0) : read(it->second, "force");
  };
  const auto [mass, h] = balance({kinetic, potential, rayleigh}, motions, signals, time, force_of, names);
  const std::size_t n = motions.size();
  for (unsigned i = 0; i < n; ++i) {
    result.mass.emplace_back();
    for (unsigned j = 0; j < n; ++j) result.mass[i].push_back(names.to(mass(i, j)));
    result.rhs.push_back(names.to(h[i]));
  }
  const ex determinant = reduced(mass.determinant(), names);
  if (determinant.is_zero())
    throw Error("the mass matrix is singular: some coordinate has no kinetic energy of its own");
  result.determinant = names.to(GiNaC::factor(determinant));

  std::vector<ex> accelerations = solved(mass, h, names);
  if (accelerations.empty()) {
    result.implicit = true;
    accelerations = own_accelerations(mass, h, motions, problem, names);
  }
  GiNaC::exmap laws;
  std::vector<std::string> moving = problem.coordinates;
  for (std::size_t k = 0; k < signals.size(); ++k) {
    if (problem.prescribed[k].acceleration.empty()) continue;
    const ex law = read(problem.prescribed[k].acceleration, "acceleration law");
    laws[signals[k].acceleration] = law;
    accelerations.push_back(law);
    moving.push_back(problem.prescribed[k].name);
  }
  for (ex& a : accelerations) {
    a = reduced(a.subs(laws), names);
    for (const auto& [name, order] : problem.order) {
      if (order < 0 || order > 6) throw Error(fmt::format("order of '{}' is {}: must be 0 to 6", name, order));
      a = reduced(truncated(a, GiNaC::ex_to<symbol>(names.at(name)), order), names);
    }
    result.accelerations.push_back(names.to(a));
  }
  for (const auto& [name, order] : problem.order)
    result.notes.push_back(fmt::format("powers of {} above {} left out", name, order));
  for (const std::string& name : moving) result.lhs.push_back(name + "''");
  result.library = tied_library(accelerations, moving, problem, exact, names, result.notes);
  return result;
}

}  // namespace whirl::lagrange
