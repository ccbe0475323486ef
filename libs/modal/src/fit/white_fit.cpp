#include "white_fit.hpp"

#include <algorithm>
#include <cmath>

#include "fit/scatter/scatter.hpp"
#include "residual_search.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "work.hpp"

namespace whirl::modal {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

constexpr int kSearchRounds = 20;

double frequency_of(Complex p) { return std::abs(p) / (2 * kPi); }
double damping_of(Complex p) { return -p.real() / std::abs(p); }

Poles moved(const Poles& poles, const VectorXd& step, const Band& band, const std::vector<Tie>& ties) {
  Poles result = poles;
  const std::size_t free = poles.size() - ties.size();
  for (std::size_t k = 0; k < free; ++k) {
    const double half_width = band.decay - poles[k].real();
    Complex change(step[2 * static_cast<Index>(k)], step[2 * static_cast<Index>(k) + 1]);
    // The linearisation holds over a fraction of the peak: longer steps are shortened.
    if (std::abs(change) > half_width) change *= half_width / std::abs(change);
    const Complex p = poles[k] + change;
    result[k] = {std::min(p.real(), 0.1 * poles[k].real()), p.imag()};
  }
  for (std::size_t i = 0; i < ties.size(); ++i) result[free + i] = ties[i].of(result);
  return result;
}

// True when a step would move no pole inside the band by more than a small part of its standard deviation. (Poles
// outside stand for what the residuals cannot; they may creep along a flat valley for long.)
bool is_small(const Band& band, const Poles& poles, const MatrixXd& inverse, const VectorXd& step, double variance) {
  for (std::size_t k = 0; 2 * k < static_cast<std::size_t>(step.size()); ++k) {
    const double f = frequency_of(poles[k]);
    if (f < band.low || f > band.high) continue;
    for (const Index i : {2 * static_cast<Index>(k), 2 * static_cast<Index>(k) + 1}) {
      if (step[i] * step[i] > 0.05 * 0.05 * variance * inverse(i, i)) return false;
    }
  }
  return true;
}

}  // namespace

MatrixXd tie_slopes(std::size_t poles, const std::vector<Tie>& ties) {
  const auto all = 2 * static_cast<Index>(poles), free = all - 2 * static_cast<Index>(ties.size());
  MatrixXd slopes = MatrixXd::Identity(all, free);
  for (std::size_t i = 0; i < ties.size(); ++i) {
    const Index row = free + 2 * static_cast<Index>(i), column = 2 * static_cast<Index>(ties[i].parent);
    const Index other = 2 * static_cast<Index>(ties[i].other);
    slopes(row, column) += ties[i].decay;
    slopes(row + 1, column + 1) += ties[i].turn;
    slopes(row, other) += ties[i].other_decay;
    slopes(row + 1, other + 1) += ties[i].other_turn;
  }
  return slopes;
}

double freedom(const Band& band, const Poles& poles, const ResidualTerms& terms) {
  const auto n = static_cast<double>(poles.size());
  return static_cast<double>(2 * band.lines() * band.channels()) -
         static_cast<double>(band.channels()) * (2 * n + static_cast<double>(terms.count())) - 2 * n;
}

double least_variance(const Band& band) {
  const double size = band.energy >= 0 ? band.energy : (band.h.array().abs2() * band.weight.array().square()).sum();
  return 1e-10 * size / static_cast<double>(2 * band.h.size());
}

double noise_variance(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit) {
  return std::max(fit.total() / freedom(band, poles, terms), least_variance(band));
}

