#include "evidence/omitted_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "evidence/verdict.hpp"
#include "problem/rotor_equations.hpp"

namespace whirl::identification::detail {
namespace {

bool is(const std::string& term, RotorTermKind kind) { return term == name_of(kind).label; }

/// What is known of a term before the records.
struct Prior {
  double chance;    ///< share of rotors that have it
  double positive;  ///< share of these where the coefficient is positive
  /// Weight that a model with the term has at least, once the records do not speak against it: below two deviations
  /// the evidence for a common term is none, and it is as likely as not.
  double least;
};

/// Seals and journal bearings, springs beyond the cubic and warming are common. Cross coupling as a rule drives the
/// forward whirl (swirl with the rotation).
Prior prior_of(const std::string& term) {
  if (is(term, RotorTermKind::cross_coupled)) return {0.4, 0.8, 0.5};
  if (is(term, RotorTermKind::quintic_stiffness) || is(term, RotorTermKind::stiffness_drift)) return {0.4, 0.5, 0.5};
  return {0.1, 0.5, 0};
}

/// Sizes of the motion that the priors refer to.
struct Motion {
  double peak = 0, top_speed = 0, seconds = 0;
};

Motion motion_of(const OutputErrorFit& fit) {
  Motion m;
  for (const OutputErrorRecord& r : fit.records) {
    m.peak = std::max(m.peak, r.main.cwiseAbs().maxCoeff());
    m.top_speed = std::max(m.top_speed, r.angle.omega.cwiseAbs().maxCoeff());
    m.seconds = std::max(m.seconds, 0.5 * r.angle.dt * static_cast<double>(r.angle.beta.size()));
  }
  return m;
}

/// Standard deviation of a coefficient among rotors that have the term: forces of a size that does not hide the spring
/// and the damping; 0 for terms without such a prior.
double usual_size(const std::string& term, const RotorModel& rotor, const Motion& m) {
  const double w = std::sqrt(rotor.k1), c = std::abs(rotor.c), v = w * m.peak;
  if (term == "sensor gain" || term == "sensor angle") return 0.03;
  if (term == "probe curve") return 0.01 / (m.peak * m.peak);  // data sheets: about 1 % of the range
  if (term == "sampling skew") return 0;                       // converters differ: microseconds to a sample
  const auto name = std::find_if(kRotorTermNames.begin(), kRotorTermNames.end(),
                                 [&](const RotorTermName& n) { return n.label == term; });
  if (name == kRotorTermNames.end()) return 0;
  switch (name->kind) {
    case RotorTermKind::quintic_stiffness:  // the next term of a series in |z|^2
      return rotor.k2 * rotor.k2 / rotor.k1;
    case RotorTermKind::cubic_per_axis:  // a reading of its own
      return 0;
    case RotorTermKind::quadratic_damping:
      return c / v;
    case RotorTermKind::coulomb_friction:
      return 0.3 * c * v;
    case RotorTermKind::gyroscopic:
      return 0.05;
    case RotorTermKind::rotating_damping:
      return 0.3 * c;
    case RotorTermKind::cross_coupled:
      return 0.3 * c * w;
    case RotorTermKind::stiffness_with_speed:
      return 0.02 * rotor.k1 / m.top_speed;
    case RotorTermKind::damping_with_speed:
      return 0.5 * c / m.top_speed;
    case RotorTermKind::stiffness_drift:
      return 0.01 * rotor.k1 / m.seconds;
    case RotorTermKind::damping_drift:
      return 0.5 * c / m.seconds;
    case RotorTermKind::twice_forward_re:
    case RotorTermKind::twice_forward_im:
    case RotorTermKind::twice_backward_re:
    case RotorTermKind::twice_backward_im:
      return 0;  // couplings differ
  }
  return 0;
}

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
  constexpr double kWindow = 0.2;
  const double variance = scale * c.sd * c.sd, shrink = usual * usual / (usual * usual + variance);
  const double t2 = c.value * c.value / variance;
  const double evidence = std::sqrt(1 - shrink) * std::exp(std::min(0.5 * t2 * shrink, 50.0));
  const double mean = shrink * c.value, sd = std::sqrt(shrink * variance);
  const Prior prior = prior_of(c.term);
  double all = 0, square = 0;
  for (const double sign : {1.0, -1.0}) {
    const double of_sign = sign > 0 ? prior.positive : 1 - prior.positive;
    const Side side = positive_side(sign * mean, sd);
    const double factor = 2 * of_sign * evidence * side.share;
    if (factor < kWindow) continue;
    const double odds = prior.chance / (1 - prior.chance) * factor;
    all += odds;
    square += odds * side.mean_square;
  }
  return all > 0 ? Posterior{std::max(prior.least, all / (1 + all)) * square / all, all} : Posterior{};
}

/// The parameter that a term has in the model.
std::string parameter_of(const std::string& term) {
  if (term == "probe curve") return "sensor_cubic";
  for (const RotorTermName& n : kRotorTermNames)
    if (n.label == term) return std::string(n.parameter);
  std::string name = term;  // "sensor gain"
  std::ranges::replace(name, ' ', '_');
  return name;
}

/// The model with the term, by one step from the model without it; `before`: the estimates of that.
Alternative with_term(const Omitted& o, double scale, const NamedEstimates& before) {
  Alternative out{"with " + o.term->term, o.odds};
  const double value = o.term->value, sd = std::sqrt(scale) * o.term->sd;
  out.parameters.emplace_back(parameter_of(o.term->term), Estimate::from_sd(value, sd));
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
  const bool swirl = is(o.term->term, RotorTermKind::cross_coupled);
  const bool cubic = is(o.term->term, RotorTermKind::quintic_stiffness);
  const bool curve = o.term->term == "probe curve";
  Ambiguity open{
      fmt::format("without or with {}: too small to be seen in these records, not small enough to be excluded",
                  o.term->term),
      fmt::format("{} (standard deviations) without it, {} with it{}", without, with,
                  swirl ? "; the damping ratio is that of the forward whirl, c - k_cross / speed" : ""),
      swirl   ? "a free decay (blow) at rest and at speed"
      : cubic ? "a run with more unbalance"
      : curve ? "calibrate the probes over the whole orbit"
              : "a second run, or less noise"};
  open.alternatives.push_back(with_term(o, scale, before));
  result.model.ambiguities.push_back(std::move(open));
}

}  // namespace

