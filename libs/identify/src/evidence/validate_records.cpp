#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/damaged_records.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/validate.hpp"

namespace whirl::identification {
namespace {

/// Error of restarted free runs against what noise and the model's own residual account for: twice that asks for a
/// look, three times that is no prediction. Parts of the motion that small do not count: free runs start at noisy
/// samples.
void judge_band(const IdentifiedModel& model, const StateScore& s, const std::string& source, Summary& summary) {
  constexpr double kSeen = 2, kMissed = 3, kSmall = 0.03;
  const double expected =
      s.noise * std::sqrt(std::max(1.0, std::isfinite(model.summary.chi_square) ? model.summary.chi_square : 1.0));
  const double spread = s.nrmse > 0 ? s.rmse / s.nrmse : INFINITY;
  const double beyond = std::sqrt(std::max(0.0, s.rmse * s.rmse - expected * expected));
  if (!(s.rmse > kSeen * expected) || beyond < kSmall * spread) return;
  const std::string text = fmt::format(
      "{}: the model does not predict {}: error {:.3g} rms, {:.2g} % of the motion, where noise and the model's "
      "own residual account for {:.3g}",
      source, s.state, s.rmse, 100 * s.nrmse, expected);
  s.rmse > kMissed* expected ? summary.fail(text) : summary.warn(text);
}

ValidationRun general_run(const IdentifiedModel& model, const Recording& record, const ValidateOptions& options) {
  ValidationRun run;
  run.general = predict_held_out(model, record, record.source, false, options);
  const HeldOut& h = run.general;
  if (!h.reason.empty()) throw Error(h.reason);
  for (std::size_t k = 0; k < h.scores.size(); ++k) {
    // Over one characteristic period even chaos can be followed.
    if (!std::isfinite(h.near[k].rmse)) {
      run.summary.fail(fmt::format("{}: the free run of {} diverges", record.source, h.scores[k].state));
    } else if (h.near[k].nrmse > 1) {
      run.summary.fail(fmt::format("{}: {} is predicted no better than by its mean", record.source, h.scores[k].state));
    } else {
      judge_band(model, h.near[k], record.source, run.summary);
    }
  }
  if (run.summary.status == Status::ok) return run;
  std::vector<std::string> channels = model.inputs;
  for (const StateScore& s : h.scores) channels.push_back(s.state);
  // The verdict itself stays last.
  std::vector<std::string>& said = run.summary.warnings;
  for (const std::string& finding : detail::look_for_damage({record}, channels).findings)
    said.insert(said.begin(), "this may be the cause: " + finding);
  return run;
}

ValidationRun rotor_run(const IdentifiedModel& model, const Recording& record, const ValidateOptions& options) {
  ValidationRun run;
  run.rotor = validate_model(model, record, options);
  const Validation& v = *run.rotor;
  run.summary = v.summary;
  if (run.summary.status == Status::unusable) return run;
  // What a jump across the fold decides says nothing about the model.
  if (!v.fold_sensitive && (v.rmse_x > v.band_x || v.rmse_y > v.band_y)) {
    run.summary.fail(fmt::format(
        "{}: the model does not predict this run: error {:.3g} and {:.3g} mm rms, {:.3g} and {:.3g} mm are "
        "within its 95 % band (unbalance {})",
        record.source, 1e3 * v.rmse_x, 1e3 * v.rmse_y, 1e3 * v.band_x, 1e3 * v.band_y, to_string(v.unbalance)));
  } else if (v.nrmse > 1) {
    run.summary.fail(fmt::format("{}: the run is predicted no better than by its mean", record.source));
  }
  return run;
}

/// The angle of a free run of all six states under the record's drive, beside the lateral motion along the measured
/// one.
void judge_drive(const IdentifiedModel& model, const Recording& record, ValidationRun& run) {
  constexpr double kFail = 0.05;  // of the turns made
  const Recording free = simulate_drive(model, record);
  const Eigen::VectorXd error = free["beta"] - record["beta"];
  const double turned = record["beta"].maxCoeff() - record["beta"].minCoeff();
  const double rms = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
  run.general.scores.push_back({"beta", rms, rms / turned, 0});
  if (!(rms < kFail * turned)) {
    run.summary.fail(
        fmt::format("{}: the drive's torque does not predict the speed: the angle is {:.3g} rad rms off, "
                    "{:.2g} % of the turns made",
                    record.source, rms, 100 * rms / turned));
  }
}

}  // namespace

ValidationReport validate(const IdentifiedModel& model, const std::vector<Recording>& records,
                          const ValidateOptions& options, const std::vector<Recording>& clean) {
  const bool rotor = model.rotor || (!model.states.empty() && model.states.front() == "X1");
  if (!clean.empty() && !rotor) throw Error("--clean is for rotors");
  if (!clean.empty() && clean.size() != records.size()) {
    throw Error::in_field("clean", fmt::format("{} records", clean.size()),
                          fmt::format("one for each of the {} records", records.size()));
  }
  ValidationReport report;
  for (std::size_t i = 0; i < records.size(); ++i) {
    ValidateOptions own = options;
    if (!clean.empty()) own.clean = clean[i];
    ValidationRun run = rotor ? rotor_run(model, records[i], own) : general_run(model, records[i], own);
    run.source = records[i].source;
    const bool turns = records[i].has("x") && records[i].has("y") && records[i].has("beta");
    if (has_drive(model) && turns) judge_drive(model, records[i], run);
    for (const std::string& w : run.summary.warnings) report.summary.warn(w);
    if (run.summary.status == Status::unusable) report.summary.status = Status::unusable;
    report.runs.push_back(std::move(run));
  }
  return report;
}

}  // namespace whirl::identification
