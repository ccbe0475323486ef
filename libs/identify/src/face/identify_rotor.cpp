#include "whirl/identify/identify_rotor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>

#include "evidence/omitted_terms.hpp"
#include "evidence/rotor_ambiguity.hpp"
#include "evidence/rotor_verdict.hpp"
#include "face/rotor_like.hpp"
#include "growth/grow_rotor.hpp"
#include "problem/record_noise.hpp"
#include "problem/rotor_equations.hpp"
#include "record/start_motion.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/identify/weak_rotor.hpp"

namespace whirl::identification {
namespace {

/// The angle with its acceleration multiplied by 1 + error, rate at t = 0 kept.
AngleSignal with_rate_error(const AngleSignal& angle, double error) {
  AngleSignal a = angle;
  for (Eigen::Index i = 0; i < a.beta.size(); ++i) {
    const double t = 0.5 * a.dt * static_cast<double>(i);
    a.beta[i] += error * (angle.beta[i] - angle.beta[0] - angle.omega[0] * t);
    a.omega[i] += error * (angle.omega[i] - angle.omega[0]);
    a.alpha[i] += error * angle.alpha[i];
  }
  return a;
}

/// Rate error within the range that gives the smallest whitened weak residual (the phase error at resonance grows to
/// radians with 0.5 %, so the residual has a narrow valley: grid of a tenth of a per cent, then Brent's minimum).
void search_profile(RotorRecord& record, const RotorIdentifyOptions& options) {
  const auto misfit = [&](double error) {
    RotorRecord r = record;
    r.angle = with_rate_error(record.angle, error);
    WeakRotorOptions weak;
    weak.half_width = options.half_width;
    weak.passes = 3;
    const WeakRotorFit fit = fit_weak_rotor({r}, weak);
    return fit.summary.status == Status::unusable ? INFINITY : fit.summary.chi_square;
  };
  const int steps = std::max(2, static_cast<int>(std::ceil(options.profile_search / 1e-3)));
  double best = 0, lowest = misfit(0);
  for (int k = -steps; k <= steps; ++k) {
    const double error = options.profile_search * k / steps;
    if (const double m = k == 0 ? INFINITY : misfit(error); m < lowest) {
      lowest = m;
      best = error;
    }
  }
  constexpr int kBits = 20;  // of a rate error of one: to 1e-6
  const double step = options.profile_search / steps;
  record.angle = with_rate_error(record.angle,
                                 boost::math::tools::brent_find_minima(misfit, best - step, best + step, kBits).first);
}

/// Modes and decays were named when they were taken up; their frequencies have been refined since.
void name_as_refined(detail::GrownRotor& grown) {
  std::vector<double> modes, decays;
  for (std::size_t k = 0; k < grown.fit.model.modes.size(); ++k)
    if (static_cast<int>(k) != grown.active.modes.given) modes.push_back(grown.fit.model.modes[k].omega);
  for (const DecayingMode& d : grown.fit.decays) decays.push_back(d.omega);
  const auto rename = [&](const std::string& kind, const std::vector<double>& omegas) {
    std::size_t next = 0;
    for (std::string& label : grown.added) {
      if (!label.starts_with(kind) || !label.ends_with(" Hz") || next >= omegas.size()) continue;
      const std::string now = fmt::format("{}{:.4g} Hz", kind, omegas[next++] * kHzPerRadPerSec);
      for (std::string& w : grown.warnings)
        if (w.starts_with(label + " ")) w.replace(0, label.size(), now);
      label = now;
    }
  };
  rename("mode ", modes);
  rename("decay ", decays);
}

void check(const RotorIdentifyOptions& o) {
  require_range("profile_search", o.profile_search, 0, 0.1);
  require_range("profile_degree", o.profile_degree, 2, 6);
  require_range("score_threshold", o.score_threshold, 1, 1e12);
  require_range("runout_harmonics", o.runout_harmonics, 0, 4);
}

std::string_view to_string(AngleSource source) {
  switch (source) {
    case AngleSource::measured:
      return "measured";
    case AngleSource::profile:
      return "profile";
    case AngleSource::vibration:
      return "vibration";
  }
  return "?";
}

/// The one that all records read; throws Error where they differ, or where the angle needs displacements.
Quantity quantity_of(const std::vector<RotorRecord>& records, const RotorIdentifyOptions& options) {
  const Quantity quantity = records.front().quantity;
  for (const RotorRecord& r : records) {
    if (r.quantity != quantity)
      throw Error(fmt::format("{} holds {}, {} {}: records of one rotor read one quantity", records.front().source,
                              to_string(quantity), r.source, to_string(r.quantity)));
  }
  if (options.angle_source != AngleSource::measured && quantity != Quantity::displacement)
    throw Error(fmt::format("{}: --angle {} takes displacements, and x and y are {}: measure the angle",
                            records.front().source, to_string(options.angle_source), to_string(quantity)));
  return quantity;
}

/// The weak equations from which the fit begins. `moving`: displacements; false: integrals of what the records read.
WeakRotorFit weak_start(const std::vector<RotorRecord>& moving, WeakRotorOptions& weak, bool measured) {
  constexpr double kLeastDamping = 0.004;  // of k1^0.5: a ratio of 0.2 %; a start that grows goes nowhere
  WeakRotorFit first = fit_weak_rotor(moving, weak);
  if (first.summary.status == Status::unusable) {
    // Runout or a bow as large as the motion hides the spring.
    weak.runout = true;
    if (WeakRotorFit turned = fit_weak_rotor(moving, weak); turned.summary.status != Status::unusable)
      first = std::move(turned);
  }
  if (measured || first.summary.status == Status::unusable) return first;
  first.model.offset = 0;  // of the integral, not of the readings
  first.model.c = std::max(first.model.c, kLeastDamping * std::sqrt(first.model.k1));
  return first;
}

/// Velocity pickups and accelerometers pass no constant: their high-pass is in the model from the start, where the
/// trajectory confirms it as it does a term of the search. (Found later it has a rival, the delay of the readings.)
void take_high_pass(const std::vector<RotorRecord>& records, const RotorIdentifyOptions& options, WeakRotorFit& first,
                    OutputErrorOptions& active) {
  constexpr double kCorner = 2 * std::numbers::pi;  // rad/s; data sheets say 0.1 to 5 Hz
  if (!options.terms) return;
  OutputErrorOptions with = active;
  with.probes.errors.push_back(&terms::ac_coupling());
  with.probes.start.high_pass = kCorner;
  const OutputErrorFit plain = fit_output_error_rotor(records, first.model, active, first.eps);
  const OutputErrorFit coupled = fit_output_error_rotor(records, first.model, with, first.eps);
  if (coupled.summary.status == Status::unusable) return;
  double readings = 0;
  for (const RotorRecord& r : records) readings += r.readings();
  const double left = coupled.summary.chi_square, gain = readings * (plain.summary.chi_square - left);
  const bool none = plain.summary.status == Status::unusable;
  if (!none && !(gain > options.score_threshold * std::max(1.0, left))) return;
  with.probes.start = coupled.sensor;
  active = std::move(with);
  first.model = coupled.model;
  for (std::size_t r = 0; r < first.eps.size(); ++r) first.eps[r] = coupled.records[r].eps;
}

std::string of_one_place(Quantity quantity) {
  return fmt::format(
      "x and y are the {} of one place: k1, k2, c and e are those of its motion, as the sensors are "
      "calibrated",
      to_string(quantity));
}

}  // namespace

/// `like`: the model is of that kind, and nothing is sought; null: searched for.
static RotorIdentification identified(const std::vector<RotorRecord>& given, const RotorIdentifyOptions& options,
                                      const RotorIdentification* like) {
  check(options);
  RotorIdentification result;
  IdentifiedModel& model = result.model;
  model.method = "weak";
  model.provenance.version = std::string(version());
  model.provenance.options =
      fmt::format("angle={} half_width={:g} score_threshold={:g} runout_harmonics={}", to_string(options.angle_source),
                  options.half_width, options.score_threshold, options.runout_harmonics);
  if (given.empty()) throw Error("records: at least one is needed");
  model.sample_time = given[0].dt;
  model.noise_sd = given[0].noise_sd();
  std::vector<RotorRecord> records = given;
  for (RotorRecord& r : records) {
    model.provenance.inputs.push_back(r.source);
    for (const std::string& w : r.summary.warnings) {
      r.summary.status == Status::unusable ? model.summary.fail(w) : model.summary.warn(w);
    }
  }
  if (model.summary.status == Status::unusable) return result;
  model.quantity = quantity_of(records, options);
  const bool displacement = model.quantity == Quantity::displacement;
  if (options.angle_source != AngleSource::measured) {
    for (RotorRecord& r : records) search_profile(r, options);
    result.active.clock.profile_degree = options.profile_degree;
  }
  std::vector<RotorRecord> integrated;
  for (const RotorRecord& r : records)
    if (!displacement) integrated.push_back(detail::as_displacement(r));
  const std::vector<RotorRecord>& moving = displacement ? records : integrated;

  WeakRotorOptions weak;
  weak.half_width = options.half_width;
  WeakRotorFit first = weak_start(moving, weak, displacement);
  if (first.summary.status == Status::unusable) {
    model.summary.fail(first.summary.reason);
    return result;
  }
  if (std::any_of(records.begin(), records.end(), [](const RotorRecord& r) { return r.colour.size() > 0; })) {
    const OutputErrorFit plain = fit_output_error_rotor(records, first.model, result.active, first.eps);
    for (std::size_t r = 0; r < plain.records.size(); ++r) detail::refine_noise(plain.records[r], records[r]);
  }
  if (!displacement) take_high_pass(records, options, first, result.active);
  detail::GrownRotor grown = like != nullptr
                                 ? detail::fitted_as(records, *like, options)
                                 : detail::grow_rotor(records, moving, weak, std::move(first), options, result.active);
  if (!grown.usable()) {
    for (const std::string& w : grown.warnings) model.summary.warn(w);
    model.summary.fail(grown.fit.summary.reason);
    return result;
  }
  if (grown.bow) detail::read_as_runout(grown.fit);
  name_as_refined(grown);
  for (const std::string& w : grown.warnings) model.summary.warn(w);
  result.fit = std::move(grown.fit);
  result.active = std::move(grown.active);
  result.added = std::move(grown.added);
  result.mode_found = grown.mode_found;
  result.chi_square_weak = grown.chi_square;
  model.summary.condition_number = grown.condition_number;
  const double scale = std::max({1.0, result.chi_square_weak, result.fit.summary.chi_square});
  const detail::ParameterView view(result.fit, scale);
  detail::describe_rotor(view, result.fit, model);
  model.summary.chi_square = result.chi_square_weak;
  detail::judge_rotor(records, result, model.summary);
  if (model.summary.status != Status::unusable) {
    const detail::NamedEstimates before = model.parameters;
    detail::carry_ambiguities(grown, scale, result);
    if (options.angle_source == AngleSource::measured) detail::state_angle_step(records, result);
    if (options.angle_source == AngleSource::vibration) detail::forget_phase(result);
    detail::state_one_axis(records, result);
    if (!displacement) result.assumptions.push_back(of_one_place(model.quantity));
    detail::state_modes_above(result);
    detail::widen_for_omitted(grown, scale, result);
    detail::widen_equations(before, model);
    detail::join_covariance(view, model);
  }
  return result;
}

RotorIdentification identify_rotor_detailed(const std::vector<RotorRecord>& records,
                                            const RotorIdentifyOptions& options) {
  return identified(records, options, nullptr);
}

static RotorIdentification identified(const std::vector<Recording>& recordings, const RotorIdentifyOptions& options,
                                      const RotorIdentification* like) {
  std::vector<RotorRecord> records;
  RotorIdentifyOptions o = options;
  o.record.one_axis = true;
  o.record.any_motion = true;
  const bool none = options.angle_source == AngleSource::vibration;
  if (none) o.profile_degree = 2;
  for (const Recording& r : recordings) {
    int degree = 2;
    records.push_back(rotor_record(none ? with_angle_from_vibration(r, o.record, degree) : r, o.record));
    if (none) o.profile_degree = std::max(o.profile_degree, degree);
  }
  return identified(records, o, like);
}

RotorIdentification identify_rotor_detailed(const std::vector<Recording>& recordings,
                                            const RotorIdentifyOptions& options) {
  return identified(recordings, options, nullptr);
}

RotorIdentification detail::rotor_like(const std::vector<Recording>& recordings, const RotorIdentification& like,
                                       const RotorIdentifyOptions& options) {
  return identified(recordings, options, &like);
}

IdentifiedModel identify_rotor(const std::vector<Recording>& recordings, const RotorIdentifyOptions& options) {
  return identify_rotor_detailed(recordings, options).model;
}

IdentifiedModel identify_rotor(const Recording& recording, const RotorIdentifyOptions& options) {
  return identify_rotor(std::vector<Recording>{recording}, options);
}

}  // namespace whirl::identification
