#include "whirl/core/names.hpp"

#include <fmt/format.h>

#include <map>

#include "ties.hpp"
#include "whirl/core/error.hpp"

namespace whirl::lagrange {
namespace {

bool is_symbol(const std::string& name) {
  try {
    return is_identifier(name) && expr::Expr::parse(name).kind() == expr::Expr::Kind::symbol;
  } catch (const Error&) {  // a function
    return false;
  }
}

}  // namespace

std::string library_name(const LagrangeProblem& problem, const std::string& name) {
  std::string stem = name;
  for (auto it = problem.names.find(stem); !stem.empty(); it = problem.names.find(stem)) {
    if (it != problem.names.end()) return it->second + name.substr(stem.size());
    if (stem.back() != '\'') break;
    stem.pop_back();
  }
  return name;
}

std::optional<NameProblem> name_problem(const LagrangeProblem& problem) {
  for (const auto& [variable, name] : problem.names) {
    if (!is_symbol(name)) return NameProblem{variable, std::string(kIdentifierRule)};
  }
  std::vector<std::string> variables = problem.inputs;
  const auto add = [&](const std::string& name) {
    for (const char* primes : {"", "'", "''"}) variables.push_back(name + primes);
  };
  for (const std::string& name : problem.coordinates) add(name);
  for (const PrescribedSignal& signal : problem.prescribed) add(signal.name);
  if (std::find(variables.begin(), variables.end(), "t") == variables.end()) variables.emplace_back("t");
  std::map<std::string, std::string> taken;
  for (const std::string& variable : variables) {
    const std::string name = library_name(problem, variable);
    if (const auto [at, fresh] = taken.emplace(name, variable); !fresh) {
      const bool mine = problem.names.contains(variable);
      return NameProblem{mine ? variable : at->second,
                         fmt::format("'{}' is the name of {} too: each variable needs a name of its own", name,
                                     mine ? at->second : variable)};
    }
  }
  return std::nullopt;
}

}  // namespace whirl::lagrange
