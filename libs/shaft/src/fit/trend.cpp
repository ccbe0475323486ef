#include "whirl/shaft/fit/trend.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::shaft {
namespace {

constexpr double kFalseAlarms = 0.01;  // of all rows together

bool of_the_machine(const FitRow& row) {
  using enum UnknownKind;
  return row.kind == stiffness || row.kind == damping || row.kind == material_damping || row.kind == joint_damping;
}

/// Weighted least squares of y = a + b (k - mean) through the values known.
void fit_line(TrendRow& row) {
  double weights = 0, mean = 0, value = 0;
  int known = 0;
  for (std::size_t k = 0; k < row.values.size(); ++k) {
    if (std::isnan(row.values[k].value)) continue;
    const double w = 1 / (row.values[k].sd * row.values[k].sd);
    weights += w;
    mean += w * static_cast<double>(k);
    value += w * row.values[k].value;
    ++known;
  }
  mean /= weights, value /= weights;
  double spread = 0, slope = 0, square = 0;
  for (std::size_t k = 0; k < row.values.size(); ++k) {
    if (std::isnan(row.values[k].value)) continue;
    const double w = 1 / (row.values[k].sd * row.values[k].sd), t = static_cast<double>(k) - mean;
    spread += w * t * t;
    slope += w * t * row.values[k].value;
  }
  slope /= spread;
  for (std::size_t k = 0; k < row.values.size(); ++k) {
    if (std::isnan(row.values[k].value)) continue;
    const double left = row.values[k].value - value - slope * (static_cast<double>(k) - mean);
    square += left * left / (row.values[k].sd * row.values[k].sd);
  }
  row.chi_square = known > 2 ? square / (known - 2) : 1;
  const double steps = static_cast<double>(row.values.size() - 1), first = value - slope * mean;
  const double sd = std::sqrt(std::max(1.0, row.chi_square) / spread);
  row.change = Estimate::from_sd(slope * steps / first, sd * steps / std::abs(first));
  row.deviations = std::abs(slope) / sd;
}

}  // namespace

FitTrend fit_trend(const Rotor& rotor, const FitSetup& setup, const std::vector<OrderRun>& runs,
                   const FitOptions& options) {
  if (runs.size() < 2) throw Error("a trend needs two runs or more");
  FitTrend trend;
  FitOptions judged = options;
  judged.next = false;
  std::vector<std::vector<FitRow>> found;
  for (const OrderRun& run : runs) {
    FitSetup own = setup;
    std::erase_if(own.trials, [&](const Trial& t) { return t.run != run.name; });
    const RotorFit fit = fit_rotor(rotor, own, {run}, judged);
    trend.runs.push_back(run.name);
    trend.explained.push_back(fit.misfit.explained);
    if (!fit.misfit.explained)
      trend.summary.add({FindingCode::model_error,
                         Consequence::warning,
                         {{"chi_square", fit.misfit.chi_square}, {"deviations", fit.misfit.most()}},
                         run.name},
                        ": run " + run.name + " contradicts the rotor file and is left out of the trend");
    found.push_back(fit_rows(fit));
  }
  for (const FitRow& row : found.front()) {
    if (!of_the_machine(row)) continue;
    TrendRow line;
    line.last = row;
    int known = 0;
    for (std::size_t r = 0; r < found.size(); ++r) {
      const auto same = std::ranges::find(found[r], row.name, &FitRow::name);
      const bool shows = trend.explained[r] && same != found[r].end() && same->identifiable && same->value.sd > 0;
      line.values.push_back(shows ? same->value : Estimate{});
      known += shows;
    }
    if (known < 2) continue;
    fit_line(line);
    trend.rows.push_back(std::move(line));
  }
  if (trend.rows.empty()) {
    trend.summary.fail("two runs or more show none of the unknowns");
    return trend;
  }
  trend.limit = normal_quantile(1 - kFalseAlarms / (2.0 * static_cast<double>(trend.rows.size())));
  for (TrendRow& row : trend.rows) row.changed = row.deviations > trend.limit;
  return trend;
}

io::Json to_json(const FitTrend& trend) {
  io::Json rows = io::Json::array(), runs = io::Json::array();
  for (std::size_t r = 0; r < trend.runs.size(); ++r)
    runs.push(io::Json::object().set("name", trend.runs[r]).set("explained", static_cast<bool>(trend.explained[r])));
  for (const TrendRow& row : trend.rows) {
    io::Json values = io::Json::array();
    for (const Estimate& e : row.values) values.push(io::to_json(e, row.last.unit));
    rows.push(io::Json::object()
                  .set("name", row.last.name)
                  .set("kind", to_string(row.last.kind))
                  .set("values", std::move(values))
                  .set("change", io::to_json(row.change, "1"))
                  .set("deviations", row.deviations)
                  .set("chi_square", row.chi_square)
                  .set("changed", row.changed));
  }
  return io::start_document("whirl.rotor_trend", 1)
      .set("summary", io::to_json(trend.summary))
      .set("runs", std::move(runs))
      .set("limit", trend.limit)
      .set("unknowns", std::move(rows));
}

}  // namespace whirl::shaft
