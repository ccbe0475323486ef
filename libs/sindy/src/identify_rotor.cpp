#include "whirl/sindy/identify_rotor.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "rotor_equations.hpp"
#include "rotor_verdict.hpp"
#include "whirl/core/error.hpp"
#include "whirl/sindy/score_test.hpp"
#include "whirl/sindy/weak_rotor.hpp"

namespace whirl {
namespace {

using Complex = std::complex<double>;

/// Modes of the hammer test that are not the main one (within 3 % of it).
std::vector<ForcedMode> candidate_modes(const RotorIdentifyOptions& options, double main_frequency) {
  std::vector<ForcedMode> modes;
  if (!options.modal) return modes;
  for (const Mode& m : options.modal->modes) {
    const double w = 2 * std::numbers::pi * m.frequency.value;
    if (std::abs(w / main_frequency - 1) > 0.03) modes.push_back({w, std::max(m.damping.value, 1e-5), 0});
  }
  return modes;
}

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
/// radians with 0.5 %, so the residual has a narrow valley: grid of a tenth of a per cent, then golden section).
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
  const double golden = 0.5 * (std::sqrt(5.0) - 1);
  double low = best - options.profile_search / steps, high = best + options.profile_search / steps;
  double a = high - golden * (high - low), b = low + golden * (high - low), fa = misfit(a), fb = misfit(b);
  for (int k = 0; k < 10; ++k) {
    if (fa < fb) {
      high = b;
      b = a;
      fb = fa;
      a = high - golden * (high - low);
      fa = misfit(a);
    } else {
      low = a;
      a = b;
      fa = fb;
      b = low + golden * (high - low);
      fb = misfit(b);
    }
  }
  record.angle = with_rate_error(record.angle, 0.5 * (low + high));
}

/// The state of the growing model.
struct Growth {
  OutputErrorOptions active;
  RotorModel start;
  double delay = 0;
  std::vector<ForcedMode> modes;    ///< candidates not yet in the model
  std::vector<DecayingMode> decays;
};

Growth with_term(Growth g, const std::string& term, const RotorIdentifyOptions& options) {
  if (term == "conj z") {
    g.active.conj_stiffness = true;
  } else if (term == "conj z'") {
    g.active.conj_damping = true;
  } else if (term.starts_with("runout")) {
    g.active.runout_harmonics = term.back() - '0';
  } else if (term == "delay") {
    g.active.delay = true;
  } else {
    const auto k = static_cast<std::ptrdiff_t>(std::stoul(term.substr(term.find(' ') + 1)) - 1);
    if (term.starts_with("mode")) {
      g.start.modes.push_back(g.modes[static_cast<std::size_t>(k)]);
      g.modes.erase(g.modes.begin() + k);
    } else {
      g.active.decays.push_back(g.decays[static_cast<std::size_t>(k)]);
      g.decays.erase(g.decays.begin() + k);
    }
    g.active.poles = options.refine_poles;
  }
  return g;
}

/// Name for reports: modes and decays by their frequency.
std::string label(const std::string& term, const Growth& g) {
  if (!term.starts_with("mode") && !term.starts_with("decay")) return term;
  const std::size_t space = term.find(' '), k = std::stoul(term.substr(space + 1)) - 1;
  const double w = term.starts_with("mode") ? g.modes[k].omega : g.decays[k].omega;
  return fmt::format("{} {:.4g} Hz", term.substr(0, space), w / (2 * std::numbers::pi));
}

/// Candidates to try next: the best one that the model can take up. Near resonance conj z and conj z' look alike, so when
/// both are significant the fit decides between them.
std::vector<std::string> next_terms(const ScoreTest& test, double threshold) {
  for (const ScoreCandidate& c : test.candidates) {
    if (!c.in_model || c.score < threshold) continue;
    if (c.term.starts_with("conj z")) {
      const ScoreCandidate* other = test.find(c.term == "conj z" ? "conj z'" : "conj z");
      if (other != nullptr && other->score >= threshold) return {"conj z", "conj z'"};
    }
    return {c.term};
  }
  return {};
}

void check(const RotorIdentifyOptions& o) {
  require_range("profile_search", o.profile_search, 0, 0.1);
  require_range("profile_degree", o.profile_degree, 2, 6);
  require_range("score_threshold", o.score_threshold, 1, 1e12);
  require_range("runout_harmonics", o.runout_harmonics, 0, 4);
}

}  // namespace

