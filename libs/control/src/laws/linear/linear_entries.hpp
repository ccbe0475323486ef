#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <string>

#include "laws/parameters.hpp"
#include "whirl/control/laws/state_space.hpp"

namespace whirl::control {

// The numbers of linear dynamics by name: the law of a user, and laws that end as such dynamics.

constexpr double kMostEntry = 1e15;
inline constexpr const char* kAxes[] = {"x", "y"};

inline int order_of(const Parameters& v, const std::string& axis) {
  const auto found = v.find(axis + "_order");
  return found == v.end() ? 0 : static_cast<int>(std::clamp(found->second, 0.0, double{LinearAxis::kOrder}));
}

/// Calls with name, unit and meaning of every entry of one axis, and where it goes: A, B, C, D row by row.
template <class Visit>
void visit_entries(const std::string& axis, int order, const Visit& visit) {
  for (int i = 1; i <= order; ++i) {
    for (int j = 1; j <= order; ++j) visit(fmt::format("{}_a_{}_{}", axis, i, j), "1", 'a', i - 1, j - 1);
    for (int k = 1; k <= LinearAxis::kInputs; ++k)
      visit(fmt::format("{}_b_{}_{}", axis, i, k), k < 3 ? "1/m" : "s/m", 'b', i - 1, k - 1);
    visit(fmt::format("{}_c_{}", axis, i), "m/s^2", 'c', 0, i - 1);
  }
  for (int k = 1; k <= LinearAxis::kInputs; ++k)
    visit(fmt::format("{}_d_{}", axis, k), k < 3 ? "1/s^2" : "1/s", 'd', 0, k - 1);
}

inline const char* meaning_of(char part) {
  return part == 'a'   ? "A: state to state"
         : part == 'b' ? "B: inputs x, y, v_x, v_y to state"
         : part == 'c' ? "C: state to acceleration"
                       : "D: inputs to acceleration";
}

template <class Axis>
auto& entry_of(Axis& law, char part, int row, int column) {
  const auto at = [](int index) { return static_cast<std::size_t>(index); };
  if (part == 'a') return law.a[at(row * LinearAxis::kOrder + column)];
  if (part == 'b') return law.b[at(row * LinearAxis::kInputs + column)];
  return part == 'c' ? law.c[at(column)] : law.d[at(column)];
}

/// The exported C of such a law: what is zero is left out, so that its structure is that of the law.
CodeFragment linear_code(const Parameters& v);

}  // namespace whirl::control
