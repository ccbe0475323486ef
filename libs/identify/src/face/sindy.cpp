#include "whirl/identify/sindy.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "evidence/channel_units.hpp"
#include "evidence/noise_correlation.hpp"
#include "evidence/record_quality.hpp"
#include "evidence/sindy_verdict.hpp"
#include "output_error/sindy_refine.hpp"
#include "problem/sindy_prepare.hpp"
#include "rules/rules.hpp"
#include "timing/sindy_timing.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/hidden_states.hpp"
#include "whirl/identify/rational.hpp"

namespace whirl::identification {
namespace {

/// Model without equations that says why.
IdentifiedModel unusable(const SindyOptions& options, Summary summary) {
  IdentifiedModel model;
  model.method = "sindy";
  model.states = options.states;
  model.inputs = options.inputs;
  model.summary = std::move(summary);
  model.summary.trust = "Do not use this model.";
  return model;
}

/// The estimated coefficients as parameters, by equation and term.
void set_parameters(IdentifiedModel& model, const Eigen::MatrixXd& covariance) {
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) model.parameters.emplace_back(e.lhs + ": " + t.function, t.coefficient);
    }
  }
  // Of a refinement that was stopped: it may hold terms that have left.
  if (covariance.rows() != static_cast<Eigen::Index>(model.parameters.size())) return;
  model.parameter_covariance.assign(covariance.data(), covariance.data() + covariance.size());
}

/// Equations after the search for terms.
struct Refinement {
  IdentifiedModel model;
  detail::OutputWeights weights;
  detail::Followed followed;
};
Refinement refined_with(const detail::SindyData& data, const detail::Regression& regression,
                        const SindyOptions& options) {
  Refinement r{regression.model, detail::output_weights(data, detail::noise_correlations(options)), {}};
  r.followed = detail::refine_and_select(r.model, data.candidates(), data.signs(), regression.alternatives,
                                         data.stretches(), r.weights.sd, data.rate(), options);
  return r;
}

/// With white noise; where that does not explain the records and noise that is correlated from sample to sample
/// explains them to the last, with that.
Refinement refined(const detail::SindyData& data, const detail::Regression& regression) {
  constexpr int kRounds = 3;
  SindyOptions options = data.options();
  Refinement white = refined_with(data, regression, options);
  if (!options.noise_correlation.empty() || !white.weights.noisy ||
      !(white.model.summary.chi_square > rules::kMayBeColoured))
    return white;
  detail::Followed followed = white.followed;
  for (int round = 0; round < kRounds; ++round) {
    options.noise_correlation = detail::noise_correlation(followed, options);
    if (options.noise_correlation.empty()) break;
    Refinement coloured = refined_with(data, regression, options);
    if (coloured.followed.horizon > 0 && detail::only_noise_left(coloured.followed)) return coloured;
    followed = std::move(coloured.followed);
  }
  return white;
}

/// The model's noise, where it is not white.
void state_noise(const detail::OutputWeights& weights, const SindyOptions& options, IdentifiedModel& model) {
  if (weights.correlation.size() == 0) return;
  std::string each;
  model.noise_sd = 0;
  for (std::size_t k = 0; k < options.states.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(k);
    const double correlation = weights.correlation[at];
    model.noise_correlation.emplace_back(options.states[k], correlation);
    model.noise_sd +=
        weights.sd[at] / std::sqrt(1 - correlation * correlation) / static_cast<double>(weights.sd.size());
    each += fmt::format("{}{} {:.2f}", each.empty() ? "" : ", ", options.states[k], correlation);
  }
  model.summary.trust += fmt::format(
      " The noise is correlated from one sample to the next ({}): intervals and chi-square hold under it.", each);
}

