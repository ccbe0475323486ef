#pragma once
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/report/equation.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/report/table.hpp"

namespace whirl::report {

struct Heading {
  int level = 2;  ///< 2 section, 3 subsection
  std::string text;
};
struct Paragraph {
  std::string text;
};
struct BulletList {
  std::vector<std::string> items;
};
struct FigureBlock {
  Figure figure;
  std::string caption;
};
struct EquationBlock {
  std::vector<Equation> equations;
  NameMap names;
};
/// Names and values, e.g. settings of a run.
struct KeyValues {
  std::vector<std::pair<std::string, std::string>> items;
};
/// A finding that must not be overlooked. The kind is also written in words, never by colour alone.
struct Callout {
  enum class Kind { agrees, disagrees, note, warning };
  Kind kind = Kind::note;
  std::string title;
  std::string text;
};
/// Verbatim text, e.g. a command line.
struct Code {
  std::string text;
};

using Block = std::variant<Heading, Paragraph, BulletList, FigureBlock, Table, EquationBlock, KeyValues, Callout, Code,
                           Provenance>;

/// A report: blocks in reading order. Figures, tables and equations are numbered in the order they stand.
struct Document {
  std::string title;
  std::string subtitle;
  std::vector<Block> blocks;

  Document& section(std::string text);
  Document& subsection(std::string text);
  Document& paragraph(std::string text);
  Document& bullets(std::vector<std::string> items);
  Document& figure(Figure figure, std::string caption);
  Document& table(Table table);
  /// All equations of a model in its notation.
  Document& equations(const IdentifiedModel& model);
  Document& key_values(std::vector<std::pair<std::string, std::string>> items);
  Document& callout(Callout::Kind kind, std::string title, std::string text = "");
  Document& code(std::string text);
  /// Trust sentence and warnings of a result; nothing when it has none.
  Document& summary(const Summary& summary, std::string of_what);
  Document& provenance(const Provenance& provenance);
};

/// One HTML page that needs no other file, no network and no script: style and figures are inside. Follows the reader's
/// light or dark scheme, prints on A4 and Letter.
std::string to_html(const Document& document);
/// The same as plain text for a terminal; of figures only the caption.
std::string to_text(const Document& document);

/// Writes the page. With `data`, each figure's data also go to FILE_figures/figure_N.csv and the drawing to .svg.
/// Throws Error when a file cannot be written.
void write_html(const Document& document, const std::filesystem::path& file, bool data = false);

}  // namespace whirl::report
