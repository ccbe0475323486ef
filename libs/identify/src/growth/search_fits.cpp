#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "growth/rotor_search.hpp"
#include "growth/term_sizes.hpp"
#include "whirl/core/parallel.hpp"

/// Fits of a growing model.
namespace whirl::identification::detail {
namespace {

constexpr int kMostSubsteps = 16;

/// Acceleration of the motion about the bow by the damping of the bow's own turning: -i c omega b e^{i beta}.
KnownForces bow_forces(const OutputErrorFit& fit) {
  KnownForces forces;
  for (const OutputErrorRecord& r : fit.records) {
    Eigen::VectorXcd force(r.angle.beta.size());
    for (Eigen::Index i = 0; i < force.size(); ++i) {
      force[i] =
          Complex(0, -(fit.model.c + r.c_change) * r.angle.omega[i]) * r.runout[0] * std::polar(1.0, r.angle.beta[i]);
    }
    forces.push_back(std::move(force));
  }
  return forces;
}

/// The model `g` with the values that a fit of it ended at.
Growth from(const Growth& g, const OutputErrorFit& found) {
  Growth on = g;
  on.start = found.model;
  on.delay = found.delay;
  on.active.terms = found.terms;
  on.active.probes.start = found.sensor;
  on.active.modes.decays = found.decays;
  on.active.clock.start_drift = found.clock_drift;
  return on;
}

}  // namespace

bool ran_out(const OutputErrorFit& fit, const Growth& growth) {
  return fit.summary.status != Status::unusable && fit.iterations >= growth.active.solver.max_iterations;
}

OutputErrorFit RotorSearch::fit(const Growth& g, const std::vector<Complex>& start_eps) const {
  const bool memorable = !g.bow && g.forces.empty();
  FitStart from_here{g.start, g.active, start_eps, g.delay};
  if (memorable)
    if (std::optional<OutputErrorFit> known = memory_.find(from_here)) return *std::move(known);
  OutputErrorFit found = fit_with_forces(records_, g.start, g.active, start_eps, g.delay, g.forces);
  if (memorable) memory_.keep(std::move(from_here), found);
  // The force of a bow follows from what is found: c and the bow change it by little.
  for (int pass = 0; g.bow && pass < 2 && found.summary.status != Status::unusable; ++pass) {
    OutputErrorOptions active = g.active;
    active.modes.decays = found.decays;
    active.terms = found.terms;
    active.probes.start = found.sensor;
    active.clock.start_drift = found.clock_drift;
    const std::vector<Complex> eps = start_of(found).eps;
    found = fit_with_forces(records_, found.model, active, eps, found.delay, bow_forces(found));
  }
  return found;
}
/// A fit that ran out of steps goes on from where it stands, as long as it would come below the chi-square `target`
/// at the pace of its last steps: the better term must not lose by them, and a hopeless one costs no second.
OutputErrorFit RotorSearch::fit_to_the_end(const Growth& g, OutputErrorFit found, double target) const {
  for (const auto& [steps, then] : {std::pair{20, 80}, std::pair{80, 0}}) {
    Growth on = from(g, found);
    on.active.solver.max_iterations = steps;
    OutputErrorFit further = fit(on, start_of(found).eps);
    const double before = found.summary.chi_square, after = further.summary.chi_square;
    if (further.summary.status == Status::unusable || !(after < before)) break;
    const bool converged = further.iterations < steps;
    found = std::move(further);
    if (converged || !(after * std::pow(after / before, double(then) / steps) < target)) break;
  }
  return found;
}
/// The better of two fits, from where the growing model stands and from `before`: without a large term the other
/// values are far from their place.
OutputErrorFit RotorSearch::fit_from_either(const Growth& g, const Start& before) const {
  Growth then = g;
  then.start = before.model;
  then.start.modes = g.start.modes;
  then.delay = g.active.clock.delay ? before.delay : g.delay;
  for (RotorTerm& t : then.active.terms) {
    const auto at = std::find_if(before.terms.begin(), before.terms.end(),
                                 [&](const RotorTerm& b) { return b.is(*t.entry) && b.part == t.part; });
    if (at == before.terms.end()) continue;
    t.value = at->value;
    if (t.entry->by_reference != nullptr) t.reference = at->reference;
  }
  OutputErrorFit here, there;
  parallel_for(2, std::min(most_, 2), [&](int other) {
    if (other)
      there = fit(then, before.eps);
    else
      here = fit(g);
  });
  const auto usable = [](const OutputErrorFit& f) { return f.summary.status != Status::unusable; };
  if (!usable(there)) return here;
  return usable(here) && here.summary.chi_square <= there.summary.chi_square ? here : there;
}
/// A fit with a force that begins at one instant, from where the weak equations put the model with it. The likelihood
/// has a maximum in every half period of the free motion that the change sets off: a few steps from each of those about
/// the instant given, then on from the best.
RotorSearch::Trial RotorSearch::fit_about_instant(Growth g, const ScoreCandidate& candidate) const {
  constexpr int kHalfPeriods = 3, kFewSteps = 4;
  const Eigen::VectorXd& moves = candidate.moves;
  const double half_period = std::numbers::pi / std::sqrt(g.start.k1);
  g.start.k1 += moves[0], g.start.k2 += moves[1], g.start.c += moves[2];
  std::vector<Complex> eps = eps_;
  for (std::size_t r = 0; r < eps.size(); ++r) {
    const auto at = 3 + 2 * static_cast<Eigen::Index>(r);
    eps[r] += Complex(moves[at], moves[at + 1]);
  }
  std::optional<OutputErrorFit> best;
  double cost = 0;
  for (int k = -kHalfPeriods; k <= kHalfPeriods; ++k) {
    Growth at = g;
    at.active.solver.max_iterations = kFewSteps;
    for (RotorTerm& t : at.active.terms)
      if (t.is(*candidate.term)) t.reference += k * half_period;
    OutputErrorFit found = fit(at, eps);
    cost += price(found, at);
    if (found.summary.status == Status::unusable) continue;
    if (!best || found.summary.chi_square < best->summary.chi_square) best = std::move(found);
  }
  if (!best) return {fit(g), cost};
  return {fit(from(g, *best), start_of(*best).eps), cost};
}
RotorSearch::Trial RotorSearch::trial_of(const Growth& with, const TermId& term, const ScoreTest& score) const {
  if (term.entry->by_reference != nullptr) return fit_about_instant(with, *score.find(*term.entry));
  return {fit(with)};
}

/// Likelihood ratio of two fits, in the metric of the residual that the larger one leaves.
double RotorSearch::gain(const OutputErrorFit& smaller, const OutputErrorFit& larger) const {
  return values_ * (smaller.summary.chi_square - larger.summary.chi_square) / std::max(1.0, larger.summary.chi_square);
}
/// Likelihood ratio less what the sizes of terms speak against the larger model.
double RotorSearch::plausible_gain(const OutputErrorFit& smaller, const OutputErrorFit& larger) const {
  return gain(smaller, larger) - surprise(larger) + surprise(smaller);
}
/// The next fit starts where this one ended.
void RotorSearch::settle() {
  growth_.start = fit_.model;
  growth_.active.modes.decays = fit_.decays;
  growth_.active.terms = fit_.terms;
  growth_.active.probes.start = fit_.sensor;
  for (std::size_t r = 0; r < eps_.size(); ++r) {
    if (!growth_.active.changes.k1.empty()) growth_.active.changes.k1[r] = fit_.records[r].k1_change;
    if (!growth_.active.changes.c.empty()) growth_.active.changes.c[r] = fit_.records[r].c_change;
  }
  growth_.delay = fit_.delay;
  growth_.active.clock.start_drift = fit_.clock_drift;
  if (growth_.bow) growth_.forces = bow_forces(fit_);
  for (std::size_t r = 0; r < eps_.size(); ++r) eps_[r] = fit_.records[r].eps;
}
/// The search compares fits of one grid.
void RotorSearch::keep_grid() {
  growth_.active.solver.substeps = fit_.substeps;
  grid_for_ = fit_.summary.chi_square;
}
/// A model that leaves less asks for a finer grid.
void RotorSearch::refine_grid() {
  constexpr double kLess = 0.5;
  if (fit_.substeps == kMostSubsteps || !(fit_.summary.chi_square < kLess * grid_for_)) return;
  settle();
  growth_.active.solver.substeps = 0;
  OutputErrorFit finer = fit(growth_);
  if (finer.summary.status != Status::unusable) fit_ = std::move(finer);
  keep_grid();
}

}  // namespace whirl::identification::detail
