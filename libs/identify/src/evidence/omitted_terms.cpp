#include "evidence/omitted_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "evidence/verdict.hpp"
#include "growth/term_sizes.hpp"
#include "problem/rotor_equations.hpp"
#include "rules/rules.hpp"

namespace whirl::identification::detail {
namespace {

/// One model with one more term, of either sign.
struct Omitted {
  const AbsentTerm* term;
  double mean_square;  ///< of the coefficient, a posteriori
  double odds;         ///< of the model with the term
};

/// Mean square of a normal variable restricted to the positive side, and the share that lies there.
struct Side {
  double share, mean_square;
};
Side positive_side(double mean, double sd) {
  const double a = mean / sd, share = 0.5 * std::erfc(-a / std::numbers::sqrt2);
  const double hazard =
      a > -8 ? std::exp(-0.5 * a * a) / (std::sqrt(2 * std::numbers::pi) * share) : -a - 1 / a;  // Mills, tail
  const double first = mean + sd * hazard;
  return {share, sd * sd + mean * first};
}

/// Mean square of the coefficient of `c`, a posteriori: each sign is a model of its own beside the one without the
/// term. A model that the records speak against is left out (Occam's window, Madigan and Raftery 1994); where they are
/// too weak to speak, the Bayes factor stays near 1 and it counts. 0.2 is where docs/validation.md finds the balance.
struct Posterior {
  double mean_square = 0, odds = 0;
};
Posterior posterior(const AbsentTerm& c, double usual, double scale) {
  const double variance = scale * c.sd * c.sd, shrink = usual * usual / (usual * usual + variance);
  const double t2 = c.value * c.value / variance;
  const double evidence = std::sqrt(1 - shrink) * std::exp(std::min(0.5 * t2 * shrink, 50.0));
  const double mean = shrink * c.value, sd = std::sqrt(shrink * variance);
  const TermPrior& prior = c.term->prior;
  // A rare part of the machine (not the probes, which all drift a little) counts where the record hints at it, or
  // cannot tell it from none: else chance alone would decide which of two alike rotors gets the wider interval.
  if (c.term->rare && c.term->force != nullptr && t2 < rules::kSpeaks * rules::kSpeaks &&
      variance < rules::kTells * rules::kTells * usual * usual)
    return {};
  double all = 0, square = 0;
  for (const double sign : {1.0, -1.0}) {
    const double of_sign = sign > 0 ? prior.positive : 1 - prior.positive;
    const Side side = positive_side(sign * mean, sd);
    const double factor = 2 * of_sign * evidence * side.share;
    if (factor < rules::kWindow) continue;
    const double odds = prior.chance / (1 - prior.chance) * factor;
    all += odds;
    square += odds * side.mean_square;
  }
  return all > 0 ? Posterior{std::max(prior.least, all / (1 + all)) * square / all, all} : Posterior{};
}

/// The model with the term, by one step from the model without it; `before`: the estimates of that.
Alternative with_term(const Omitted& o, double scale, const NamedEstimates& before) {
  Alternative out{fmt::format("with {}", o.term->term->label), o.odds};
  const double value = o.term->value, sd = std::sqrt(scale) * o.term->sd;
  out.parameters.emplace_back(std::string(o.term->term->parameters.front().name), Estimate::from_sd(value, sd));
  constexpr std::array kMoved{"k1", "k2", "c"};
  for (std::size_t i = 0; i < kMoved.size(); ++i) {
    const Estimate& e = std::ranges::find(before, kMoved[i], &NamedEstimates::value_type::first)->second;
    const double per = o.term->moves[static_cast<Eigen::Index>(i)];
    out.parameters.emplace_back(kMoved[i], Estimate::from_sd(e.value + per * value, std::hypot(e.sd, per * sd)));
  }
  return out;
}

void widen(Estimate& e, double variance) {
  if (!std::isfinite(e.sd) || !(variance > 0)) return;
  e = Estimate::from_sd(e.value, std::hypot(e.sd, std::sqrt(variance)));
}

/// What an omitted term does to k1, k2 and c beyond their interval without it, as an ambiguity; nothing when it does
/// little.
void state(const Omitted& o, double scale, const NamedEstimates& before, RotorIdentification& result) {
  constexpr std::array<std::pair<const char*, const char*>, 3> kRotor{
      {{"k1", "1/s^2"}, {"k2", "1/(m^2 s^2)"}, {"c", "1/s"}}};
  std::string without, with;
  for (std::size_t i = 0; i < kRotor.size(); ++i) {
    const auto [name, unit] = kRotor[i];
    const Estimate& e = std::ranges::find(before, name, &NamedEstimates::value_type::first)->second;
    const double more = std::sqrt(o.mean_square) * std::abs(o.term->moves[static_cast<Eigen::Index>(i)]);
    if (!(more > e.sd)) continue;
    const char* comma = with.empty() ? "" : ", ";
    without += fmt::format("{}{} {:.6g} +- {:.2g} {}", comma, name, e.value, e.sd, unit);
    with += fmt::format("{}+- {:.2g} {}", comma, std::hypot(e.sd, more), unit);
  }
  if (with.empty()) return;
  const TermEntry& entry = *o.term->term;
  Ambiguity open{
      fmt::format("without or with {}: too small to be seen in these records, not small enough to be excluded",
                  entry.label),
      fmt::format("{} (standard deviations) without it, {} with it{}", without, with, entry.hidden_note),
      std::string(entry.hidden_decider)};
  open.alternatives.push_back(with_term(o, scale, before));
  result.model.ambiguities.push_back(std::move(open));
}

}  // namespace

void judge_sizes(const RotorIdentification& result, Summary& summary) {
  const OutputErrorFit& fit = result.fit;
  const bool explained = std::max(result.chi_square_weak, fit.summary.chi_square) < rules::kModelError;
  const double unstable = unstable_from(fit.model, fit.terms, scale_of(fit.model, fit).top_speed);
  for (const TermSize& s : sizes_of(fit)) {
    // A whirl that is seen to grow by itself shows the size of what drives it.
    if (s.ratio() <= rules::kTooLarge || (explained && std::isfinite(unstable) && s.entry->drives_whirl)) continue;
    const std::string unit(s.unit);
    summary.add(
        {FindingCode::term_too_large,
         Consequence::no_trust,
         {{"value", s.value, unit}, {"ratio", s.ratio()}},
         fmt::format("{} ({} = {:.3g}{}{})", s.entry->label, s.parameter, s.value, unit.empty() ? "" : " ", unit)});
  }
}

void widen_for_omitted(const GrownRotor& grown, double scale, RotorIdentification& result) {
  IdentifiedModel& model = result.model;
  const TermScale sizes = scale_of(*model.rotor, result.fit);
  std::vector<Omitted> omitted;
  for (const AbsentTerm& c : grown.absent) {
    const double usual = c.term->usual(sizes);
    if (!(usual > 0) || !(c.sd > 0)) continue;
    if (const Posterior p = posterior(c, usual, scale); p.mean_square > 0)
      omitted.push_back({&c, p.mean_square, p.odds});
  }
  const auto size = static_cast<Eigen::Index>(3 + 2 * result.fit.records.size());
  Eigen::MatrixXd more = Eigen::MatrixXd::Zero(size, size);
  for (const Omitted& o : omitted) more += o.mean_square * o.term->moves * o.term->moves.transpose();

  for (const Omitted& o : omitted) state(o, scale, model.parameters, result);

  // natural_frequency and damping_ratio stay: they are those of the forward whirl as these records passed it.
  for (auto& [name, e] : model.parameters) {
    if (name == "k1") widen(e, more(0, 0));
    if (name == "k2") widen(e, more(1, 1));
    if (name == "c") widen(e, more(2, 2));
  }
  for (std::size_t r = 0; r < result.fit.records.size(); ++r) {
    const std::string suffix = r == 0 ? "" : fmt::format("_{}", r + 1);
    const Eigen::Matrix2d own =
        more.block<2, 2>(3 + 2 * static_cast<Eigen::Index>(r), 3 + 2 * static_cast<Eigen::Index>(r));
    const std::complex<double> eps = result.fit.records[r].eps;
    const double length = std::abs(eps);
    const Eigen::Vector2d along(eps.real() / length, eps.imag() / length), across(-along[1], along[0]);
    for (auto& [name, e] : model.parameters) {
      if (name == "e" + suffix) widen(e, along.dot(own * along));
      if (name == "e_phase" + suffix) widen(e, across.dot(own * across) / (length * length));
    }
  }
  if (model.rotor_covariance.size() != 25) return;
  for (Eigen::Index i = 0; i < 5; ++i) {
    for (Eigen::Index j = 0; j < 5; ++j) model.rotor_covariance[static_cast<std::size_t>(5 * i + j)] += more(i, j);
  }
}

}  // namespace whirl::identification::detail
