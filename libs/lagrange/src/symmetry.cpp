#include "symmetry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "rational_rows.hpp"
#include "whirl/core/error.hpp"

namespace whirl::lagrange::algebra {
namespace {

struct Symmetry {
  std::string kind;
  std::vector<std::string> coordinates;
};

Symmetry parse_symmetry(const std::string& text, const LagrangeProblem& problem) {
  std::istringstream in(text);
  Symmetry s;
  in >> s.kind;
  for (std::string name; in >> name;) {
    if (std::find(problem.coordinates.begin(), problem.coordinates.end(), name) == problem.coordinates.end()) {
      throw Error(fmt::format("symmetry '{}': '{}' is not a coordinate", text, name));
    }
    s.coordinates.push_back(name);
  }
  const std::size_t n = s.coordinates.size();
  const bool fits = s.kind == "mirror" ? n > 0 : (s.kind == "rotation" || s.kind == "exchange") && n > 0 && n % 2 == 0;
  if (!fits)
    throw Error(fmt::format(
        "symmetry '{}': must be 'rotation x y [u v ...]', 'exchange x y [u v ...]' or 'mirror x [y ...]'", text));
  return s;
}

/// Change of f under the symmetry: zero for every state where f has it.
ex change(const ex& f, const Symmetry& s, const Names& names) {
  ex generator = 0;
  GiNaC::exmap image;
  for (const char* prime : {"", "'"}) {
    const auto at = [&](std::size_t i) { return GiNaC::ex_to<symbol>(names.at(s.coordinates[i] + prime)); };
    for (std::size_t i = 0; i < s.coordinates.size(); i += s.kind == "mirror" ? 1 : 2) {
      if (s.kind == "mirror") {
        image[at(i)] = -at(i);
      } else if (s.kind == "exchange") {
        image[at(i)] = at(i + 1);
        image[at(i + 1)] = at(i);
      } else {
        generator += at(i) * f.diff(at(i + 1)) - at(i + 1) * f.diff(at(i));
      }
    }
  }
  return reduced(s.kind == "rotation" ? generator : f.subs(image) - f, names);
}

}  // namespace

GiNaC::exmap symmetry_ties(const std::vector<ex>& functions, const LagrangeProblem& problem, const Names& names,
                           std::vector<std::string>& notes) {
  GiNaC::exmap ties;
  if (problem.symmetries.empty()) return ties;
  // Columns: parameters from the last declared to the first, so that pivots fall on later ones.
  std::vector<symbol> parameters;
  for (auto p = problem.parameters.rbegin(); p != problem.parameters.rend(); ++p) {
    parameters.push_back(GiNaC::ex_to<symbol>(names.at(p->name)));
  }
  std::vector<Row> rows;
  for (const std::string& text : problem.symmetries) {
    const Symmetry symmetry = parse_symmetry(text, problem);
    for (const ex& f : functions) {
      GiNaC::exmap conditions;  // function of the states -> its coefficient, which must vanish
      for (const ex& summand : summands(change(f, symmetry, names))) {
        const Split part = split(summand, names);
        conditions[part.states] += part.parameters;
      }
      for (const auto& [states, condition] : conditions) {
        Row row;
        ex rest = condition.expand();
        for (const symbol& p : parameters) {
          const ex factor = rest.coeff(p, 1);
          if (!GiNaC::is_a<GiNaC::numeric>(factor)) break;
          row.push_back(GiNaC::ex_to<GiNaC::numeric>(factor));
          rest = (rest - factor * p).expand();
        }
        if (row.size() != parameters.size() || !rest.is_zero()) {
          throw Error(fmt::format("symmetry '{}' requires {} = 0, which is not linear in parameters", text,
                                  names.to(condition).str()));
        }
        rows.push_back(std::move(row));
      }
    }
  }
  const std::vector<std::size_t> pivots = echelon(rows);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    ex value = 0;
    for (std::size_t c = pivots[r] + 1; c < parameters.size(); ++c) value -= rows[r][c] * parameters[c];
    ties[parameters[pivots[r]]] = value;
    notes.push_back(fmt::format("{} = {} by symmetry", parameters[pivots[r]].get_name(), names.to(value).str()));
  }
  return ties;
}

}  // namespace whirl::lagrange::algebra