void judge_sizes(const RotorIdentification& result, Summary& summary) {
  constexpr double kMost = 6;
  const Motion motion = motion_of(result.fit);
  const bool explained = std::max(result.chi_square_weak, result.fit.summary.chi_square) < 1.3;
  const double unstable = unstable_from(result.fit.model, result.fit.terms, motion.top_speed);
  for (const RotorTerm& t : result.fit.terms) {
    const RotorTermName& name = name_of(t.kind);
    // A whirl that is seen to grow by itself shows the size of what drives it.
    if (explained && std::isfinite(unstable) && drives_whirl(t.kind)) continue;
    RotorModel middle = result.fit.model;  // k1 and c hold at the start of a drift
    for (const RotorTerm& d : result.fit.terms) {
      if (d.kind == RotorTermKind::stiffness_drift) middle.k1 += 0.5 * motion.seconds * d.value;
      if (d.kind == RotorTermKind::damping_drift) middle.c += 0.5 * motion.seconds * d.value;
      if (d.kind == RotorTermKind::stiffness_with_speed) middle.k1 += 0.5 * motion.top_speed * d.value;
      if (d.kind == RotorTermKind::damping_with_speed) middle.c += 0.5 * motion.top_speed * d.value;
    }
    const double usual = std::abs(usual_size(std::string(name.label), middle, motion));
    if (!(usual > 0) || std::abs(t.value) <= kMost * usual) continue;
    summary.add({FindingCode::term_too_large,
                 Consequence::no_trust,
                 {{"value", t.value, std::string(name.unit)}, {"ratio", std::abs(t.value) / usual}},
                 fmt::format("{} ({} = {:.3g}{}{})", name.label, name.parameter, t.value, name.unit.empty() ? "" : " ",
                             name.unit)});
  }
}

void widen_for_omitted(const GrownRotor& grown, double scale, RotorIdentification& result) {
  IdentifiedModel& model = result.model;
  const RotorModel& rotor = *model.rotor;
  const Motion motion = motion_of(result.fit);
  std::vector<Omitted> omitted;
  for (const AbsentTerm& c : grown.absent) {
    const double usual = usual_size(c.term, rotor, motion);
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
