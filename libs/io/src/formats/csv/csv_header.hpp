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
  // Where there is no unit by which the column can be read:
  const UnitSuffix* stated = nullptr;  ///< beside a kind of amplitude, or in another spelling: `mils p-p`, `acc_G`
  bool unclear = false;                ///< a word that may be a unit and is not known
  std::string base = {};               ///< the name without that word
  std::string label = {};              ///< the word, where it stands in a line of units
  std::string_view kind = {};          ///< `pp`, `peak` or `rms`, also beside a known unit
};

/// `x_mm`, `x [mm]`, `x (mm)`, `x {mm}`, `x / mm`; `rpm`, `hz`, names that end in `_re` or `_im`.
Heading parse_heading(std::string_view text);

/// UTF-8, of what may be latin-1 (`µm` of many loggers).
std::string in_utf8(std::string_view raw);

/// Takes the units of a line below the headings, e.g. `(s),(mm),(mm)`; false, and nothing done, when the line is none:
/// a number, a missing value, or no heading that waits for a unit. A unit that is not known is kept as a label. Throws
/// Error, without the place, for another unit than in the heading.
bool take_units(std::vector<Heading>& headings, const std::vector<std::string>& fields);

/// Names that whirl knows (`x`, `beta`, `time`, ...) in small letters, unless another column is called so.
void use_known_names(std::vector<Heading>& headings, const std::vector<std::string>& required);

/// The complete `--columns` of a table: names and units as far as they can be guessed, then what is left to be told. A
/// unit that a heading states is kept. `numbers`: columns by number.
std::string proposed_columns(const std::vector<Heading>& headings, bool numbers,
                             const std::vector<std::string>& required);

/// Why a column cannot be read by its unit, with the proposal. `written`: its name with the unit as asked for.
std::string unit_failure(const std::vector<Heading>& headings, std::size_t column, const std::string& written,
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

/// A remark where the heading states a kind of amplitude that the name does not repeat; empty: none.
std::string dropped_kind(const Heading& heading, const ColumnChoice& choice);

/// Text from the file as it may stand in a message.
std::string shown(std::string_view text);

}  // namespace whirl::io::detail
