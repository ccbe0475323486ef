#include "evidence/sindy_verdict.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "evidence/verdict.hpp"
#include "rules/rules.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification::detail {
namespace {

/// Range of every state in the records, for the statement of trust.
std::string ranges(const SindyData& data) {
  std::vector<std::string> text;
  for (std::size_t k = 0; k < data.options().states.size(); ++k) {
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Stretch& s : data.stretches()) {
      low = std::min(low, s.smooth.col(static_cast<Eigen::Index>(k)).minCoeff());
      high = std::max(high, s.smooth.col(static_cast<Eigen::Index>(k)).maxCoeff());
    }
    text.push_back(fmt::format("{} from {:.3g} to {:.3g}", data.options().states[k], low, high));
  }
  return fmt::format("{}", fmt::join(text, ", "));
}

std::string text_of(const Equation& e) {
  std::string text;
  for (const EquationTerm& t : e.terms) {
    const double value = t.coefficient.value;
    const char* const sign = value < 0 ? "-" : "+";
    text += text.empty() ? (value < 0 ? "-" : "") : fmt::format(" {} ", sign);
    text += t.function == "1" ? fmt::format("{:.3g}", std::abs(value))
                              : fmt::format("{:.3g} {}", std::abs(value), t.function);
  }
  return text;
}

/// Whether no candidate is a product of three states and inputs: the library of many variables goes no further than
/// two.
bool ends_at_squares(const SindyData& data) {
  const SindyOptions& o = data.options();
  std::vector<std::string> names = o.states;
  names.insert(names.end(), o.inputs.begin(), o.inputs.end());
  std::set<std::string> cubes;
  for (const expr::Expr& e : expr::polynomial_library(names, 3)) cubes.insert(e.str());
  for (const expr::Expr& e : expr::polynomial_library(names, 2)) cubes.erase(e.str());
  for (const auto& [lhs, terms] : data.candidates()) {
    for (const expr::Expr& e : terms) {
      if (cubes.contains(e.str())) return false;
    }
  }
  return true;
}

/// Warns of equations whose terms the records cannot tell from others.
void judge_rivals(const std::vector<Alike>& rivals, bool noisy, Summary& summary) {
  std::vector<std::string> said;
  for (const Alike& r : rivals) {
    if (std::find(said.begin(), said.end(), r.equation.lhs) != said.end()) continue;
    said.push_back(r.equation.lhs);
    const auto more =
        std::count_if(rivals.begin(), rivals.end(), [&](const Alike& o) { return o.equation.lhs == r.equation.lhs; }) -
        1;
    summary.warn(fmt::format(
        "these records cannot tell the terms of {}: {} = {} explains them as well ({}){}; records from other starts, "
        "with other forces or with less noise would",
        r.equation.lhs, r.equation.lhs, text_of(r.equation),
        noisy ? fmt::format("chi-square {:.3g}, this model {:.3g}", r.chi_square, summary.chi_square)
              : fmt::format("its error is {:.3g} times this model's", std::sqrt(r.chi_square / summary.chi_square)),
        more > 0 ? fmt::format(", and so do {} more", more) : ""));
  }
}

}  // namespace

OutputWeights output_weights(const SindyData& data, const Eigen::VectorXd& correlation) {
  OutputWeights weights{data.noise_sd(), true, correlation};
  for (Eigen::Index k = 0; k < weights.sd.size(); ++k) {
    double energy = 0, rows = 0, noise = 0;
    for (const Stretch& s : data.stretches()) {
      if (weights.correlation_of(k) != 0)
        noise += static_cast<double>(s.samples()) * std::pow(signal::innovation_sd(s.raw.col(k), correlation[k]), 2);
      energy += s.raw.col(k).squaredNorm();
      rows += static_cast<double>(s.samples());
    }
    if (weights.correlation_of(k) != 0) weights.sd[k] = std::sqrt(noise / rows);
    const double floor = 1e-6 * std::sqrt(energy / rows);
    weights.noisy = weights.noisy && weights.sd[k] > floor;
    weights.sd[k] = std::max(weights.sd[k], floor);
  }
  return weights;
}