Refined refine(const Band& band, const Poles& start, std::size_t started, const ResidualTerms& terms, int iterations,
               const std::vector<Tie>& ties) {
  Refined best{start, fit_poles(band, start, terms, true)};
  best.started = started;
  best.ties = ties;
  const MatrixXd slopes = tie_slopes(start.size(), ties);
  double damping = 1e-5, growth = 3;
  for (int iteration = 0; iteration < iterations && !best.converged && !best.poles.empty(); ++iteration) {
    const MatrixXd jtj = ties.empty() ? best.fit.jtj : MatrixXd(slopes.transpose() * best.fit.jtj * slopes);
    const VectorXd jtr = ties.empty() ? best.fit.jtr : VectorXd(slopes.transpose() * best.fit.jtr);
    const VectorXd scale = jtj.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    MatrixXd a = scale.asDiagonal() * jtj * scale.asDiagonal();
    a.diagonal().array() += damping;
    const Eigen::LDLT<MatrixXd> factor(a);
    const VectorXd step = scale.asDiagonal() * factor.solve(scale.asDiagonal() * jtr);
    if (!step.allFinite()) break;
    const double variance = noise_variance(band, best.poles, terms, best.fit);
    const double gain = step.dot(jtr);
    const MatrixXd inverse = scale.asDiagonal() * factor.solve(MatrixXd(scale.asDiagonal()));
    if (gain < 0.03 * variance * static_cast<double>(best.poles.size()) ||
        is_small(band, best.poles, inverse, step, variance)) {
      best.converged = true;
      break;
    }
    const double predicted = gain + damping * step.cwiseQuotient(scale).squaredNorm();
    Refined next{moved(best.poles, step, band, ties), {}};
    next.fit = fit_poles(band, next.poles, terms, true);
    const double real = best.fit.total() - next.fit.total();
    if (real > 0) {
      const double ratio = std::min(1.0, real / predicted);
      damping = std::max(1e-12, damping * std::max(1.0 / 10, 1 - std::pow(2 * ratio - 1, 3)));
      growth = 3;
      best.poles = std::move(next.poles);
      best.fit = std::move(next.fit);
    } else {
      damping *= growth;
      growth *= 3;
      if (damping > 1e6) best.converged = true;
    }
  }
  best.residual = residual_of(band, best.poles, terms, best.fit);
  const bool clean = noise_variance(band, best.poles, terms, best.fit) <= least_variance(band);
  best.correlated = clean ? 1 : correlated_lines(band, best.residual);
  return best;
}

double description_length(const Band& band, const Refined& state, const ResidualTerms& terms, double lines) {
  const double tied = 2 * static_cast<double>(state.ties.size());
  return description_length(band, state.fit, state.poles.size(), terms, lines) -
         tied * std::log(2 * static_cast<double>(band.h.size()) / lines);
}

double chance_gain(double channels) {
  constexpr double kDeviations = 6.5;
  const double freedom = 2 * channels + 2, spread = 2 / (9 * freedom);
  const double quantile = freedom * std::pow(1 - spread + kDeviations * std::sqrt(spread), 3);
  return std::clamp(quantile / (2 * channels), 6.0, 25.0);
}

double independent_channels(const Band& band, const Eigen::MatrixXcd& residual) {
  const Eigen::MatrixXcd weighted = residual.cwiseProduct(band.weight.cast<Complex>());
  const Eigen::MatrixXcd covariance = weighted.adjoint() * weighted;
  const double trace = covariance.trace().real(), squares = covariance.squaredNorm();
  return squares > 0 ? trace * trace / squares : static_cast<double>(band.channels());
}

bool drop_unsupported(const Band& band, Refined& state, const ResidualTerms& terms, const ModeOptions& options,
                      double correlated) {
  if (state.poles.empty()) return false;
  const MatrixXd covariance = covariance_of(band, state, terms, correlated);
  const double variance = noise_variance(band, state.poles, terms, state.fit);
  const auto channels = static_cast<double>(band.channels());
  Poles kept;
  std::size_t started = 0;
  for (std::size_t k = 0; k < state.poles.size(); ++k) {
    const Complex p = state.poles[k];
    const auto i = static_cast<Index>(k);
    const double sd = std::sqrt(covariance(2 * i, 2 * i));
    const double rise = state.fit.rise[i] / (2 * channels * variance);
    const double f = frequency_of(p);
    // Outside the band only the tail is seen, which does not show the damping.
    const bool inside = f >= band.low && f <= band.high;
    const bool supported = rise > options.search_gain * correlated && f > band.low / kReach && f < kReach * band.high &&
                           damping_of(p) < options.poles.max_damping &&
                           (!inside || (damping_of(p) > 1e-7 && sd < 0.5 * std::abs(p.real())));
    if (!supported) continue;
    started += k < state.started;
    kept.push_back(p);
  }
  const bool dropped = kept.size() < state.poles.size();
  state.started = started;
  state.poles = kept;
  return dropped;
}

