// Mixed-effects fit of poles that differ between FRFs. Per FRF k, with P_k the information of its own poles (residues
// eliminated) and y_k = P_k (estimate of the offset), the offsets b_k ~ N(0, D) are eliminated by Woodbury's identity:
// the common poles see the information M_k = P_k - P_k (P_k + D^-1)^-1 P_k. D follows by MacKay's fixed point.
#include "scatter.hpp"

#include <algorithm>
#include <cmath>

#include "residual_search.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;
constexpr double kPi = 3.14159265358979323846;

/// One FRF with its own poles.
struct Local {
  Band band;
  Poles poles;
  PoleFit fit;
  double damping = 0;  ///< Levenberg's, relative to the information's diagonal
};

struct State {
  Poles poles;
  std::vector<Local> local;
  MatrixXd spread;
  MatrixXd information;  // of the common poles
  double correlated = 1;
  double frequency_scatter = 0, damping_scatter = 0;
  double low = 0, high = 0;  ///< Hz, of the band

  // Poles outside stand for what the residuals cannot: how they differ says nothing of the structure.
  bool inside(Index r) const {
    const double f = std::abs(poles[static_cast<std::size_t>(r)]) / (2 * kPi);
    return f >= low && f <= high;
  }
};

Band channel_of(const Band& band, Index c) {
  Band one = band;
  one.h = band.h.col(c);
  one.weight = band.weight.col(c);
  one.common_weight = true;
  one.energy = (one.h.array().abs2() * one.weight.array().square()).sum();
  return one;
}

double real_data(const Band& one) { return 2 * static_cast<double>(one.lines()); }

double variance_of(const Local& local) {
  const double parameters = static_cast<double>(local.fit.residues.rows());
  const double size = local.band.energy;
  return std::max(local.fit.total() / (real_data(local.band) - parameters), 1e-10 * size / real_data(local.band));
}

VectorXd offset_of(const Poles& local, const Poles& common) {
  VectorXd b(2 * static_cast<Index>(common.size()));
  for (std::size_t r = 0; r < common.size(); ++r) {
    b[2 * static_cast<Index>(r)] = local[r].real() - common[r].real();
    b[2 * static_cast<Index>(r) + 1] = local[r].imag() - common[r].imag();
  }
  return b;
}

VectorXd precision_of(const MatrixXd& spread) {
  VectorXd inverse(2 * spread.rows());
  for (Index r = 0; r < spread.rows(); ++r) {
    inverse[2 * r] = 1 / spread(r, 0);
    inverse[2 * r + 1] = 1 / spread(r, 1);
  }
  return inverse;
}

Poles shifted(const Poles& poles, const VectorXd& step) {
  Poles result = poles;
  for (std::size_t r = 0; r < poles.size(); ++r) {
    Complex change(step[2 * static_cast<Index>(r)], step[2 * static_cast<Index>(r) + 1]);
    const double width = -poles[r].real();
    if (std::abs(change) > 0.7 * width) change *= 0.7 * width / std::abs(change);
    const Complex p = poles[r] + change;
    result[r] = {std::min(p.real(), 0.2 * poles[r].real()), p.imag()};
  }
  return result;
}

// One Gauss-Newton step of every FRF's own poles, held to the common ones by the spread.
void step_locals(State& state, const ResidualTerms& terms) {
  const VectorXd prior = precision_of(state.spread);
  for (Local& local : state.local) {
    const double variance = variance_of(local) * state.correlated;
    const VectorXd b = offset_of(local.poles, state.poles);
    const MatrixXd information = local.fit.jtj / variance;
    MatrixXd a = information;
    a.diagonal() += prior + local.damping * information.diagonal();
    const VectorXd step = a.ldlt().solve(local.fit.jtr / variance - prior.cwiseProduct(b));
    if (!step.allFinite()) continue;
    const Poles next = shifted(local.poles, step);
    PoleFit fit = fit_poles(local.band, next, terms, true);
    const auto objective = [&](const PoleFit& f, const Poles& p) {
      const VectorXd o = offset_of(p, state.poles);
      return f.total() / variance + o.dot(prior.cwiseProduct(o));
    };
    if (objective(fit, next) <= objective(local.fit, local.poles)) {
      local.poles = next;
      local.fit = std::move(fit);
      local.damping = local.damping > 1e-4 ? 0.1 * local.damping : 0;
    } else {
      local.damping = std::max(0.3, 5 * local.damping);
    }
  }
}