void judge_regression(const SindyData& data, IdentifiedModel& model) {
  Summary& s = model.summary;
  if (!(s.residual < rules::kLost)) {
    s.fail(fmt::format("the terms leave {:.0f} % of a left-hand side unexplained (rms)", 100 * s.residual));
  } else if (s.residual > rules::kRegressionPoor) {
    s.warn(
        fmt::format("the terms leave {:.0f} % of a left-hand side unexplained (rms): noise in the columns biases the "
                    "coefficients",
                    100 * s.residual));
  }
  set_trust(fmt::format("Trust the {} for states seen in the records ({}), to {:.2g} % rms.",
                        data.options().discrete ? "next values" : "rates", ranges(data), 100 * s.residual),
            s);
}

void judge_refined(const SindyData& data, const OutputWeights& weights, const Followed& followed,
                   const LeastExplained& least, IdentifiedModel& model) {
  // Of records without noise: more than the steps may leave (substeps.cpp).
  const double step_error = model.inputs.empty() ? 3e-5 : 3e-4;
  const bool noisy = weights.noisy;
  Summary& s = model.summary;
  double worst = 0;  // residual of a state over its noise, squared
  double total = 0;  // mean square of what free runs leave unexplained beyond the noise, by the motion
  for (Eigen::Index k = 0; k < followed.output_rmse.size(); ++k) {
    double rows = 0, mean = 0, squares = 0;
    for (const Stretch& stretch : data.stretches()) {
      rows += static_cast<double>(stretch.samples());
      mean += stretch.raw.col(k).sum();
    }
    mean /= rows;
    for (const Stretch& stretch : data.stretches()) squares += (stretch.raw.col(k).array() - mean).square().sum();
    const double rmse = followed.output_rmse[k];
    worst = std::max(worst, rmse * rmse);
    // Slow motion is 1 - correlation of itself in what is new from sample to sample.
    const double weight = weights.sd[k] / (1 - weights.correlation_of(k));
    total += std::max(0.0, rmse * rmse - 1) * weight * weight * rows / squares / static_cast<double>(weights.sd.size());
  }
  const double unexplained = std::sqrt(total), horizon = followed.horizon, period = 2 * std::numbers::pi / data.rate();
  const std::string missing =
      fmt::format(
          "a state, an input or a term is missing, or a signal that is driven from outside was taken for a state and "
          "should "
          "be an input{}",
          least.lhs.empty() ? ""
                            : fmt::format("; least explained is {} ({:.0f} % left)", least.lhs, 100 * least.residual)) +
      (ends_at_squares(data) ? "; the candidates hold no term of degree 3" : "");
  if (horizon <= 0) {
    s.fail("free runs of the model diverge at once: " + missing);
  } else if (judge_unexplained(unexplained, fmt::format("free runs of {:.3g} s leave", horizon), missing, s)) {
    if (horizon < 0.24 * period) {
      s.fail(fmt::format("the model follows the records for {:.3g} s only, {:.2g} of a characteristic period: {}",
                         horizon, horizon / period, missing));
    } else if (noisy) {
      // How far the residual of the worst state exceeds its noise; that is known to some percent only.
      judge_chi_square(std::max(s.chi_square, worst),
                       fmt::format(", {:.2g} % of the motion unexplained", 100 * unexplained), s);
    } else if (unexplained > step_error) {
      s.warn(
          fmt::format("model error: {:.2g} % of the motion unexplained in records without noise: the terms replace "
                      "others within the range of the records",
                      100 * unexplained));
    }
  }
  double longest = 0;
  for (const Stretch& stretch : data.stretches()) {
    longest = std::max(longest, stretch.dt * static_cast<double>(stretch.samples()));
  }
  if (data.rate() * longest < 6) {
    s.warn(fmt::format("the longest record holds {:.2g} characteristic periods: slow terms are weakly determined",
                       data.rate() * longest / (2 * std::numbers::pi)));
  }
  judge_rivals(followed.rivals, noisy, s);
  if (!noisy) s.chi_square = std::numeric_limits<double>::quiet_NaN();
  set_trust(fmt::format("Trust free runs of up to {:.3g} s {} ({}); beyond {} the terms are an extrapolation.",
                        std::min(horizon, longest),
                        followed.rivals.empty() ? "in the range of the records" : "along motions like those recorded",
                        ranges(data), followed.rivals.empty() ? "it" : "them"),
            s);
}

}  // namespace whirl::identification::detail
