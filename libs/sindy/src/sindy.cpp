#include "whirl/sindy/sindy.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "channel_units.hpp"
#include "record_quality.hpp"
#include "sindy_prepare.hpp"
#include "sindy_refine.hpp"
#include "whirl/core/error.hpp"

namespace whirl {
namespace {

void check(const std::vector<Recording>& records) {
  if (records.empty()) throw Error("no record to identify from");
  for (const Recording& r : records) {
    if (std::abs(r.dt - records.front().dt) > 1e-9 * r.dt) {
      throw Error(fmt::format("{}: sample time {:g} s, {:g} s in the first record: must be equal", r.source, r.dt,
                              records.front().dt));
    }
  }
}

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

/// Range of every state in the records, for the statement of trust.
std::string ranges(const detail::SindyData& data) {
  std::vector<std::string> text;
  for (std::size_t k = 0; k < data.options().states.size(); ++k) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const detail::Stretch& s : data.stretches()) {
      low = std::min(low, s.smooth.col(static_cast<Eigen::Index>(k)).minCoeff());
      high = std::max(high, s.smooth.col(static_cast<Eigen::Index>(k)).maxCoeff());
    }
    text.push_back(fmt::format("{} from {:.3g} to {:.3g}", data.options().states[k], low, high));
  }
  return fmt::format("{}", fmt::join(text, ", "));
}

/// Verdict on equations that stand by regression alone (maps, or without refinement): `summary.residual` is the share of
/// the left-hand side that no term explains.
void judge_regression(const detail::SindyData& data, IdentifiedModel& model) {
  constexpr double kWarn = 0.1, kFail = 0.5;
  Summary& s = model.summary;
  if (!(s.residual < kFail)) {
    s.fail(fmt::format("the terms leave {:.0f} % of a left-hand side unexplained (rms)", 100 * s.residual));
  } else if (s.residual > kWarn) {
    s.warn(fmt::format("the terms leave {:.0f} % of a left-hand side unexplained (rms): noise in the columns biases the "
                       "coefficients",
                       100 * s.residual));
  }
  s.trust = s.status == Status::unusable
                ? "Do not use this model."
                : fmt::format("Trust the {} for states seen in the records ({}), to {:.2g} % rms.",
                              data.options().discrete ? "next values" : "rates", ranges(data), 100 * s.residual);
}

/// Verdict after refinement. `horizon`: length of the free runs that the model follows, s.
void judge_refined(const detail::SindyData& data, const Eigen::VectorXd& weight, bool noisy, double horizon,
                   IdentifiedModel& model) {
  Summary& s = model.summary;
  double share = 0;  // mean square of weight / spread
  for (Eigen::Index k = 0; k < weight.size(); ++k) {
    double rows = 0, mean = 0, squares = 0;
    for (const detail::Stretch& stretch : data.stretches()) {
      rows += static_cast<double>(stretch.samples());
      mean += stretch.raw.col(k).sum();
    }
    mean /= rows;
    for (const detail::Stretch& stretch : data.stretches()) squares += (stretch.raw.col(k).array() - mean).square().sum();
    share += weight[k] * weight[k] * rows / squares / static_cast<double>(weight.size());
  }
  const double unexplained = std::sqrt(std::max(0.0, s.chi_square - 1) * share);
  if (horizon <= 0) {
    s.fail("free runs of the weak-form model diverge within 10 samples");
  } else if (!(unexplained < 0.15)) {
    s.fail(fmt::format("free runs of {:.3g} s leave {:.0f} % of the motion unexplained beyond the noise: a state, an input or "
                       "a term is missing",
                       horizon, 100 * unexplained));
  } else if (noisy && s.chi_square > 1.3) {
    s.warn(fmt::format("model error: chi-square {:.2f} (1 when the model fits), {:.2g} % of the motion unexplained", s.chi_square,
                       100 * unexplained));
  } else if (unexplained > 0.01) {
    s.warn(fmt::format("model error: {:.2g} % of the motion unexplained", 100 * unexplained));
  }
  double longest = 0;
  for (const detail::Stretch& stretch : data.stretches()) {
    longest = std::max(longest, stretch.dt * static_cast<double>(stretch.samples()));
  }
  if (data.rate() * longest < 6) {
    s.warn(fmt::format("the longest record holds {:.2g} characteristic periods: slow terms are weakly determined",
                       data.rate() * longest / 6.283185307179586));
  }
  if (!noisy) s.chi_square = std::numeric_limits<double>::quiet_NaN();
  s.trust = s.status == Status::unusable
                ? "Do not use this model."
                : fmt::format("Trust free runs of up to {:.3g} s in the range of the records ({}); beyond it the terms are an "
                              "extrapolation.",
                              std::min(horizon, longest), ranges(data));
}