// What the FRFs say of the common poles once their offsets are eliminated.
struct Marginal {
  MatrixXd information;
  VectorXd score;
};

Marginal eliminate(const State& state) {
  const Index n = 2 * static_cast<Index>(state.poles.size());
  const VectorXd prior = precision_of(state.spread);
  Marginal marginal{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (const Local& local : state.local) {
    const double variance = variance_of(local) * state.correlated;
    const MatrixXd p = local.fit.jtj / variance;
    const VectorXd y = local.fit.jtr / variance + p * offset_of(local.poles, state.poles);
    MatrixXd a = p;
    a.diagonal() += prior;
    const Eigen::LDLT<MatrixXd> factor(a);
    marginal.information += p - p * factor.solve(p);
    marginal.score += y - p * factor.solve(y);
  }
  return marginal;
}

// Moves the common poles to their most likely place and estimates the spread anew. A mode's own spread is drawn towards
// that of all modes, as if a few more FRFs had shown it.
void step_common(State& state) {
  constexpr double kPooled = 3;
  const Index n = static_cast<Index>(state.poles.size());
  Marginal marginal = eliminate(state);
  MatrixXd information = marginal.information;
  information.diagonal() *= 1 + 1e-9;
  const VectorXd move = information.ldlt().solve(marginal.score);
  if (move.allFinite()) state.poles = shifted(state.poles, move);
  const MatrixXd covariance = information.ldlt().solve(MatrixXd::Identity(2 * n, 2 * n));

  const VectorXd prior = precision_of(state.spread);
  MatrixXd squares = MatrixXd::Zero(n, 2), known = MatrixXd::Zero(n, 2);
  for (const Local& local : state.local) {
    const double variance = variance_of(local) * state.correlated;
    MatrixXd a = local.fit.jtj / variance;
    a.diagonal() += prior;
    const MatrixXd posterior = a.ldlt().solve(MatrixXd::Identity(2 * n, 2 * n));
    const VectorXd b = offset_of(local.poles, state.poles);
    for (Index r = 0; r < n; ++r) {
      for (Index i = 0; i < 2; ++i) {
        squares(r, i) += b[2 * r + i] * b[2 * r + i];
        known(r, i) += std::clamp(1 - posterior(2 * r + i, 2 * r + i) * prior[2 * r + i], 0.0, 1.0);
      }
    }
  }
  Eigen::Vector2d pooled = Eigen::Vector2d::Zero(), pooled_known = Eigen::Vector2d::Zero();
  for (Index r = 0; r < n; ++r) {
    const double size2 = std::norm(state.poles[static_cast<std::size_t>(r)]);
    for (Index i = 0; i < 2; ++i) {
      const double common = std::clamp(covariance(2 * r + i, 2 * r + i) * prior[2 * r + i], 0.0, 1.0);
      known(r, i) = std::max(0.0, known(r, i) - common);
      if (!state.inside(r)) continue;
      pooled[i] += squares(r, i) / size2;
      pooled_known[i] += known(r, i);
    }
  }
  for (Index i = 0; i < 2; ++i) {
    const double mean = pooled[i] / std::max(pooled_known[i], 1e-3);
    (i == 0 ? state.damping_scatter : state.frequency_scatter) = std::sqrt(mean);
    for (Index r = 0; r < n; ++r) {
      const double size2 = std::norm(state.poles[static_cast<std::size_t>(r)]);
      const double width = state.poles[static_cast<std::size_t>(r)].real();
      const double own = state.inside(r) ? kPooled : 0;
      const double value = (squares(r, i) + own * mean * size2) / std::max(1e-6, known(r, i) + own);
      // Not below what no record shows, not so wide that a pole may take its neighbour's place.
      state.spread(r, i) = std::clamp(value, 1e-14 * size2, 4 * width * width);
    }
  }
}

State begin(const Band& band, const Poles& poles, const ResidualTerms& terms) {
  State state;
  state.low = band.low;
  state.high = band.high;
  state.poles = poles;
  state.spread.resize(static_cast<Index>(poles.size()), 2);
  for (std::size_t r = 0; r < poles.size(); ++r)
    state.spread.row(static_cast<Index>(r)).setConstant(std::pow(0.3 * poles[r].real(), 2));
  for (Index c = 0; c < band.channels(); ++c) {
    Local local{channel_of(band, c), poles, {}};
    local.fit = fit_poles(local.band, poles, terms, true);
    state.local.push_back(std::move(local));
  }
  return state;
}

Eigen::MatrixXcd residual_of(const Band& band, const State& state, const ResidualTerms& terms) {
  Eigen::MatrixXcd residual(band.lines(), band.channels());
  for (Index c = 0; c < band.channels(); ++c) {
    const Local& local = state.local[static_cast<std::size_t>(c)];
    residual.col(c) = residual_of(local.band, local.poles, terms, local.fit);
  }
  return residual;
}

double deviance_of(const State& state) {
  const VectorXd prior = precision_of(state.spread);
  double deviance = 0;
  for (const Local& local : state.local) {
    const double variance = variance_of(local);
    const double data = real_data(local.band) / state.correlated;
    const VectorXd b = offset_of(local.poles, state.poles);
    MatrixXd a = local.fit.jtj / (variance * state.correlated);
    a = prior.cwiseSqrt().cwiseInverse().asDiagonal() * a * prior.cwiseSqrt().cwiseInverse().asDiagonal();
    a.diagonal().array() += 1;
    deviance += data * std::log(variance) + b.dot(prior.cwiseProduct(b)) +
                2 * Eigen::LLT<MatrixXd>(a).matrixL().toDenseMatrix().diagonal().array().log().sum();
  }
  return deviance;
}

double penalty(const Band& band, std::size_t poles, const ResidualTerms& terms, std::size_t hyper, double lines) {
  const double data = 2 * static_cast<double>(band.lines() * band.channels()) / lines;
  const double parameters =
      static_cast<double>(band.channels()) * (2 * static_cast<double>(poles) + static_cast<double>(terms.count())) +
      2 * static_cast<double>(poles) + static_cast<double>(hyper);
  return std::log(data) * parameters;
}

double length_of(const Band& band, const State& state, const ResidualTerms& terms) {
  return deviance_of(state) + penalty(band, state.poles.size(), terms, 2, state.correlated);
}

void sweep(State& state, const ResidualTerms& terms, int sweeps) {
  for (int i = 0; i < sweeps && !state.poles.empty(); ++i) {
    step_locals(state, terms);
    step_common(state);
  }
}

void insert_pole(State& state, Complex pole) {
  double frequency = std::max(1e-5, state.frequency_scatter);
  state.poles.push_back(pole);
  MatrixXd spread(state.spread.rows() + 1, 2);
  spread.topRows(state.spread.rows()) = state.spread;
  spread.bottomRows(1).setConstant(std::pow(frequency * std::abs(pole), 2));
  state.spread = spread;
  for (Local& local : state.local) local.poles.push_back(pole);
}

void erase_pole(State& state, std::size_t r) {
  const auto at = static_cast<std::ptrdiff_t>(r);
  state.poles.erase(state.poles.begin() + at);
  MatrixXd spread(state.spread.rows() - 1, 2);
  for (Index i = 0, j = 0; i < state.spread.rows(); ++i) {
    if (i != static_cast<Index>(r)) spread.row(j++) = state.spread.row(i);
  }
  state.spread = spread;
  for (Local& local : state.local) local.poles.erase(local.poles.begin() + at);
}

void refit(State& state, const ResidualTerms& terms) {
  for (Local& local : state.local) {
    local.fit = fit_poles(local.band, local.poles, terms, true);
    local.damping = 0;
  }
}

bool supported(const Band& band, const State& state, std::size_t r, const ScatterOptions& options) {
  const Complex p = state.poles[r];
  const double f = std::abs(p) / (2 * kPi), zeta = -p.real() / std::abs(p);
  double rise = 0;
  for (const Local& local : state.local) rise += local.fit.rise[static_cast<Index>(r)] / variance_of(local);
  rise /= 2 * static_cast<double>(band.channels());
  return rise > options.search_gain * state.correlated && f > 0.2 * band.low && f < 5 * band.high &&
         zeta < options.max_damping && zeta > 1e-7;
}

void drop_unsupported(const Band& band, State& state, const ResidualTerms& terms, const ScatterOptions& options) {
  bool dropped = false;
  for (std::size_t r = state.poles.size(); r-- > 0;) {
    if (supported(band, state, r, options)) continue;
    erase_pole(state, r);
    dropped = true;
  }
  if (!dropped) return;
  refit(state, terms);
  sweep(state, terms, 2);
}

// Close poles, of which one may only split the other's peak: kept when the evidence holds both.
void merge_splits(const Band& band, State& state, const ResidualTerms& terms, const ScatterOptions& options) {
  for (std::size_t r = state.poles.size(); r-- > 0;) {
    const Complex p = state.poles[r];
    bool close = false;
    for (std::size_t other = 0; other < state.poles.size(); ++other) {
      close = close || (other != r && std::abs(state.poles[other] - p) < 3 * -(p.real() + state.poles[other].real()));
    }
    if (!close) continue;
    State trial = state;
    erase_pole(trial, r);
    // What a second pole took leaves the FRFs apart: room to follow.
    for (Index i = 0; i < trial.spread.rows(); ++i) {
      const double width = trial.poles[static_cast<std::size_t>(i)].real();
      if (std::abs(trial.poles[static_cast<std::size_t>(i)] - p) < -6 * (width + p.real()))
        trial.spread.row(i).setConstant(0.1 * width * width);
    }
    refit(trial, terms);
    const double target = length_of(band, state, terms);
    sweep(trial, terms, options.sweeps);
    if (length_of(band, trial, terms) < target) state = std::move(trial);
  }
}

// How much more the mean of the channels' offsets varies than if every channel strayed on its own: FRFs of one
// reference (or of one response) may have been measured together. Analysis of variance over the groups, all modes taken
// together; `part`: 0 damping, 1 frequency.
double design_effect(const Band& band, const State& state, Index part) {
  double effect = 1;
  for (const bool by_column : {false, true}) {
    const Index groups = by_column ? band.grid.cols() : band.grid.rows(), members = band.grid.size() / groups;
    if (groups < 2 || members < 2) continue;
    double between = 0, within = 0;
    for (std::size_t r = 0; r < state.poles.size(); ++r) {
      if (!state.inside(static_cast<Index>(r))) continue;
      MatrixXd offset(members, groups);
      for (Index g = 0; g < groups; ++g) {
        for (Index m = 0; m < members; ++m) {
          const int c = by_column ? band.grid(m, g) : band.grid(g, m);
          const Complex d = state.local[static_cast<std::size_t>(c)].poles[r] - state.poles[r];
          offset(m, g) = (part == 0 ? d.real() : d.imag()) / std::abs(state.poles[r]);
        }
      }
      const Eigen::RowVectorXd mean = offset.colwise().mean();
      between +=
          static_cast<double>(members) * (mean.array() - mean.mean()).square().sum() / static_cast<double>(groups - 1);
      within += (offset.rowwise() - mean).squaredNorm() / static_cast<double>(groups * (members - 1));
    }
    const auto m = static_cast<double>(members);
    const double share = (between - within) / std::max(between + (m - 1) * within, 1e-300);
    effect = std::max(effect, 1 + (m - 1) * std::clamp(share, 0.0, 1.0));
  }
  return effect;
}

}  // namespace

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

