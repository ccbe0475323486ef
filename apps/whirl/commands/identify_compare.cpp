#include "identify_compare.hpp"

#include <cmath>
#include <ctime>

#include "identify_evidence.hpp"
#include "whirl/identify/compare.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

/// A whole method of whirl as one more row.
identification::ComparedFit whole_method(const std::string& name, const std::function<IdentifiedModel()>& identify) {
  identification::ComparedFit row;
  const std::clock_t begin = std::clock();
  try {
    row.model = identify();
  } catch (const Error& e) {
    row.model.summary.fail(e.what());
  }
  row.seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  row.method = name;
  for (const Equation& e : row.model.equations) {
    for (const EquationTerm& t : e.terms) row.terms += t.coefficient.sd != 0;
  }
  row.model.summary.residual = NAN;  // of the free run here: not comparable
  return row;
}

double worst(const std::vector<identification::StateScore>& scores) {
  double nrmse = 0;
  for (const identification::StateScore& s : scores) nrmse = std::fmax(nrmse, s.nrmse);
  return nrmse;
}

io::Json row_json(const identification::ComparedFit& fit, const identification::HeldOut& held) {
  const Summary& s = fit.model.summary;
  io::Json row = io::Json::object();
  row.set("method", fit.method).set("terms", fit.terms).set("residual", s.residual);
  row.set("condition_number", s.condition_number).set("seconds", fit.seconds);
  io::Json equations = io::Json::array();
  for (const Equation& e : fit.model.equations) {
    io::Json functions = io::Json::array(), coefficients = io::Json::array();
    for (const EquationTerm& t : e.terms) {
      functions.push(t.function);
      coefficients.push(t.coefficient.value);
    }
    io::Json entry = io::Json::object();
    entry.set("lhs", e.lhs).set("functions", std::move(functions)).set("coefficients", std::move(coefficients));
    equations.push(std::move(entry));
  }
  row.set("equations", std::move(equations));
  Evidence evidence;
  evidence.held_out = held;
  const io::Json shown = to_json(evidence);
  row.set("held_out", *shown.find("held_out"));
  row.set("reason", s.status == Status::unusable ? s.warnings.back() : held.reason);
  return row;
}

}  // namespace

void compare_methods(const IdentifyOptions& o, const std::vector<Recording>& records, Session& session) {
  const bool rotor = o.rotor();
  if (o.chosen_method() == "second-order") throw Error("--compare is for rotors and for --method sindy");
  if (rotor && records.size() != 1) throw Error("--compare takes one rotor record");
  const identification::HoldoutSplit split = rotor ? identification::split_holdout(records, o.holdout, {"x", "y"})
                                                   : identification::split_holdout(records, o.holdout);
  std::vector<identification::ComparedFit> fits;
  if (rotor) {
    fits = identification::compare_regressors(identification::rotor_record(split.train.front()), o.paper());
    fits.push_back(whole_method(
        "consistent (tied)", [&] { return identification::identify_consistent(split.train.front(), o.consistent()); }));
    fits.push_back(
        whole_method("weak (default)", [&] { return identification::identify_rotor(split.train, o.weak()); }));
  } else {
    const identification::SindyOptions options = o.sindy(records.front());
    if (o.library.empty()) {
      fits = identification::compare_regressors(split.train, options);
      fits.push_back(whole_method("sindy (default)", [&] { return identification::fit_sindy(split.train, options); }));
    } else {
      const expr::CandidateLibrary library = o.candidate_library(records.front());
      fits = identification::compare_regressors(split.train, library, options);
      fits.push_back(
          whole_method("sindy (default)", [&] { return identification::fit_library(split.train, library, options); }));
    }
  }

  report::Table table;
  table.caption = fmt::format("Regression methods on the same data; free-run error on {}", split.what);
  table.columns = {{"method", "", report::Align::left}, {"terms", ""}, {"residual", "%"}, {"condition", ""}};
  double horizon = 0;
  io::Json rows = io::Json::array();
  Summary summary;
  bool any = false;
  std::vector<std::vector<std::string>> lines;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    const identification::ComparedFit& fit = fits[i];
    session.progress("compare", static_cast<double>(i) / static_cast<double>(fits.size()));
    identification::HeldOut held;
    held.what = split.what;
    if (!fit.model.equations.empty()) held = predict_held_out(fit.model, split.test, split.what, rotor);
    horizon = std::max(horizon, held.horizon);
    rows.push(row_json(fit, held));
    const Summary& s = fit.model.summary;
    const bool scored = !held.scores.empty();
    any = any || (scored && worst(held.scores) < 1);
    const auto cell = [](double v, const char* format) {
      return std::isfinite(v) ? fmt::format(fmt::runtime(format), v) : "-";
    };
    std::vector<std::string> cells{fit.method, std::to_string(fit.terms), cell(100 * s.residual, "{:.3g}"),
                                   cell(s.condition_number, "{:.3g}")};
    const auto error = [&](const std::vector<identification::StateScore>& scores) {
      return !scored ? "-" : std::isfinite(worst(scores)) ? fmt::format("{:.3g}", 100 * worst(scores)) : "diverges";
    };
    if (!rotor) cells.push_back(error(held.near));
    cells.push_back(error(held.scores));
    cells.push_back(fmt::format("{:.3g}", 1e3 * fit.seconds));
    cells.push_back(fit.model.equations.empty() && !s.warnings.empty() ? s.warnings.back() : held.reason);
    lines.push_back(std::move(cells));
  }
  session.progress("compare", 1);
  if (!rotor) table.columns.push_back({fmt::format("error over {:.3g} s", horizon), "%"});
  table.columns.push_back({"error of one run", "%"});
  table.columns.push_back({"time", "ms"});
  table.columns.push_back({"note", "", report::Align::left});
  for (auto& cells : lines) table.add(std::move(cells));
  table.notes = {
      "terms: kept in all equations. residual: rms of the regression by rms of its left-hand side, largest of the "
      "equations. condition: of the scaled columns kept.",
      "error: rms of measured minus free run by rms of measured, worst channel (contains the sensor noise); a model "
      "of the other part predicts."};
  io::Json document = io::start_document("whirl.comparison", 1);
  document.set("held_out", split.what).set("methods", std::move(rows));
  document.set("provenance", to_json(io::provenance({o.files.begin(), o.files.end()}, session.command_line)));
  if (!o.out.empty()) io::save_json(o.out, document);
  session.say(report::to_text(table));
  session.result(document);
  if (!any) summary.fail("no method predicts the part held out better than its mean does");
  session.finish(summary);
}

}  // namespace whirl::app
