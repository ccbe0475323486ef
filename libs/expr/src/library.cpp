#include "whirl/expr/library.hpp"

#include <fmt/format.h>

#include <set>
#include <unordered_set>

#include "node.hpp"
#include "whirl/core/error.hpp"

namespace whirl::expr {

std::vector<Expr> polynomial_library(const std::vector<std::string>& variables, int high, int low) {
  if (low < 0 || high < low || high > 20)
    throw Error(fmt::format("polynomial library of degrees {} to {}: must be 0 <= low <= high <= 20", low, high));
  std::vector<Expr> level{Expr(1)}, terms;
  std::vector<std::size_t> first{0};  // lowest variable that a monomial of the level may still be multiplied with
  if (low == 0) terms = level;
  for (int degree = 1; degree <= high; ++degree) {
    std::vector<Expr> next;
    std::vector<std::size_t> next_first;
    for (std::size_t k = 0; k < level.size(); ++k) {
      for (std::size_t v = first[k]; v < variables.size(); ++v) {
        next.push_back(level[k] * Expr::symbol(variables[v]));
        next_first.push_back(v);
      }
    }
    if (next.size() > detail::kMaxSize)
      throw Error(fmt::format("polynomial library of degree {} in {} variables is too large", high, variables.size()));
    level = std::move(next);
    first = std::move(next_first);
    if (degree >= low) terms.insert(terms.end(), level.begin(), level.end());
  }
  return terms;
}

std::vector<Expr> fourier_library(const std::vector<std::string>& variables, int harmonics) {
  if (harmonics < 1) throw Error(fmt::format("Fourier library of {} harmonics: must be 1 or more", harmonics));
  std::vector<Expr> terms;
  for (const std::string& name : variables) {
    for (int k = 1; k <= harmonics; ++k) {
      terms.push_back(sin(Expr(k) * Expr::symbol(name)));
      terms.push_back(cos(Expr(k) * Expr::symbol(name)));
    }
  }
  return terms;
}

std::vector<Expr> parse_library(const std::vector<std::string>& terms) {
  std::vector<Expr> result;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    try {
      result.push_back(Expr::parse(terms[i]));
    } catch (const Error& error) {
      throw Error(fmt::format("library entry {}: {}", i + 1, error.what()));
    }
  }
  return result;
}

std::vector<Expr> rotor_library() {
  return parse_library({"1", "X1", "X1^3", "X2", "X6^2*cos(X5)", "X6^2*sin(X5)", "X6*cos(X5)", "X6*sin(X5)", "X3",
                        "X3^3", "X4", "X1*X3^2", "X1^2*X3", "X6", "X6^2", "sin(X5)", "cos(X5)"});
}

std::vector<Expr> modal_library(const std::vector<std::complex<double>>& poles, double onset) {
  const Expr t = Expr::symbol("t") - onset;
  const Expr gate = onset == 0 ? Expr(1) : (Expr(1) + sgn(t)) / 2;
  std::vector<Expr> terms;
  for (const std::complex<double>& pole : poles) {
    const Expr decay = gate * exp(Expr(pole.real()) * t), angle = Expr(pole.imag()) * t;
    terms.push_back(decay * cos(angle));
    if (pole.imag() != 0) terms.push_back(decay * sin(angle));
  }
  return terms;
}

std::vector<Expr> union_library(const std::vector<std::vector<Expr>>& libraries) {
  std::unordered_set<Expr> seen;
  std::vector<Expr> terms;
  for (const std::vector<Expr>& library : libraries) {
    for (const Expr& term : library) {
      if (!term.is_number(0) && seen.insert(split_coefficient(term).second).second) terms.push_back(term);
    }
  }
  return terms;
}

namespace {}  // namespace

TiedGroup tied_group(std::string name, const std::vector<Expr>& terms, std::string coefficient, std::string unit) {
  TiedGroup group{std::move(name), {}, std::move(coefficient), std::move(unit)};
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const auto [factor, function] = split_coefficient(terms[i]);
    if (factor != 0) group.entries.push_back({i, function, factor});
  }
  return group;
}

