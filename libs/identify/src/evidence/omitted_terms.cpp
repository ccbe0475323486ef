#include "evidence/omitted_terms.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "evidence/verdict.hpp"

namespace whirl::identification::detail {
namespace {

bool is(const std::string& term, RotorTermKind kind) { return term == name_of(kind).label; }

/// Forward whirl through one critical speed hardly tells cross-coupled stiffness from damping, one passage not a
/// stiffness that was another at the start, and a small motion not where the series of the spring ends: these take part
/// whatever the evidence.
bool always_possible(const std::string& term) {
  return is(term, RotorTermKind::cross_coupled) || is(term, RotorTermKind::quintic_stiffness) ||
         is(term, RotorTermKind::stiffness_drift);
}

/// Share of rotors that have the term. Seals and journal bearings, springs beyond the cubic and warming are common.
double chance_of(const std::string& term) { return always_possible(term) ? 0.4 : 0.1; }

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
  }
  return 0;
}

/// One model with one more term.
struct Omitted {
  const ScoreCandidate* candidate;
  double chance;                  ///< a posteriori
  double mean_square, shift, sd;  ///< of the coefficient, a posteriori
};

void widen(Estimate& e, double variance) {
  if (!std::isfinite(e.sd) || !(variance > 0)) return;
  e = Estimate::from_sd(e.value, std::hypot(e.sd, std::sqrt(variance)));
}

}  // namespace

void judge_sizes(const RotorIdentification& result, Summary& summary) {
  constexpr double kMost = 6;
  const Motion motion = motion_of(result.fit);
  for (const RotorTerm& t : result.fit.terms) {
    const RotorTermName& name = name_of(t.kind);
    RotorModel middle = result.fit.model;  // k1 and c hold at the start of a drift
    for (const RotorTerm& d : result.fit.terms) {
      if (d.kind == RotorTermKind::stiffness_drift) middle.k1 += 0.5 * motion.seconds * d.value;
      if (d.kind == RotorTermKind::damping_drift) middle.c += 0.5 * motion.seconds * d.value;
      if (d.kind == RotorTermKind::stiffness_with_speed) middle.k1 += 0.5 * motion.top_speed * d.value;
      if (d.kind == RotorTermKind::damping_with_speed) middle.c += 0.5 * motion.top_speed * d.value;
    }
    const double usual = std::abs(usual_size(std::string(name.label), middle, motion));
    if (!(usual > 0) || std::abs(t.value) <= kMost * usual) continue;
    summary.warn(fmt::format(
        "{} ({} = {:.3g}{}{}) is {:.2g} times what rotors with such a term have: it stands for "
        "something that the model lacks, and takes other parameters with it",
        name.label, name.parameter, t.value, name.unit.empty() ? "" : " ", name.unit, std::abs(t.value) / usual));
    set_trust("Do not trust this model beyond these records: a term of a size that rotors do not have drives it.",
              summary);
  }
}

void widen_for_omitted(const GrownRotor& grown, double scale, RotorIdentification& result) {
  IdentifiedModel& model = result.model;
  const RotorModel& rotor = *model.rotor;
  const Motion motion = motion_of(result.fit);
  std::vector<Omitted> omitted;
  for (const ScoreCandidate& c : grown.test.candidates) {
    const double usual = usual_size(c.term, rotor, motion);
    if (!(usual > 0) || !(c.sd > 0) || c.moves.size() == 0) continue;
    const double variance = scale * c.sd * c.sd, shrink = usual * usual / (usual * usual + variance);
    const double t2 = c.value * c.value / variance;
    const double evidence = std::sqrt(1 - shrink) * std::exp(std::min(0.5 * t2 * shrink, 50.0));
    const double mean = shrink * c.value, sd = std::sqrt(shrink * variance);
    if (result.added.empty() && evidence < 0.7 && !always_possible(c.term)) continue;
    const double odds = chance_of(c.term) / (1 - chance_of(c.term)) * evidence;
    // As likely as not: evidence of less than two deviations is none.
    const double least = always_possible(c.term) ? 0.5 : 0.0;
    omitted.push_back({&c, std::max(least, odds / (1 + odds)), mean * mean + sd * sd, mean, sd});
  }
  const auto size = static_cast<Eigen::Index>(3 + 2 * result.fit.records.size());
  Eigen::MatrixXd more = Eigen::MatrixXd::Zero(size, size);
  for (const Omitted& o : omitted)
    more += o.chance * o.mean_square * o.candidate->moves * o.candidate->moves.transpose();

  for (auto& [name, e] : model.parameters) {
    if (name == "k1") widen(e, more(0, 0));
    if (name == "k2") widen(e, more(1, 1));
    if (name == "c") widen(e, more(2, 2));
    if (name == "natural_frequency") widen(e, more(0, 0) / (4 * rotor.k1));
    if (name == "damping_ratio") widen(e, more(2, 2) / (4 * rotor.k1));
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