double description_length(const Band& band, const ScatterFit& fit, const ResidualTerms& terms, double lines) {
  return fit.deviance + penalty(band, fit.poles.size(), terms, 2, lines);
}

double description_length(const Band& band, const PoleFit& fit, std::size_t poles, const ResidualTerms& terms,
                          double lines) {
  const double data = 2 * static_cast<double>(band.lines());
  const double freedom = data - static_cast<double>(fit.residues.rows());
  double deviance = 0;
  for (Index c = 0; c < band.channels(); ++c) {
    const double size = band.h.col(c).cwiseProduct(band.weight.col(c).cast<Complex>()).squaredNorm();
    deviance += data / lines * std::log(std::max(fit.cost[c] / freedom, 1e-10 * size / data));
  }
  return deviance + penalty(band, poles, terms, 0, lines);
}

ScatterFit fit_scatter(const Band& band, const Poles& start, const ResidualTerms& terms,
                       const ScatterOptions& options) {
  State state = begin(band, start, terms);
  sweep(state, terms, options.sweeps);
  if (length_of(band, state, terms) > options.give_up) return {};
  merge_splits(band, state, terms, options);
  for (int round = 0; round < 10; ++round) {
    const Poles candidates = search_residual(band, residual_of(band, state, terms), options.search_gain);
    if (candidates.empty()) break;
    const auto attempt = [&](const Poles& added) {
      State trial = state;
      for (const Complex p : added) {
        if (static_cast<int>(trial.poles.size()) < options.max_modes) insert_pole(trial, p);
      }
      refit(trial, terms);
      sweep(trial, terms, options.sweeps);
      drop_unsupported(band, trial, terms, options);
      if (!(length_of(band, trial, terms) < length_of(band, state, terms))) return false;
      state = std::move(trial);
      return true;
    };
    if (!attempt(candidates) && !(candidates.size() > 1 && attempt({candidates.front()}))) break;
  }
  merge_splits(band, state, terms, options);
  state.correlated = correlated_lines(band, residual_of(band, state, terms));
  drop_unsupported(band, state, terms, options);
  sweep(state, terms, options.sweeps);

  ScatterFit result;
  result.correlated = state.correlated;
  result.deviance = deviance_of(state);
  result.residual = residual_of(band, state, terms);
  result.poles = state.poles;
  result.spread = state.spread;
  result.frequency_scatter = state.frequency_scatter;
  result.damping_scatter = state.damping_scatter;
  const Index n = 2 * static_cast<Index>(state.poles.size());
  MatrixXd information = eliminate(state).information;
  information.diagonal() *= 1 + 1e-12;
  result.covariance = information.ldlt().solve(MatrixXd::Identity(n, n));
  for (Index part = 0; part < 2; ++part) {
    // So many channels count as one; the spread was estimated as if each counted.
    const double effect = design_effect(band, state, part), channels = static_cast<double>(band.channels());
    const double larger = std::sqrt(std::max(1.0, (channels - 1) / std::max(1.0, channels - effect)));
    const double widen = std::sqrt(effect) * larger;
    (part == 0 ? result.damping_scatter : result.frequency_scatter) *= larger;
    for (Index r = part; r < n; r += 2) {
      result.covariance.row(r) *= widen;
      result.covariance.col(r) *= widen;
    }
  }
  result.residues.resize(n + terms.count(), band.channels());
  result.cost.resize(band.channels());
  result.rise = VectorXd::Zero(n / 2);
  for (Index c = 0; c < band.channels(); ++c) {
    const Local& local = state.local[static_cast<std::size_t>(c)];
    result.local.push_back(local.poles);
    result.residues.col(c) = local.fit.residues.col(0);
    result.cost[c] = local.fit.total();
    result.rise += local.fit.rise / variance_of(local);
  }
  return result;
}

}  // namespace whirl::modal