std::vector<Expr> group_terms(const TiedGroup& group, std::size_t n) {
  std::vector<Expr> terms(n);
  for (const TiedEntry& entry : group.entries) {
    terms.at(entry.equation) = terms[entry.equation] + Expr(entry.factor) * entry.function;
  }
  return terms;
}

CandidateLibrary make_library(std::vector<std::string> lhs, std::vector<TiedGroup> groups, std::vector<Expr> known) {
  const std::set<std::string> distinct(lhs.begin(), lhs.end());
  if (distinct.size() != lhs.size()) throw Error("library: an equation is named twice");
  if (!known.empty() && known.size() != lhs.size()) {
    throw Error(fmt::format("library: {} known parts for {} equations", known.size(), lhs.size()));
  }
  CandidateLibrary library{std::move(lhs), {}, std::move(groups), std::move(known)};
  std::set<std::string, detail::NaturalOrder> names;
  const auto use = [&names](const Expr& e) {
    for (std::string& name : variables(e)) names.insert(std::move(name));
  };
  std::set<std::string> tied;
  for (const TiedGroup& group : library.groups) {
    if (group.entries.empty()) throw Error(fmt::format("library: group '{}' is in no equation", group.name));
    if (group.entries.size() > 1 && !tied.insert(group.name).second) {
      throw Error(fmt::format("library: two groups are named '{}'", group.name));
    }
    for (const TiedEntry& entry : group.entries) {
      if (entry.equation >= library.lhs.size())
        throw Error(fmt::format("library: group '{}' has too many terms", group.name));
      use(entry.function);
    }
  }
  for (const Expr& e : library.known) use(e);
  library.variables.assign(names.begin(), names.end());
  return library;
}

std::vector<Expr> right_hand_sides(const CandidateLibrary& library, const std::vector<Expr>& unknowns) {
  if (unknowns.size() != library.groups.size()) {
    throw Error(fmt::format("{} values for {} unknowns of the library", unknowns.size(), library.groups.size()));
  }
  std::vector<std::vector<Expr>> terms(library.lhs.size());
  for (std::size_t i = 0; i < library.known.size(); ++i) terms[i].push_back(library.known[i]);
  for (std::size_t g = 0; g < unknowns.size(); ++g) {
    for (const TiedEntry& entry : library.groups[g].entries) {
      terms[entry.equation].push_back(unknowns[g] * entry.factor * entry.function);
    }
  }
  std::vector<Expr> sums;
  for (std::vector<Expr>& t : terms) sums.push_back(Expr::sum(std::move(t)));
  return sums;
}

CandidateLibrary tied_rotor_library(bool offset, bool anisotropic, bool control) {
  std::vector<TiedGroup> groups;
  const auto add = [&](const char* name, const char* x, const char* y, const char* coefficient, const char* unit) {
    groups.push_back(tied_group(name, {Expr::parse(x), Expr::parse(y)}, coefficient, unit));
  };
  add("k1", "-X1", "-X3", "K1/m", "1/s^2");
  add("k2", "-X1*(X1^2 + X3^2)", "-X3*(X1^2 + X3^2)", "K2/m", "1/(m^2 s^2)");
  add("c", "-X2", "-X4", "C/m", "1/s");
  add("eps_re", "X6^2*cos(X5) + X7*sin(X5)", "X6^2*sin(X5) - X7*cos(X5)", "e*cos(phi)", "m");
  add("eps_im", "-X6^2*sin(X5) + X7*cos(X5)", "X6^2*cos(X5) + X7*sin(X5)", "e*sin(phi)", "m");
  if (anisotropic) {  // -k1_conj conj(z) - c_conj conj(z')
    add("k1_conj_re", "-X1", "X3", "(Kx - Ky)/(2*m)", "1/s^2");
    add("k1_conj_im", "-X3", "-X1", "Kxy/m", "1/s^2");
    add("c_conj_re", "-X2", "X4", "(Cx - Cy)/(2*m)", "1/s");
    add("c_conj_im", "-X4", "-X2", "Cxy/m", "1/s");
  }
  if (control) add("gain", "ux", "uy", "1/m", "1/kg");
  if (offset) {
    add("d_re", "1", "0", "", "m/s^2");
    add("d_im", "0", "1", "", "m/s^2");
  }
  return make_library({"X2'", "X4'"}, std::move(groups));
}

}  // namespace whirl::expr
