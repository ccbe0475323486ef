#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "whirl/io/csv.hpp"

namespace whirl::io::detail {

/// One heading of a CSV file.
struct Heading {
  std::string text;                  ///< as in the file
  std::string name;                  ///< without unit; blanks as underscores
  const UnitSuffix* unit = nullptr;  ///< null: none that is known
  bool foreign = false;              ///< written as instruments do: `x [mm]`, `x (mm)`, `x / mm`, or a line of units
};

/// `x_mm`, `x [mm]`, `x (mm)`, `x {mm}`, `x / mm`; `rpm`, `hz`, names that end in `_re` or `_im`.
Heading parse_heading(std::string_view text);

/// UTF-8, of what may be latin-1 (`µm` of many loggers).
std::string in_utf8(std::string_view raw);

/// Takes the units of a line below the headings, e.g. `(s),(mm),(mm)`; false, and nothing done, when the line is none:
/// a number, a missing value, or no heading that waits for a unit. Throws Error, without the place, for a unit that is
/// not known or another one than in the heading.
bool take_units(std::vector<Heading>& headings, const std::vector<std::string>& fields);

/// Names that whirl knows (`x`, `beta`, `time`, ...) in small letters, unless another column is called so.
void use_known_names(std::vector<Heading>& headings, const std::vector<std::string>& required);

/// The complete `--columns` of a table: names and units as far as they can be guessed. `numbers`: columns by number.
std::string proposed_columns(const std::vector<Heading>& headings, bool numbers,
                             const std::vector<std::string>& required);

/// A column chosen by `CsvOptions::columns`: which heading, and how it is called.
struct ColumnChoice {
  std::size_t heading = 0;
  std::string name;
  const UnitSuffix* unit = nullptr;
  double factor = 1;
};
/// Throws Error, without the place, when no heading fits or the unit is not told. `headings` without texts: a file
/// without a header, whose columns are chosen by number.
ColumnChoice choose_column(const std::string& spec, const std::vector<Heading>& headings);

/// Text from the file as it may stand in a message.
std::string shown(std::string_view text);

}  // namespace whirl::io::detail
