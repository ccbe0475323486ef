#include "whirl/identify/identify_json.hpp"

#include <cmath>

#include "whirl/io/model_json.hpp"

namespace whirl::identification {
namespace {

io::Json scores_json(const std::vector<StateScore>& scores) {
  io::Json list = io::Json::array();
  for (const StateScore& s : scores) {
    io::Json entry = io::Json::object();
    entry.set("state", s.state).set("rmse", s.rmse).set("nrmse", s.nrmse).set("noise", s.noise);
    list.push(std::move(entry));
  }
  return list;
}

io::Json row_json(const MethodRow& row) {
  const Summary& s = row.fit.model.summary;
  io::Json out = io::Json::object();
  out.set("method", row.fit.method).set("terms", row.fit.terms).set("residual", s.residual);
  out.set("condition_number", s.condition_number).set("seconds", row.fit.seconds);
  io::Json equations = io::Json::array();
  for (const Equation& e : row.fit.model.equations) {
    io::Json functions = io::Json::array(), coefficients = io::Json::array();
    for (const EquationTerm& t : e.terms) {
      functions.push(t.function);
      coefficients.push(t.coefficient.value);
    }
    io::Json entry = io::Json::object();
    entry.set("lhs", e.lhs).set("functions", std::move(functions)).set("coefficients", std::move(coefficients));
    equations.push(std::move(entry));
  }
  out.set("equations", std::move(equations));
  out.set("held_out", to_json(row.held_out));
  out.set("reason", s.status == Status::unusable ? s.reason : row.held_out.reason);
  return out;
}

}  // namespace

io::Json to_json(const HeldOut& h) {
  io::Json held = io::Json::object();
  held.set("what", h.what).set("free_run", scores_json(h.scores)).set("horizon_s", h.horizon);
  held.set("free_run_horizon", scores_json(h.near)).set("reason", h.reason);
  if (!h.unit.empty()) held.set("unit", h.unit);
  return held;
}

namespace {

io::Json evidence_json(const Evidence& evidence, const std::vector<Ambiguity>& ambiguous) {
  io::Json groups = io::Json::array();
  for (const CollinearGroup& g : evidence.collinear) {
    io::Json entry = io::Json::object();
    entry.set("equation", g.equation).set("terms", g.terms).set("condition_index", g.condition_index);
    groups.push(std::move(entry));
  }
  io::Json bounds = io::Json::array();
  for (const BoundOutcome& b : evidence.bounds) {
    io::Json entry = io::Json::object();
    entry.set("equation", b.equation).set("function", b.function).set("sign", b.sign > 0 ? "+" : "-");
    entry.set("active", b.active).set("kept", b.kept).set("unbounded", b.unbounded).set("t", b.t);
    bounds.push(std::move(entry));
  }
  io::Json ambiguities = io::Json::array();
  for (const Ambiguity& a : ambiguous) {
    io::Json entry = io::Json::object();
    entry.set("readings", a.readings).set("consequence", a.consequence).set("experiment", a.experiment);
    ambiguities.push(std::move(entry));
  }
  io::Json out = io::Json::object();
  out.set("held_out", to_json(evidence.held_out)).set("collinear", std::move(groups)).set("bounds", std::move(bounds));
  out.set("ambiguities", std::move(ambiguities)).set("assumptions", evidence.assumptions);
  if (evidence.range) {
    io::Json range = io::Json::object();
    range.set("amplitude_m", evidence.range->amplitude);
    range.set("speed_low_rad_s", evidence.range->low).set("speed_high_rad_s", evidence.range->high);
    out.set("range", std::move(range));
  }
  if (evidence.trapping) {
    const Trapping& t = *evidence.trapping;
    io::Json trapping = io::Json::object();
    trapping.set("states", t.states).set("shift", t.shift).set("weights", t.weights);
    trapping.set("eigenvalue_1_s", t.eigenvalue).set("radius", t.radius);
    out.set("trapping", std::move(trapping));
  }
  return out;
}

}  // namespace

io::Json to_json(const Evidence& evidence) { return evidence_json(evidence, {}); }

std::optional<DataRange> load_data_range(const std::filesystem::path& model) {
  const io::Json document = io::load_json(model);
  const io::JsonReader reader(document, model.string());
  if (!reader.has("evidence") || !reader.at("evidence").has("range")) return std::nullopt;
  const io::JsonReader range = reader.at("evidence").at("range");
  return DataRange{range.at("amplitude_m").number(), range.at("speed_low_rad_s").number(),
                   range.at("speed_high_rad_s").number()};
}

io::Json to_json(const Identification& id) {
  io::Json document = io::to_json(id.model);
  document.set("evidence", evidence_json(id.evidence, id.model.ambiguities));
  return document;
}

io::Json to_json(const Validation& v, const std::string& file) {
  io::Json run = io::Json::object();
  run.set("file", file);
  if (v.quantity != Quantity::displacement) run.set("quantity", std::string(to_string(v.quantity)));
  run.set("rmse_x", v.rmse_x).set("rmse_y", v.rmse_y).set("nrmse", v.nrmse);
  run.set("after_change", v.after_change);
  run.set("clean_rmse_x", v.clean_rmse_x).set("clean_rmse_y", v.clean_rmse_y);
  run.set("noise_x", v.noise_x).set("noise_y", v.noise_y);
  run.set("band_x", v.band_x).set("band_y", v.band_y);
  run.set("peak_measured", v.peak_measured).set("peak_simulated", v.peak_simulated);
  run.set("fold_sensitive", v.fold_sensitive);
  run.set("unbalance", std::string(to_string(v.unbalance)));
  run.set("summary", io::to_json(v.summary));
  return run;
}

io::Json to_json(const ValidationReport& report) {
  io::Json runs = io::Json::array();
  for (const ValidationRun& run : report.runs) {
    if (run.rotor) {
      io::Json entry = to_json(*run.rotor, run.source);
      for (const StateScore& s : run.general.scores) entry.set("free_run_rmse_" + s.state, s.rmse);
      runs.push(std::move(entry.set("summary", io::to_json(run.summary))));
    } else {
      io::Json entry = to_json(run.general);
      io::Json bands = io::Json::object();
      for (std::size_t k = 0; k < run.band.size(); ++k) bands.set(run.general.near[k].state, run.band[k]);
      io::Json whole = io::Json::object();
      for (std::size_t k = 0; k < run.band_whole.size(); ++k) whole.set(run.general.scores[k].state, run.band_whole[k]);
      entry.set("file", run.source).set("band", std::move(bands)).set("band_free_run", std::move(whole));
      entry.set("summary", io::to_json(run.summary));
      runs.push(std::move(entry));
    }
  }
  io::Json document = io::start_document("whirl.validation", 1);
  document.set("runs", std::move(runs)).set("summary", io::to_json(report.summary));
  return document;
}

io::Json to_json(const MethodComparison& comparison) {
  io::Json rows = io::Json::array();
  for (const MethodRow& row : comparison.rows) rows.push(row_json(row));
  io::Json document = io::start_document("whirl.method_comparison", 1);
  document.set("held_out", comparison.what).set("methods", std::move(rows));
  return document;
}

double load_left_unexplained(const std::filesystem::path& model) {
  double left = std::numeric_limits<double>::quiet_NaN();
  const io::Json document = io::load_json(model);
  io::JsonReader file(document, model.string());
  for (const char* key : {"evidence", "held_out", "free_run"}) {
    if (!file.has(key)) return left;
    file = file.at(key);
  }
  for (const io::JsonReader& run : file.items()) left = std::fmax(left, run.at("nrmse").number_or_nan());
  return left;
}

}  // namespace whirl::identification