RotorIdentification identify_rotor_detailed(const std::vector<RotorRecord>& given,
                                            const RotorIdentifyOptions& options) {
  check(options);
  RotorIdentification result;
  IdentifiedModel& model = result.model;
  model.method = "weak";
  model.provenance.version = std::string(version());
  model.provenance.options = fmt::format("angle={} half_width={:g} score_threshold={:g} runout_harmonics={}",
                                         options.angle_source == AngleSource::measured ? "measured" : "profile",
                                         options.half_width, options.score_threshold, options.runout_harmonics);
  if (given.empty()) throw Error("records: at least one is needed");
  model.sample_time = given[0].dt;
  model.noise_sd = std::sqrt(0.5 * given[0].noise_variance());
  std::vector<RotorRecord> records = given;
  for (RotorRecord& r : records) {
    model.provenance.inputs.push_back(r.source);
    for (const std::string& w : r.summary.warnings) {
      r.summary.status == Status::unusable ? model.summary.fail(w) : model.summary.warn(w);
    }
  }
  if (model.summary.status == Status::unusable) return result;
  if (options.angle_source == AngleSource::profile) {
    for (RotorRecord& r : records) search_profile(r, options);
    result.active.profile_degree = options.profile_degree;
  }

  WeakRotorOptions weak;
  weak.half_width = options.half_width;
  const WeakRotorFit first = fit_weak_rotor(records, weak);
  if (first.summary.status == Status::unusable) {
    model.summary.fail(first.summary.warnings.back());
    return result;
  }
  Growth growth{result.active, first.model, 0, candidate_modes(options, std::sqrt(first.model.k1)), {}};
  for (const ForcedMode& m : growth.modes) growth.decays.push_back({m.omega, m.zeta});
  std::vector<Complex> eps = first.eps;
  ScoreTestOptions score;
  score.half_width = options.half_width;
  score.runout_harmonics = options.runout_harmonics;
  score.delay = options.delay;
  OutputErrorFit fit = fit_output_error_rotor(records, growth.start, growth.active, eps);
  for (;;) {
    if (fit.summary.status == Status::unusable) {
      model.summary.fail(fit.summary.warnings.back());
      return result;
    }
    result.fit = std::move(fit);
    result.active = growth.active;
    growth.start = result.fit.model;
    growth.active.decays = result.fit.decays;
    growth.delay = result.fit.delay;
    for (std::size_t r = 0; r < eps.size(); ++r) eps[r] = result.fit.records[r].eps;
    score.modes = growth.modes;
    score.decays = growth.decays;
    const ScoreTest test = score_rotor_terms(records, result.fit, result.active, score);
    result.chi_square_weak = test.chi_square;
    model.summary.condition_number = test.condition_number;

    // Terms cannot mend a wrong angle or a record that is no rotor.
    if (detail::unexplained_share(records, result.fit) > 0.4) break;
    const Growth before = growth;
    const std::vector<std::string> terms = next_terms(test, options.score_threshold);
    std::string chosen;
    for (const std::string& term : terms) {
      const Growth trial = with_term(before, term, options);
      OutputErrorFit trial_fit = fit_output_error_rotor(records, trial.start, trial.active, eps, trial.delay);
      if (trial_fit.summary.status == Status::unusable) continue;
      if (!chosen.empty() && trial_fit.summary.chi_square >= fit.summary.chi_square) continue;
      fit = std::move(trial_fit);
      growth = trial;
      chosen = label(term, before);
    }
    if (!chosen.empty()) {
      result.added.push_back(chosen);
      continue;
    }
    if (!terms.empty()) {
      model.summary.warn(fmt::format("the records hold a term {}, but it cannot be estimated from them", label(terms[0], before)));
      break;
    }
    if (!test.candidates.empty() && test.candidates.front().score >= options.score_threshold && test.chi_square > 1.3) {
      model.summary.warn(fmt::format("the records hold a term {} (score {:.0f}, threshold {:.0f}) that the rotor model "
                                     "does not have",
                                     test.candidates.front().term, test.candidates.front().score,
                                     options.score_threshold));
    }
    break;
  }
  const double scale = std::max({1.0, result.chi_square_weak, result.fit.summary.chi_square});
  const detail::ParameterView view(result.fit, scale);
  detail::describe_rotor(view, result.fit, model);
  model.summary.chi_square = result.chi_square_weak;
  detail::judge_rotor(records, result, model.summary);
  return result;
}

IdentifiedModel identify_rotor(const std::vector<Recording>& recordings, const RotorIdentifyOptions& options) {
  std::vector<RotorRecord> records;
  for (const Recording& r : recordings) records.push_back(rotor_record(r, options.record));
  return identify_rotor_detailed(records, options).model;
}

IdentifiedModel identify_rotor(const Recording& recording, const RotorIdentifyOptions& options) {
  return identify_rotor(std::vector<Recording>{recording}, options);
}

}  // namespace whirl
