#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "record/damaged_records.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/validate.hpp"

namespace whirl::identification {
namespace {

/// Largest rms error of a free run restarted every characteristic period that the model stands for: twice what the
/// noise of the record and the model's own residual account for (free runs start at noisy samples), or 3 % of the
/// motion, SI.
double band_of(const IdentifiedModel& model, const StateScore& s) {
  constexpr double kTimes = 2, kShare = 0.03;
  const double chi_square = std::isfinite(model.summary.chi_square) ? std::max(1.0, model.summary.chi_square) : 1;
  const double spread = s.nrmse > 0 ? s.rmse / s.nrmse : 0, expected = s.noise * std::sqrt(chi_square);
  return std::max(kTimes * expected, std::hypot(expected, kShare * spread));
}

ValidationRun general_run(const IdentifiedModel& model, const Recording& record, const ValidateOptions& options) {
  ValidationRun run;
  run.general = predict_held_out(model, record, record.source, false, options);
  const HeldOut& h = run.general;
  if (!h.reason.empty()) throw Error(h.reason);
  for (std::size_t k = 0; k < h.scores.size(); ++k) {
    const StateScore& near = h.near[k];
    run.band.push_back(band_of(model, near));
    // Over one characteristic period even chaos can be followed.
    if (!std::isfinite(near.rmse)) {
      run.summary.fail(fmt::format("{}: the free run of {} diverges", record.source, h.scores[k].state));
    } else if (near.nrmse > 1) {
      run.summary.fail(fmt::format("{}: {} is predicted no better than by its mean", record.source, h.scores[k].state));
    } else if (near.rmse > run.band.back()) {
      run.summary.fail(
          fmt::format("{}: the model does not predict {}: error {:.3g} rms ({:.2g} % of the motion), "
                      "{:.3g} is within its band",
                      record.source, near.state, near.rmse, 100 * near.nrmse, run.band.back()));
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
    const auto both = [](double x, double y) {
      if (std::isnan(x) || std::isnan(y)) return fmt::format("{:.3g}", 1e3 * (std::isnan(x) ? y : x));
      return fmt::format("{:.3g} and {:.3g}", 1e3 * x, 1e3 * y);
    };
    run.summary.fail(fmt::format(
        "{}: the model does not predict this run: error {} mm rms, {} mm are within its 95 % band (unbalance {})",
        record.source, both(v.rmse_x, v.rmse_y), both(v.band_x, v.band_y), to_string(v.unbalance)));
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