IdentifiedModel fit_prepared(const detail::SindyData& data, const Recording& like, std::vector<BoundOutcome>* bounds) {
  const SindyOptions& options = data.options();
  detail::Regression regression = detail::regress(data, options.solver);
  IdentifiedModel& model = regression.model;
  const auto conclude = [&](const std::vector<TermScore>& blocked) {
    std::vector<BoundOutcome> outcomes = detail::conclude_bounds(data.signs(), blocked, model);
    if (bounds != nullptr) *bounds = std::move(outcomes);
  };
  const bool any_term = std::any_of(model.equations.begin(), model.equations.end(), [&](const Equation& e) {
    return data.candidates().contains(e.lhs) && !e.terms.empty();
  });
  if (!data.candidates().empty() && !any_term) {
    conclude(regression.blocked);
    model.summary.fail("no candidate term explains any left-hand side");
    model.summary.trust = "Do not use this model.";
    return model;
  }
  if (options.discrete || !options.refine || data.candidates().empty()) {
    detail::set_coefficient_units(model, like);
    detail::judge_regression(data, model);
    conclude(regression.blocked);
    set_parameters(model, {});
    return model;
  }
  const Refinement refinement = refined(data, regression);
  const detail::Followed& followed = refinement.followed;
  model = refinement.model;
  detail::set_coefficient_units(model, like);
  detail::judge_refined(data, refinement.weights, followed, regression.least, model);
  state_noise(refinement.weights, options, model);
  if (followed.between_samples) {
    for (const std::string& u : options.inputs) model.timing.push_back({u, Hold::band_limited, {0, 0, 0, 0}});
  }
  conclude(followed.blocked);
  set_parameters(model, followed.covariance);
  return model;
}

}  // namespace

IdentifiedModel detail::fit_untimed(const std::vector<Recording>& records, const SindyOptions& options,
                                    std::vector<BoundOutcome>* bounds) {
  detail::require_equal_steps(records);
  detail::SindyData data(options);
  Summary summary;
  detail::check_signals(records, options.states, options.inputs, options.discrete, summary);
  if (summary.status == Status::unusable) return unusable(options, std::move(summary));
  data.add(records, std::numeric_limits<Eigen::Index>::max());
  data.finish();
  IdentifiedModel model = fit_prepared(data, records.front(), bounds);
  for (const Recording& r : records) model.provenance.inputs.push_back(r.source);
  return model;
}

IdentifiedModel fit_sindy(const std::vector<Recording>& records, const SindyOptions& options,
                          std::vector<BoundOutcome>* bounds) {
  if (!options.equations.denominators.empty()) return fit_rational(records, options);
  if (options.hidden > 0) return fit_hidden(records, options);
  return detail::timing_sought(options) ? detail::fit_timed(records, options, bounds)
                                        : detail::fit_untimed(records, options, bounds);
}

struct SindyStream::State {
  detail::SindyData data;
  Recording like;   // channels of the first part, no samples
  Summary summary;  // of them
};

SindyStream::SindyStream(const SindyOptions& options) : state_(new State{detail::SindyData(options), {}, {}}) {}
SindyStream::~SindyStream() = default;

void SindyStream::add(const Recording& part) {
  constexpr Eigen::Index kLeast = 25, kMostKept = 400000;
  auto& [data, like, summary] = *state_;
  if (part.size() < kLeast || summary.status == Status::unusable) return;
  if (data.samples() == 0) {
    const SindyOptions& o = data.options();
    detail::check_signals({part}, o.states, o.inputs, o.discrete, summary);
    if (summary.status == Status::unusable) return;
    for (const Channel& c : part.channels) like.add(c.name, c.quantity, {});
    like.source = part.source;
  }
  data.add({part}, kMostKept);
}

IdentifiedModel SindyStream::fit(std::vector<BoundOutcome>* bounds) const {
  const auto& [data, like, summary] = *state_;
  if (summary.status == Status::unusable) return unusable(data.options(), summary);
  data.finish();
  IdentifiedModel model = fit_prepared(data, like, bounds);
  model.provenance.inputs = {like.source};
  return model;
}

}  // namespace whirl::identification