namespace {

// Poles that only split a peak because the model leaves structure there: left out when the others, moved to do without,
// fit as well within what structure of that length can do by chance. Tested: what the search added, and close
// neighbours.
void drop_splits(const Band& band, Refined& state, const ResidualTerms& terms, const ModeOptions& options) {
  for (std::size_t k = state.poles.size(); k-- > 0 && state.correlated > 1.5 && !WorkLimit::over();) {
    const Complex p = state.poles[k];
    const bool close = std::any_of(state.poles.begin(), state.poles.end(), [&](Complex other) {
      return other != p && std::abs(other - p) < 3 * (2 * band.decay - p.real() - other.real());
    });
    if (k < state.started && !close) continue;
    Poles without = state.poles;
    without.erase(without.begin() + static_cast<std::ptrdiff_t>(k));
    const std::size_t started = state.started - (k < state.started ? 1 : 0);
    const auto rise_of = [&](const Refined& trial) {
      const double variance = noise_variance(band, state.poles, terms, state.fit);
      return (trial.fit.total() - state.fit.total()) / (2 * static_cast<double>(band.channels()) * variance);
    };
    const double chance = options.search_gain * state.correlated;
    Refined trial = refine(band, without, started, terms, 2);
    if (rise_of(trial) > 10 * chance) continue;  // no few more steps make up for that
    trial = refine(band, trial.poles, started, terms, 6);
    if (rise_of(trial) < chance) state = std::move(trial);
  }
}

// Adds poles that stand out in what the model leaves, as long as that helps. `equal`: the same lines without weights,
// empty when `band` has none. Where the measured variance follows the resonance, the weighted residual of a missing
// mode is flat across its peak: what no weighted search finds is looked for without weights. Returns true when the
// model changed.
bool search(const Band& band, const Band& equal, Refined& state, const ResidualTerms& terms,
            const ModeOptions& options) {
  const auto attempt = [&](const Poles& candidates) {
    Poles more = state.poles;
    for (const Complex candidate : candidates) {
      if (static_cast<int>(more.size()) < options.max_modes) more.push_back(candidate);
    }
    if (more.size() == state.poles.size()) return false;
    Refined next = refine(band, more, state.started, terms, options.max_iterations);
    for (int round = 0; round < 3 && drop_unsupported(band, next, terms, options); ++round) {
      next = refine(band, next.poles, next.started, terms, options.max_iterations);
    }
    const bool gained = next.fit.total() < state.fit.total() &&
                        (next.poles.size() > state.poles.size() || next.fit.total() < 0.99 * state.fit.total());
    if (gained) state = std::move(next);
    return gained;
  };
  for (int round = 0; round < kSearchRounds && !WorkLimit::over(); ++round) {
    bool gained = false;
    for (const Band* weighted : {&band, &equal}) {
      if (gained || weighted->lines() == 0) continue;
      const Poles candidates = search_residual(*weighted, state.residual, options.search_gain);
      // Together first; where they only stand in each other's way, the strongest alone.
      gained = attempt(candidates) || (candidates.size() > 1 && attempt({candidates.front()}));
    }
    if (!gained) return round > 0;
  }
  return true;
}

}  // namespace

Refined fit_white(const Band& full, const Band& equal, const Poles& start, const ResidualTerms& terms,
                  const ModeOptions& options) {
  // The search works with one weight for all channels (one Gram matrix); the last refinement with each channel's own.
  const Band band = full.common_weight ? full : with_common_weight(full);
  Refined state = refine(band, start, start.size(), terms, options.max_iterations);
  const bool found_more = options.search && search(band, equal, state, terms, options);
  // Not before the first search: a strong mode that the diagram missed would pass for noise and hide all others.
  if (!found_more && drop_unsupported(band, state, terms, options))
    state = refine(band, state.poles, state.started, terms, 3);
  state = refine(full, state.poles, state.started, terms, options.max_iterations);
  drop_splits(full, state, terms, options);
  while (drop_unsupported(full, state, terms, options, state.correlated))
    state = refine(full, state.poles, state.started, terms, 3);
  // Where one mode is not modelled, what it leaves passes for noise and may take others with it: not below the start.
  if (!start.empty() && state.fit.total() > fit_poles(full, start, terms, false).total())
    state = refine(full, start, start.size(), terms, 2 * options.max_iterations);
  return state;
}

}  // namespace whirl::modal