IdentifiedModel fit_prepared(const detail::SindyData& data, const Recording& like) {
  const SindyOptions& options = data.options();
  std::vector<Equation> alternatives;  // other supports on the path of the regression
  IdentifiedModel model = detail::regress(data, options.solver, &alternatives);
  const bool any_term = std::any_of(model.equations.begin(), model.equations.end(), [&](const Equation& e) {
    return data.candidates().contains(e.lhs) && !e.terms.empty();
  });
  if (!data.candidates().empty() && !any_term) {
    model.summary.fail("no candidate term explains any left-hand side");
    model.summary.trust = "Do not use this model.";
    return model;
  }
  if (options.discrete || !options.refine || data.candidates().empty()) {
    detail::set_coefficient_units(model, like);
    judge_regression(data, model);
    return model;
  }
  // Below this share of the signal the integration error of the samples, not the noise, limits the fit.
  Eigen::VectorXd weight = data.noise_sd();
  bool noisy = true;
  for (Eigen::Index k = 0; k < weight.size(); ++k) {
    double energy = 0, rows = 0;
    for (const detail::Stretch& s : data.stretches()) {
      energy += s.raw.col(k).squaredNorm();
      rows += static_cast<double>(s.samples());
    }
    const double floor = 1e-6 * std::sqrt(energy / rows);
    noisy = noisy && weight[k] > floor;
    weight[k] = std::max(weight[k], floor);
  }
  const double horizon = detail::refine_and_select(model, data.candidates(), alternatives, data.stretches(), weight,
                                                   data.rate(), options);
  detail::set_coefficient_units(model, like);
  judge_refined(data, weight, noisy, horizon, model);
  return model;
}

}  // namespace

IdentifiedModel fit_sindy(const std::vector<Recording>& records, const SindyOptions& options) {
  check(records);
  detail::SindyData data(options);
  Summary summary;
  detail::check_signals(records, options.states, options.inputs, options.discrete, summary);
  if (summary.status == Status::unusable) return unusable(options, std::move(summary));
  data.add(records, std::numeric_limits<Eigen::Index>::max());
  data.finish();
  IdentifiedModel model = fit_prepared(data, records.front());
  for (const Recording& r : records) model.provenance.inputs.push_back(r.source);
  return model;
}

IdentifiedModel fit_sindy_stream(const RecordingSource& next, const SindyOptions& options) {
  detail::SindyData data(options);
  Recording part, like;
  while (next(part)) {
    Summary summary;
    if (data.samples() == 0) {
      detail::check_signals({part}, options.states, options.inputs, options.discrete, summary);
      if (summary.status == Status::unusable) return unusable(options, std::move(summary));
      for (const Channel& c : part.channels) like.add(c.name, c.quantity, {});
      like.source = part.source;
    }
    data.add({part}, 400000);
  }
  data.finish();
  IdentifiedModel model = fit_prepared(data, like);
  model.provenance.inputs = {like.source};
  return model;
}

}  // namespace whirl
