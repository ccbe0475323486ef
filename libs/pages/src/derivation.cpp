#include "whirl/pages/derivation.hpp"

#include <fmt/format.h>

#include "whirl/io/model_json.hpp"
#include "whirl/pages/estimate_text.hpp"
#include "whirl/report/equation.hpp"

namespace whirl::pages {
namespace {

/// M q'' of one row.
expr::Expr inertia(const lagrange::LagrangeEquations& eq, std::size_t row) {
  std::vector<expr::Expr> terms;
  for (std::size_t j = 0; j < eq.coordinates.size(); ++j) {
    terms.push_back(eq.mass[row][j] * expr::Expr::symbol(eq.coordinates[j] + "''"));
  }
  return expr::Expr::sum(std::move(terms));
}

io::Json quantities(const std::vector<lagrange::PhysicalQuantity>& list) {
  io::Json json = io::Json::object();
  for (const lagrange::PhysicalQuantity& q : list) json.set(q.name, io::to_json(q.value, q.unit));
  return json;
}

}  // namespace

std::string derivation_text(const lagrange::LagrangeFile& file, const lagrange::LagrangeEquations& eq) {
  std::string text = file.title.empty() ? "" : file.title + "\n\n";
  text += "Equations of motion\n";
  for (std::size_t i = 0; i < eq.coordinates.size(); ++i)
    text += fmt::format("  {} = {}\n", inertia(eq, i).str(), eq.rhs[i].str());
  text += eq.implicit ? "\nAccelerations (the mass matrix depends on the state: each row for its own)\n"
                      : "\nAccelerations\n";
  for (std::size_t i = 0; i < eq.lhs.size(); ++i)
    text += fmt::format("  {} = {}\n", eq.lhs[i], eq.accelerations[i].str());
  const expr::CandidateLibrary& library = eq.library;
  text += fmt::format("\nLibrary: {} unknown{}, tied over {} equation{}\n", library.groups.size(),
                      library.groups.size() == 1 ? "" : "s", library.lhs.size(), library.lhs.size() == 1 ? "" : "s");
  for (const expr::TiedGroup& group : library.groups) {
    text += fmt::format("  {}{}\n", group.coefficient, group.unit.empty() ? "" : "  [" + group.unit + "]");
    const std::vector<expr::Expr> terms = expr::group_terms(group, library.lhs.size());
    for (std::size_t i = 0; i < terms.size(); ++i) {
      if (!terms[i].is_number(0)) text += fmt::format("      {}: {}\n", library.lhs[i], terms[i].str());
    }
  }
  for (std::size_t i = 0; i < library.known.size(); ++i) {
    if (!library.known[i].is_number(0))
      text += fmt::format("  known in {}: {}\n", library.lhs[i], library.known[i].str());
  }
  for (const std::string& note : eq.notes) text += fmt::format("Note: {}\n", note);
  text.pop_back();
  return text;
}

std::string derivation_latex(const lagrange::LagrangeEquations& eq) {
  std::string text = "\\begin{aligned}\n";
  const auto line = [&](const expr::Expr& left, const expr::Expr& right, const char* end) {
    text += fmt::format("{} &= {}{}\n", report::term_latex(left.str()), report::term_latex(right.str()), end);
  };
  for (std::size_t i = 0; i < eq.coordinates.size(); ++i) line(inertia(eq, i), eq.rhs[i], " \\\\");
  for (std::size_t i = 0; i < eq.lhs.size(); ++i) {
    line(expr::Expr::symbol(eq.lhs[i]), eq.accelerations[i], i + 1 < eq.lhs.size() ? " \\\\" : "");
  }
  return text + "\\end{aligned}";
}

io::Json to_json(const lagrange::LagrangeFile& file, const lagrange::LagrangeEquations& eq) {
  io::Json document = io::start_document("whirl.derivation", 1);
  document.set("title", file.title).set("coordinates", eq.coordinates);
  io::Json motion = io::Json::array(), accelerations = io::Json::array(), mass = io::Json::array();
  for (std::size_t i = 0; i < eq.coordinates.size(); ++i) {
    io::Json row = io::Json::array();
    for (const expr::Expr& entry : eq.mass[i]) row.push(entry.str());
    mass.push(std::move(row));
    motion.push(eq.rhs[i].str());
  }
  for (std::size_t i = 0; i < eq.lhs.size(); ++i) {
    accelerations.push(io::Json::object()
                           .set("lhs", eq.lhs[i])
                           .set("rhs", eq.accelerations[i].str())
                           .set("latex", report::term_latex(eq.accelerations[i].str())));
  }
  io::Json groups = io::Json::array();
  for (const expr::TiedGroup& group : eq.library.groups) {
    io::Json terms = io::Json::array();
    for (const expr::Expr& term : expr::group_terms(group, eq.library.lhs.size())) terms.push(term.str());
    groups.push(io::Json::object()
                    .set("name", group.name)
                    .set("coefficient", group.coefficient)
                    .set("unit", group.unit)
                    .set("terms", std::move(terms)));
  }
  io::Json known = io::Json::array();
  for (const expr::Expr& e : eq.library.known) known.push(e.str());
  document.set("mass", std::move(mass)).set("determinant", eq.determinant.str()).set("forces", std::move(motion));
  document.set("implicit", eq.implicit).set("accelerations", std::move(accelerations));
  document.set("library", io::Json::object()
                              .set("equations", eq.library.lhs)
                              .set("variables", eq.library.variables)
                              .set("groups", std::move(groups))
                              .set("known", std::move(known)));
  document.set("notes", eq.notes);
  return document;
}

std::string parameters_text(const lagrange::PhysicalParameters& found) {
  std::string text;
  const auto list = [&](const char* title, const std::vector<lagrange::PhysicalQuantity>& quantities) {
    if (quantities.empty()) return;
    text += fmt::format("\n{}\n", title);
    for (const lagrange::PhysicalQuantity& q : quantities)
      text += fmt::format("  {:10} {}\n", q.name, estimate_text(q.value, q.unit == "1" ? "" : q.unit));
  };
  list("Parameters from the model", found.parameters);
  list("Combinations that the model determines", found.combinations);
  list("Requested", found.reported);
  if (!text.empty()) text.pop_back();
  return text;
}

void add_parameters(io::Json& document, const lagrange::PhysicalParameters& found) {
  document.set("parameters", quantities(found.parameters)).set("combinations", quantities(found.combinations));
  document.set("reported", quantities(found.reported)).set("undetermined", found.undetermined);
}

}  // namespace whirl::pages
