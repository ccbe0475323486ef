#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/pages/text/identification.hpp"

namespace whirl::pages {
namespace {

std::string cell(double value) { return std::isfinite(value) ? fmt::format("{:.3g}", value) : "-"; }

std::string error_cell(const std::vector<identification::StateScore>& scores) {
  if (scores.empty()) return "-";
  const double worst = identification::worst_nrmse(scores);
  return std::isfinite(worst) ? fmt::format("{:.3g}", 100 * worst) : "diverges";
}

std::string show_error(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "diverges"; }

report::Table rotor_table(const identification::ValidationReport& report) {
  // One unit in the head of the table, or each with its own.
  const Quantity first = report.runs.front().rotor->quantity;
  const bool one = std::ranges::all_of(report.runs, [&](const auto& r) { return r.rotor->quantity == first; });
  const auto unit_of = [](Quantity q) { return q == Quantity::displacement ? "mm" : std::string(si_unit(q)); };
  const std::string unit = one ? unit_of(first) : "";
  report::Table table;
  table.caption = "Free-run error, rms, and the band that it stays in when the model is right (95 %)";
  table.columns = {{"record", "", report::Align::left},
                   {"x", unit},
                   {"y", unit},
                   {"x band", unit},
                   {"y band", unit},
                   {"x clean", unit},
                   {"y clean", unit},
                   {"nrmse", "%"},
                   {"note", "", report::Align::left}};
  const auto refitted = [](const identification::ValidationRun& r) {
    return r.rotor->unbalance == identification::UnbalanceSource::refitted;
  };
  const bool found = std::ranges::any_of(report.runs, refitted);
  if (found) table.columns.insert(table.columns.end() - 1, {{"unbalance", "um"}, {"at", "deg"}});
  for (const identification::ValidationRun& run : report.runs) {
    const identification::Validation& v = *run.rotor;
    std::vector<std::string> row{run.source};
    for (const double m : {v.rmse_x, v.rmse_y, v.band_x, v.band_y, v.clean_rmse_x, v.clean_rmse_y}) {
      const bool metres = v.quantity == Quantity::displacement;
      std::string cell = fmt::format("{:.4g}", metres ? 1e3 * m : m);
      if (!one) cell += " " + unit_of(v.quantity);
      row.push_back(std::isfinite(m) ? cell : "-");
    }
    row.push_back(std::isnan(v.nrmse) ? "-" : fmt::format("{:.3g}", 100 * v.nrmse));
    if (found) {
      row.push_back(fmt::format("{:.4g}", 1e6 * std::abs(v.eps)));
      row.push_back(fmt::format("{:.1f}", std::arg(v.eps) / kRadPerDegree));
    }
    row.push_back(v.fold_sensitive ? "fold-sensitive" : std::string(to_string(run.summary.status)));
    table.add(std::move(row));
  }
  return table;
}

report::Table general_table(const identification::ValidationReport& report) {
  report::Table table;
  table.caption = "Free-run error, rms";
  table.columns = {{"record", "", report::Align::left},
                   {"state", "", report::Align::left},
                   {"error", "SI"},
                   {"noise", "SI"},
                   {"band", "SI"},
                   {"nrmse", "%"},
                   {"restarted every", "s"},
                   {"error", "SI"},
                   {"band", "SI"},
                   {"nrmse", "%"}};
  const auto percent = [](double v) { return std::isfinite(v) ? fmt::format("{:.3g}", 100 * v) : "diverges"; };
  for (const identification::ValidationRun& run : report.runs) {
    const identification::HeldOut& h = run.general;
    for (std::size_t k = 0; k < h.scores.size(); ++k) {
      const identification::StateScore& s = h.scores[k];
      const double whole = k < run.band_whole.size() ? run.band_whole[k] : NAN;
      table.add({run.source, s.state, show_error(s.rmse), show_error(s.noise),
                 std::isfinite(whole) ? show_error(whole) : "-", percent(s.nrmse), fmt::format("{:.3g}", h.horizon),
                 show_error(h.near[k].rmse), show_error(run.band[k]), percent(h.near[k].nrmse)});
    }
  }
  return table;
}

}  // namespace

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
    cells.push_back(fit.model.equations.empty() && !s.reason.empty() ? s.reason : held.reason);
    table.add(std::move(cells));
  }
  table.notes = {
      "terms: kept in all equations. residual: rms of the regression by rms of its left-hand side, largest of the "
      "equations. condition: of the scaled columns kept.",
      "error: rms of measured minus free run by rms of measured, worst channel (contains the sensor noise); a model "
      "of the other part predicts."};
  return table;
}

report::Table validation_table(const identification::ValidationReport& report) {
  return !report.runs.empty() && report.runs.front().rotor ? rotor_table(report) : general_table(report);
}

}  // namespace whirl::pages
