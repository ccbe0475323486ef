#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace whirl::report {

enum class Align { left, right, center };

struct Column {
  std::string header;
  std::string unit;  ///< shown in brackets below or beside the header
  Align align = Align::right;
};

/// Cells are text: numbers are formatted by the caller (report/format.hpp), who knows their uncertainty.
struct Table {
  std::string caption;
  std::vector<Column> columns;
  std::vector<std::vector<std::string>> rows;  ///< each as long as `columns`
  std::vector<std::string> notes;              ///< below the table
  bool row_headers = true;                     ///< the first column names the row

  /// Throws Error when the row does not have one cell per column.
  void add(std::vector<std::string> cells);
};

/// Both throw Error when a row does not have one cell per column.
std::string to_html(const Table& table);
std::string to_text(const Table& table);  ///< aligned with spaces, for a terminal
std::string to_csv(const Table& table);

/// Columns of a terminal that the text takes (UTF-8; combining marks take none).
std::size_t display_width(std::string_view text);

}  // namespace whirl::report
