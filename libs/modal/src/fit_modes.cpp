#include "whirl/modal/fit_modes.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "residual_search.hpp"
#include "residue_fit.hpp"
#include "whirl/core/error.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;
constexpr int kSearchRounds = 20;

double frequency_of(Complex p) { return std::abs(p) / (2 * kPi); }
double damping_of(Complex p) { return -p.real() / std::abs(p); }

struct Refined {
  Poles poles;
  PoleFit fit;
  bool converged = false;
  Eigen::MatrixXcd residual = {};
  double correlated = 1;    ///< lines, see correlated_lines
  std::size_t started = 0;  ///< so many leading poles come from the stabilisation diagram, the others from the search
};

// Real data minus real parameters: residues and residuals of every channel, and the poles.
double freedom(const Band& band, const Poles& poles, const ResidualTerms& terms) {
  const auto n = static_cast<double>(poles.size());
  return static_cast<double>(2 * band.lines() * band.channels()) -
         static_cast<double>(band.channels()) * (2 * n + static_cast<double>(terms.count())) - 2 * n;
}

// Lines over which what is left hangs together: 1 for independent noise, more when the model leaves structure. That
// many lines then count as one observation, in every test and error bar. Sum of the autocorrelation up to its first
// zero.
double correlated_lines(const Band& band, const Eigen::MatrixXcd& residual) {
  const Eigen::MatrixXcd weighted = residual.cwiseProduct(band.weight.cast<Complex>());
  const Index n = weighted.rows();
  const double zero = weighted.squaredNorm();
  const double chance = 2 / std::sqrt(static_cast<double>(weighted.size()));
  double sum = 1;
  for (Index lag = 1; lag < n / 10; ++lag) {
    double product = 0;
    for (Index c = 0; c < weighted.cols(); ++c) {
      product += weighted.col(c).head(n - lag).dot(weighted.col(c).tail(n - lag)).real();
    }
    if (!(product > chance * zero)) break;
    sum += 2 * product / zero;
  }
  return sum;
}

// Noise variance of one weighted real datum below which nothing is modelled: 1e-5 of the data, rms.
double least_variance(const Band& band) {
  const double size = band.h.cwiseProduct(band.weight.cast<Complex>()).squaredNorm();
  return 1e-10 * size / static_cast<double>(2 * band.h.size());
}

double noise_variance(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit) {
  return std::max(fit.total() / freedom(band, poles, terms), least_variance(band));
}

Poles moved(const Poles& poles, const VectorXd& step, const Band& band) {
  Poles result = poles;
  for (std::size_t k = 0; k < poles.size(); ++k) {
    const double half_width = band.decay - poles[k].real();
    Complex change(step[2 * static_cast<Index>(k)], step[2 * static_cast<Index>(k) + 1]);
    // The linearisation holds over a fraction of the peak: longer steps are shortened.
    if (std::abs(change) > half_width) change *= half_width / std::abs(change);
    const Complex p = poles[k] + change;
    result[k] = {std::min(p.real(), 0.1 * poles[k].real()), p.imag()};
  }
  return result;
}

// True when a step would move no pole inside the band by more than a small part of its standard deviation. (Poles
// outside stand for what the residuals cannot; they may creep along a flat valley for long.)
bool is_small(const Band& band, const Poles& poles, const MatrixXd& inverse, const VectorXd& step, double variance) {
  for (std::size_t k = 0; k < poles.size(); ++k) {
    const double f = frequency_of(poles[k]);
    if (f < band.low || f > band.high) continue;
    for (const Index i : {2 * static_cast<Index>(k), 2 * static_cast<Index>(k) + 1}) {
      if (step[i] * step[i] > 0.05 * 0.05 * variance * inverse(i, i)) return false;
    }
  }
  return true;
}

