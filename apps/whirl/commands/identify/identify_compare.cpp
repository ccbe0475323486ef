#include "identify_compare.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/identify/identify_json.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

std::string cell(double value) { return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-"; }

std::string error_cell(const std::vector<identification::StateScore>& scores) {
  if (scores.empty()) return "-";
  const double worst = identification::worst_nrmse(scores);
  return std::isfinite(worst) ? fmt::format("{:.3g}", 100 * worst) : "diverges";
}

report::Table comparison_table(const identification::MethodComparison& comparison) {
  double horizon = 0;
  for (const identification::MethodRow& row : comparison.rows) horizon = std::max(horizon, row.held_out.horizon);
  report::Table table;
  table.caption = fmt::format("Regression methods on the same data; free-run error on {}", comparison.what);
  table.columns = {{"method", "", report::Align::left}, {"terms", ""}, {"residual", "%"}, {"condition", ""}};
  if (horizon > 0) table.columns.push_back({fmt::format("error over {:.3g} s", horizon), "%"});
  table.columns.push_back({"error of one run", "%"});
  table.columns.push_back({"time", "ms"});
  table.columns.push_back({"note", "", report::Align::left});
  for (const auto& [fit, held] : comparison.rows) {
    const Summary& s = fit.model.summary;
    std::vector<std::string> cells{fit.method, std::to_string(fit.terms), cell(100 * s.residual),
                                   cell(s.condition_number)};
    if (horizon > 0) cells.push_back(error_cell(held.near));
    cells.push_back(error_cell(held.scores));
    cells.push_back(fmt::format("{:.3g}", 1e3 * fit.seconds));
    cells.push_back(fit.model.equations.empty() && !s.warnings.empty() ? s.warnings.back() : held.reason);
    table.add(std::move(cells));
  }
  table.notes = {
      "terms: kept in all equations. residual: rms of the regression by rms of its left-hand side, largest of the "
      "equations. condition: of the scaled columns kept.",
      "error: rms of measured minus free run by rms of measured, worst channel (contains the sensor noise); a model "
      "of the other part predicts."};
  return table;
}

}  // namespace

void print_comparison(const identification::MethodComparison& comparison, const IdentifyFlags& flags,
                      const Provenance& provenance, Session& session) {
  io::Json document = to_json(comparison);
  document.set("provenance", to_json(provenance));
  if (!flags.out.empty()) io::save_json(flags.out, document);
  session.say(report::to_text(comparison_table(comparison)));
  session.result(document);
  session.finish(comparison.summary);
}

}  // namespace whirl::app
