#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

#include "whirl/control/catalogue.hpp"
#include "whirl/testing/paths.hpp"

namespace whirl::control {
namespace {

std::string trimmed(std::string text) {
  text.erase(0, text.find_first_not_of(" `"));
  return text.erase(text.find_last_not_of(" `") + 1);
}

/// Rows of the markdown tables of docs/notation.md; an escaped bar is no end of a cell.
std::vector<std::vector<std::string>> documented_rows() {
  std::ifstream in(testing::source_dir() + "/docs/notation.md");
  EXPECT_TRUE(in.good());
  std::vector<std::vector<std::string>> rows;
  for (std::string line; std::getline(in, line);) {
    if (!line.starts_with("|")) continue;
    std::vector<std::string> cells(1);
    for (std::size_t i = 1; i < line.size(); ++i) {
      if (line[i] == '|' && line[i - 1] != '\\') {
        cells.emplace_back();
      } else {
        cells.back() += line[i];
      }
    }
    for (std::string& cell : cells) cell = trimmed(cell);
    rows.push_back(cells);
  }
  return rows;
}

// "name | unit | low to high | method" of every parameter, in the documents and in the catalogue.
TEST(DocumentedNames, AreThoseOfTheCatalogueWithUnitAndBounds) {
  std::set<std::string> documented, known;
  for (const auto& row : documented_rows()) {
    if (row.size() < 5 || row[2].find(" to ") == std::string::npos) continue;
    std::istringstream methods(row[4]);
    for (std::string method; std::getline(methods, method, ',');) {
      documented.insert(fmt::format("{} | {} | {} | {}", row[0], row[1], row[2], trimmed(method)));
    }
  }
  for (const auto* methods : {&laws(), &estimators()}) {
    for (const MethodInfo& method : *methods) {
      for (const ParameterInfo& p : method.parameters) {
        known.insert(fmt::format("{} | {} | {:g} to {:g} | {}", p.name, p.unit, p.low, p.high, method.name));
      }
    }
  }
  for (const std::string& name : known) EXPECT_TRUE(documented.contains(name)) << "not in docs/notation.md: " << name;
  for (const std::string& name : documented) EXPECT_TRUE(known.contains(name)) << "not in the catalogue: " << name;
}

// The letters of the paper point at names that exist.
TEST(DocumentedNames, LettersOfTheLawsNameParametersOfTheCatalogue) {
  const std::set<std::string> letters{"C (surface)", "r = q/p", "rho", "eps (layer)", "delta"};
  std::size_t found = 0;
  for (const auto& row : documented_rows()) {
    if (!letters.contains(row[0]) || row[2].find(" to ") != std::string::npos)
      continue;  // the table below has the rest
    ++found;
    bool same = false;
    for (const ParameterInfo& p : law_info("tsmc").parameters) same = same || (p.name == row[1] && p.unit == row[2]);
    EXPECT_TRUE(same) << row[0] << ": " << row[1] << " in " << row[2];
  }
  EXPECT_EQ(found, letters.size());
}

}  // namespace
}  // namespace whirl::control
