// Which poles a fit with scatter keeps: search, selection by description length, and what is reported of it.
#include "fit/scatter/scatter.hpp"

#include <algorithm>
#include <cmath>

#include "fit/residual_search.hpp"
#include "fit/scatter/scatter_state.hpp"
#include "fit/work.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

double penalty(const Band& band, std::size_t poles, const ResidualTerms& terms, std::size_t hyper, double lines) {
  const double data = 2 * static_cast<double>(band.lines() * band.channels()) / lines;
  const double parameters =
      static_cast<double>(band.channels()) * (2 * static_cast<double>(poles) + static_cast<double>(terms.count())) +
      2 * static_cast<double>(poles) + static_cast<double>(hyper);
  return std::log(data) * parameters;
}

double length_of(const Band& band, const ScatterState& state, const ResidualTerms& terms) {
  return state.deviance() + penalty(band, state.poles.size(), terms, 2, state.correlated);
}

// Evidence of a pole over what is asked of one; nothing for one that cannot be a mode.
double support(const Band& band, const ScatterState& state, std::size_t r, const ScatterOptions& options) {
  const Complex p = state.poles[r];
  const double f = std::abs(p) / (2 * kPi), zeta = -p.real() / std::abs(p);
  if (!(f > 0.2 * band.low && f < 5 * band.high && zeta < options.max_damping && zeta > 1e-7)) return 0;
  double rise = 0;
  for (const LocalPoles& local : state.local) rise += local.fit.rise[static_cast<Index>(r)] / local.variance();
  return rise / (2 * static_cast<double>(band.channels()) * options.search_gain * state.correlated);
}

// One after the other: two that do the same work are both idle, and one of them is needed.
void drop_unsupported(const Band& band, ScatterState& state, const ResidualTerms& terms,
                      const ScatterOptions& options) {
  while (!state.poles.empty()) {
    std::size_t weakest = 0;
    double least = 1e300;
    for (std::size_t r = 0; r < state.poles.size(); ++r) {
      const double now = support(band, state, r, options);
      if (!(now < least)) continue;
      least = now;
      weakest = r;
    }
    if (least > 1) return;
    state.erase(weakest);
    state.refit(terms);
    state.sweep(terms, 2);
  }
}

// The pole that pole r may only split the peak of; r itself when none is so close.
std::size_t close_to(const ScatterState& state, std::size_t r) {
  std::size_t nearest = r;
  double least = 3;
  for (std::size_t other = 0; other < state.poles.size(); ++other) {
    const Complex p = state.poles[r], q = state.poles[other];
    const double distance = std::abs(p - q) / -(p.real() + q.real());
    if (other == r || !(distance < least)) continue;
    least = distance;
    nearest = other;
  }
  return nearest;
}

// Close poles, of which one may only split the other's peak: kept when the evidence holds both. First all at once:
// while one peak is split, the scatter of all modes looks smaller than it is.
void merge_splits(const Band& band, ScatterState& state, const ResidualTerms& terms) {
  const auto take_if_shorter = [&](ScatterState& trial) {
    trial.settle(terms);
    if (length_of(band, trial, terms) < length_of(band, state, terms)) state = std::move(trial);
  };
  ScatterState all = state;
  int joined = 0;
  for (std::size_t r = all.poles.size(); r-- > 0;) {
    if (close_to(all, r) == r) continue;
    all.join(r, close_to(all, r), terms);
    ++joined;
  }
  if (joined > 1) take_if_shorter(all);
  for (std::size_t r = state.poles.size(); r-- > 0 && !WorkLimit::over();) {
    if (r >= state.poles.size() || close_to(state, r) == r) continue;
    ScatterState trial = state;
    trial.join(r, close_to(state, r), terms);
    take_if_shorter(trial);
  }
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
  ScatterState state(band, start, terms);
  state.settle(terms);
  if (length_of(band, state, terms) > options.give_up) return {};
  merge_splits(band, state, terms);
  for (int round = 0; round < 10 && !WorkLimit::over(); ++round) {
    const Poles candidates = search_residual(band, state.residual(band, terms), options.search_gain);
    if (candidates.empty()) break;
    const auto attempt = [&](const Poles& added) {
      ScatterState trial = state;
      for (const Complex p : added) {
        if (static_cast<int>(trial.poles.size()) < options.max_modes) trial.insert(p);
      }
      trial.refit(terms);
      trial.settle(terms);
      drop_unsupported(band, trial, terms, options);
      if (!(length_of(band, trial, terms) < length_of(band, state, terms))) return false;
      state = std::move(trial);
      return true;
    };
    if (!attempt(candidates) && !(candidates.size() > 1 && attempt({candidates.front()}))) break;
  }
  merge_splits(band, state, terms);
  state.correlated = correlated_lines(band, state.residual(band, terms));
  drop_unsupported(band, state, terms, options);
  state.settle(terms);
  ScatterFit result;
  result.deviance = state.deviance();  // before the spread is widened for its own uncertainty
  state.chosen = true;
  state.repeated = {state.design_effect(band, 0), state.design_effect(band, 1)};
  state.sweep(terms, 2);

  result.correlated = state.correlated;
  result.residual = state.residual(band, terms);
  result.poles = state.poles;
  result.spread = state.spread;
  result.frequency_scatter = state.frequency_scatter;
  result.damping_scatter = state.damping_scatter;
  const Index n = 2 * static_cast<Index>(state.poles.size());
  MatrixXd information = state.information();
  information.diagonal() *= 1 + 1e-12;
  result.covariance = information.ldlt().solve(MatrixXd::Identity(n, n));
  for (Index part = 0; part < 2; ++part) {
    for (Index r = 0; r < n / 2; ++r) {
      const double widen = std::sqrt(state.repeated[part]) * state.student(r, part);
      result.covariance.row(2 * r + part) *= widen;
      result.covariance.col(2 * r + part) *= widen;
    }
  }
  result.residues.resize(n + terms.count(), band.channels());
  result.cost.resize(band.channels());
  result.rise = VectorXd::Zero(n / 2);
  for (Index c = 0; c < band.channels(); ++c) {
    const LocalPoles& local = state.local[static_cast<std::size_t>(c)];
    result.local.push_back(local.poles);
    result.residues.col(c) = local.fit.residues.col(0);
    result.cost[c] = local.fit.total();
    result.rise += local.fit.rise / local.variance();
  }
  return result;
}

}  // namespace whirl::modal
