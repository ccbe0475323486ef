#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "record/bridge_gaps.hpp"
#include "record/damaged_records.hpp"
#include "rules/rules.hpp"
#include "validate/free_run_band.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {
namespace {

/// Twice what the noise and what else moves a run account for, or 3 % of the motion, SI.
double band_of(const StateScore& s, double moves) {
  const double spread = s.nrmse > 0 ? s.rmse / s.nrmse : 0, expected = std::hypot(s.noise, moves);
  return std::max(rules::kBand * expected, std::hypot(expected, rules::kRunShare * spread));
}

/// Error of free runs that are restarted every characteristic period: even chaos can be followed so far.
void judge_near(const IdentifiedModel& model, const StateScore& s, const std::string& source, ValidationRun& run) {
  // Free runs start at noisy samples, and what the model left of its own records it leaves of these.
  const double left = std::sqrt(std::max(0.0, model.summary.chi_square - 1));
  const double stated = band_of(s, std::isfinite(left) ? left * s.noise : 0), right = band_of(s, 0);
  run.band.push_back(stated);
  const std::string error = fmt::format("error {:.3g} rms ({:.2g} % of the motion)", s.rmse, 100 * s.nrmse);
  if (!std::isfinite(s.rmse)) {
    run.summary.fail(fmt::format("{}: the free run of {} diverges", source, s.state));
  } else if (s.nrmse > 1) {
    run.summary.fail(fmt::format("{}: {} is predicted no better than by its mean", source, s.state));
  } else if (s.rmse > stated) {
    run.summary.fail(fmt::format("{}: the model does not predict {}: {}, {:.3g} is within its band", source, s.state,
                                 error, stated));
  } else if (s.rmse > right) {
    run.summary.warn(
        fmt::format("{}: {} is predicted as badly as on the model's own records, which it does not explain (chi-square "
                    "{:.3g}): {}, {:.3g} would be the noise's",
                    source, s.state, model.summary.chi_square, error, right));
  }
}

/// Error of one free run over the whole record. Where noise at the start and the intervals of the coefficients move it
/// by a good part of the motion (chaos, a stop passed on either side) it says nothing.
void judge_whole(const StateScore& s, double moves, const std::string& source, ValidationRun& run) {
  const double motion = s.nrmse > 0 ? s.rmse / s.nrmse : 0;
  const bool told = moves < rules::kRunOpen * motion;
  run.band_whole.push_back(told ? band_of(s, moves) : std::numeric_limits<double>::quiet_NaN());
  if (!(s.rmse > run.band_whole.back())) return;
  const std::string said = fmt::format(
      "{}: the free run of {} leaves the record: error {:.3g} rms ({:.2g} % of the motion) over all of it, {:.3g} is "
      "what noise and the model's intervals account for",
      source, s.state, s.rmse, 100 * s.nrmse, run.band_whole.back());
  s.nrmse > rules::kLost ? run.summary.fail(said) : run.summary.warn(said);
}

ValidationRun general_run(const IdentifiedModel& model, const Recording& record, const ValidateOptions& options) {
  ValidationRun run;
  run.general = predict_held_out(model, record, record.source, false, options);
  const HeldOut& h = run.general;
  if (!h.reason.empty()) throw Error(h.reason);
  for (const StateScore& s : h.near) judge_near(model, s, record.source, run);
  if (run.summary.status != Status::unusable) {
    const Eigen::VectorXd moves =
        detail::free_run_spread(model, with_derivatives(detail::longest_whole_stretch(record), model.inputs), h.scores);
    for (std::size_t k = 0; k < h.scores.size(); ++k)
      judge_whole(h.scores[k], moves[static_cast<Eigen::Index>(k)], record.source, run);
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
    const bool metres = v.quantity == Quantity::displacement;
    const std::string_view unit = metres ? "mm" : si_unit(v.quantity);
    const auto both = [&](double x, double y) {
      const double by = metres ? 1e3 : 1;
      if (std::isnan(x) || std::isnan(y)) return fmt::format("{:.3g}", by * (std::isnan(x) ? y : x));
      return fmt::format("{:.3g} and {:.3g}", by * x, by * y);
    };
    run.summary.fail(fmt::format(
        "{0}: the model does not predict this run: error {1} {4} rms, {2} {4} are within its 95 % band (unbalance {3})",
        record.source, both(v.rmse_x, v.rmse_y), both(v.band_x, v.band_y), to_string(v.unbalance), unit));
  } else if (v.nrmse > 1) {
    run.summary.fail(fmt::format("{}: the run is predicted no better than by its mean", record.source));
  }
  return run;
}

/// The angle of a free run of all six states under the record's drive, beside the lateral motion along the measured
/// one.
void judge_drive(const IdentifiedModel& model, const Recording& record, ValidationRun& run) {
  const Recording free = simulate_drive(model, record);
  const Eigen::VectorXd read = signal::unwrapped(record["beta"]), error = free["beta"] - read;
  const double turned = read.maxCoeff() - read.minCoeff();
  const double rms = std::sqrt(error.squaredNorm() / static_cast<double>(error.size()));
  run.general.scores.push_back({"beta", rms, rms / turned, 0});
  if (!(rms < rules::kDriveAngle * turned)) {
    run.summary.fail(
        fmt::format("{}: the drive's torque does not predict the speed: the angle is {:.3g} rad rms off, "
                    "{:.2g} % of the turns made",
                    record.source, rms, 100 * rms / turned));
  }
}

/// Whether another reading of the model's records, which its intervals do not cover, predicts this record better.
void judge_readings(const IdentifiedModel& model, const Recording& record, const ValidateOptions& options,
                    ValidationRun& run) {
  if (!run.rotor || !(run.rotor->summary.residual > 0)) return;
  for (const ModelReading& reading : other_readings(model)) {
    const Validation other = validate_model(reading.model, record, options);
    const double own = run.rotor->summary.residual, theirs = other.summary.residual;
    if (!(theirs > 0)) continue;
    // By the likelihood of white residuals of both axes.
    const double gain = 4 * static_cast<double>(record.size()) * std::log(own / theirs);
    const bool better = gain > rules::kOdds20;
    run.summary.add({FindingCode::readings_differ,
                     better ? Consequence::warning : Consequence::note,
                     {{"rmse", own, std::string(si_unit(run.rotor->quantity))},
                      {"rmse with it", theirs, std::string(si_unit(run.rotor->quantity))}},
                     reading.reading},
                    better ? ": it predicts this record better" : "");
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
  take_parts(Consumer::validate, model, report.summary);
  for (std::size_t i = 0; i < records.size(); ++i) {
    ValidateOptions own = options;
    if (!clean.empty()) own.clean = clean[i];
    ValidationRun run = rotor ? rotor_run(model, records[i], own) : general_run(model, records[i], own);
    run.source = records[i].source;
    const bool turns = records[i].has("x") && records[i].has("y") && records[i].has("beta");
    if (has_drive(model) && turns) judge_drive(model, records[i], run);
    if (rotor) judge_readings(model, records[i], own, run);
    for (const std::string& n : run.summary.notes) report.summary.notes.push_back(n);
    report.runs.push_back(std::move(run));
  }
  for (const ValidationRun& run : report.runs) report.summary.take(run.summary);
  return report;
}

}  // namespace whirl::identification
