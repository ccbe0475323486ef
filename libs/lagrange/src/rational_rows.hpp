#pragma once
#include <ginac/ginac.h>

#include <vector>

namespace whirl::lagrange::algebra {

using Row = std::vector<GiNaC::numeric>;

/// Reduced row echelon form in exact numbers; returns the pivot column of every row left, ascending.
inline std::vector<std::size_t> echelon(std::vector<Row>& rows) {
  std::vector<std::size_t> pivots;
  const std::size_t columns = rows.empty() ? 0 : rows[0].size();
  for (std::size_t column = 0; column < columns && pivots.size() < rows.size(); ++column) {
    const std::size_t top = pivots.size();
    std::size_t found = top;
    while (found < rows.size() && rows[found][column].is_zero()) ++found;
    if (found == rows.size()) continue;
    std::swap(rows[top], rows[found]);
    const GiNaC::numeric scale = rows[top][column];
    for (GiNaC::numeric& x : rows[top]) x = x / scale;
    for (std::size_t r = 0; r < rows.size(); ++r) {
      if (r == top || rows[r][column].is_zero()) continue;
      const GiNaC::numeric factor = rows[r][column];
      for (std::size_t c = 0; c < columns; ++c) rows[r][c] = rows[r][c] - factor * rows[top][c];
    }
    pivots.push_back(column);
  }
  rows.resize(pivots.size());
  return pivots;
}

}  // namespace whirl::lagrange::algebra