// Gauss-Newton with Levenberg damping, its factor by the ratio of real to predicted gain (Nielsen). Stops when a step
// would gain less than 0.03 of one noise variance per pole, or would move nothing that matters.
Refined refine(const Band& band, const Poles& start, std::size_t started, const ResidualTerms& terms, int iterations) {
  Refined best{start, fit_poles(band, start, terms, true)};
  best.started = started;
  double damping = 1e-5, growth = 3;
  for (int iteration = 0; iteration < iterations && !best.converged && !best.poles.empty(); ++iteration) {
    const VectorXd scale = best.fit.jtj.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    MatrixXd a = scale.asDiagonal() * best.fit.jtj * scale.asDiagonal();
    a.diagonal().array() += damping;
    const Eigen::LDLT<MatrixXd> factor(a);
    const VectorXd step = scale.asDiagonal() * factor.solve(scale.asDiagonal() * best.fit.jtr);
    if (!step.allFinite()) break;
    const double variance = noise_variance(band, best.poles, terms, best.fit);
    const double gain = step.dot(best.fit.jtr);
    const MatrixXd inverse = scale.asDiagonal() * factor.solve(MatrixXd(scale.asDiagonal()));
    if (gain < 0.03 * variance * static_cast<double>(best.poles.size()) ||
        is_small(band, best.poles, inverse, step, variance)) {
      best.converged = true;
      break;
    }
    const double predicted = gain + damping * step.cwiseQuotient(scale).squaredNorm();
    Refined next{moved(best.poles, step, band), {}};
    next.started = started;
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

// Covariance of (Re, Im) of the poles, in their order.
MatrixXd covariance_of(const Band& band, const Refined& state, const ResidualTerms& terms, double correlated) {
  const VectorXd scale = state.fit.jtj.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  MatrixXd scaled = scale.asDiagonal() * state.fit.jtj * scale.asDiagonal();
  scaled.diagonal().array() += 1e-12;
  const MatrixXd inverse = scaled.ldlt().solve(MatrixXd::Identity(scaled.rows(), scaled.cols()));
  return correlated * state.fit.total() / freedom(band, state.poles, terms) *
         (scale.asDiagonal() * inverse * scale.asDiagonal());
}

// Drops poles that the data do not hold: damping out of range, real part not known to a factor, or an energy that noise
// could have. Returns true when any was dropped.
bool drop_unsupported(const Band& band, Refined& state, const ResidualTerms& terms, const ModeOptions& options,
                      double correlated = 1) {
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

// Poles that only split a peak because the model leaves structure there: left out when the others, moved to do without,
// fit as well within what structure of that length can do by chance. Tested: what the search added, and close
// neighbours.
void drop_splits(const Band& band, Refined& state, const ResidualTerms& terms, const ModeOptions& options) {
  for (std::size_t k = state.poles.size(); k-- > 0 && state.correlated > 1.5;) {
    const Complex p = state.poles[k];
    const bool close = std::any_of(state.poles.begin(), state.poles.end(), [&](Complex other) {
      return other != p && std::abs(other - p) < 3 * (2 * band.decay - p.real() - other.real());
    });
    if (k < state.started && !close) continue;
    Poles without = state.poles;
    without.erase(without.begin() + static_cast<std::ptrdiff_t>(k));
    Refined trial = refine(band, without, state.started - (k < state.started ? 1 : 0), terms, 6);
    const double variance = noise_variance(band, state.poles, terms, state.fit);
    const double rise = (trial.fit.total() - state.fit.total()) / (2 * static_cast<double>(band.channels()) * variance);
    if (rise < options.search_gain * state.correlated) state = std::move(trial);
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
  for (int round = 0; round < kSearchRounds; ++round) {
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

ModalModel fit_modes(const FrequencyResponse& frf, const ModeOptions& options) {
  const Band full = select_band(frf, options.poles.band_low, options.poles.band_high, options.poles.weighting);
  const ResidualTerms terms{options.residues.lower_residual, options.residues.upper_residual,
                            options.residues.upper_slope, options.residues.complex_residuals};
  StabilisationDiagram diagram = stabilisation_diagram(frf, options.poles);
  Poles poles;
  for (const auto& cluster : select_poles(diagram, options.poles)) {
    const Complex p = cluster.pole + full.decay;
    if (p.real() < 0) poles.push_back(p);
  }

  ModalModel model;
  // The search works with one weight for all channels (one Gram matrix); the last refinement with each channel's own.
  const Band band = full.common_weight ? full : with_common_weight(full);
  const Band equal = full.common_weight
                         ? Band{}
                         : select_band(frf, options.poles.band_low, options.poles.band_high, LineWeighting::flat);
  Refined state{poles, {}, true};
  if (options.refine) {
    state = refine(band, poles, poles.size(), terms, options.max_iterations);
    const bool found_more = options.search && search(band, equal, state, terms, options);
    // Not before the first search: a strong mode that the diagram missed would pass for noise and hide all others.
    if (!found_more && drop_unsupported(band, state, terms, options))
      state = refine(band, state.poles, state.started, terms, 3);
    state = refine(full, state.poles, state.started, terms, options.max_iterations);
    drop_splits(full, state, terms, options);
    while (drop_unsupported(full, state, terms, options, state.correlated))
      state = refine(full, state.poles, state.started, terms, 3);
  } else {
    state.fit = fit_poles(full, poles, terms, true);
  }

  std::vector<std::size_t> order(state.poles.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::sort(order.begin(), order.end(),
            [&](auto a, auto b) { return std::abs(state.poles[a]) < std::abs(state.poles[b]); });
  const ResidueFit residues = unpack_residues(full, state.poles, terms, state.fit);
  const MatrixXd covariance =
      options.refine && !state.poles.empty() ? covariance_of(full, state, terms, state.correlated) : MatrixXd();
  for (std::size_t i : order) {
    const Complex p = state.poles[i];
    Mode mode;
    mode.pole = p;
    mode.residues = residues.residues.row(static_cast<Index>(i)).transpose();
    mode.frequency.value = frequency_of(p);
    mode.damping.value = damping_of(p);
    if (covariance.size() > 0) {
      const Eigen::Matrix2d c = covariance.block<2, 2>(2 * static_cast<Index>(i), 2 * static_cast<Index>(i));
      const double u = p.real(), v = p.imag(), size = std::abs(p);
      const Eigen::Vector2d df(u / (2 * kPi * size), v / (2 * kPi * size));
      const Eigen::Vector2d dz(-v * v / std::pow(size, 3), u * v / std::pow(size, 3));
      mode.frequency = Estimate::from_sd(mode.frequency.value, std::sqrt(df.dot(c * df)));
      mode.damping = Estimate::from_sd(mode.damping.value, std::sqrt(dz.dot(c * dz)));
    }
    model.modes.push_back(std::move(mode));
  }
  model.lower = residues.lower;
  model.upper = residues.upper;
  model.upper_slope = residues.upper_slope;
  model.kind = frf.kind;
  model.band_low = full.low;
  model.band_high = full.high;
  model.window_decay = full.decay;
  model.reconstruction_error = residues.reconstruction_error;
  model.noise_floor = full.noise_floor;
  for (const auto& channel : frf.channels) {
    model.responses.push_back(channel.response);
    model.references.push_back(channel.reference);
  }
  for (const Mode& mode : model.modes) {
    if (mode.frequency.value < full.low || mode.frequency.value > full.high) continue;
    if (full.decay == 0 && -mode.pole.real() / full.line_width() < 3) {
      model.summary.warn(
          fmt::format("mode at {:.5g} Hz still rings at the end of a record of 1/df = {:.3g} s: leakage makes its "
                      "damping too high; use an exponential window",
                      mode.frequency.value, 1 / full.line_width()));
    }
    if (2 * mode.damping.value * mode.frequency.value < full.line_width()) {
      model.summary.warn(fmt::format("mode at {:.5g} Hz is narrower than a line: its damping is limited by resolution",
                                     mode.frequency.value));
    }
  }
  for (const Mode& mode : model.modes) {
    for (const Mode& strong : model.modes) {
      const double times = std::round(mode.frequency.value / strong.frequency.value);
      const double distance = std::abs(mode.frequency.value - times * strong.frequency.value);
      if ((times == 2 || times == 3) && distance < mode.damping.value * mode.frequency.value &&
          mode.residues.norm() < 0.01 * strong.residues.norm()) {
        model.summary.warn(
            fmt::format("mode at {:.5g} Hz lies at {:g} times the far stronger one at {:.5g} Hz: it may be the "
                        "distortion of a nonlinear stiffness, not a mode",
                        mode.frequency.value, times, strong.frequency.value));
        break;
      }
    }
  }
  if (!state.converged) model.summary.warn("refinement of the poles has not converged");
  if (state.poles.empty()) model.summary.fail("no mode found in the band");
  if (full.guessed_weight && !full.common_weight && state.correlated > 5) {
    // The scatter between lines said that the noise grows with |H|, but structure that the model leaves outweighs it.
    // Then the peaks, where the model is best, should count for most.
    ModeOptions flat = options;
    flat.poles.weighting = LineWeighting::flat;
    return fit_modes(frf, flat);
  }
  if (state.correlated > 3) {
    model.summary.warn(fmt::format("the model leaves structure over about {:.0f} lines: error bars are widened for it",
                                   state.correlated));
  }
  model.summary.residual = model.reconstruction_error;
  model.summary.trust = fmt::format("{} modes between {:.4g} and {:.4g} Hz, reconstruction within {:.3g} %",
                                    model.modes.size(), full.low, full.high, 100 * model.reconstruction_error);
  model.provenance.version = version();
  return model;
}

double damping_through_window(const Mode& mode, double window_decay) {
  return (window_decay - mode.pole.real()) / std::abs(mode.pole - window_decay);
}

}  // namespace whirl::modal
