// Mixed-effects fit of poles that differ between FRFs. Per FRF k, with P_k the information of its own poles (residues
// eliminated) and y_k = P_k (estimate of the offset), the offsets b_k ~ N(0, D) are eliminated by Woodbury's identity:
// the common poles see the information M_k = P_k - P_k (P_k + D^-1)^-1 P_k. D follows by MacKay's fixed point.
#include "fit/scatter/scatter_state.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fit/work.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

Band channel_of(const Band& band, Index c) {
  Band one = band;
  one.h = band.h.col(c);
  one.weight = band.weight.col(c);
  one.common_weight = true;
  one.energy = (one.h.array().abs2() * one.weight.array().square()).sum();
  return one;
}

double real_data(const Band& one) { return 2 * static_cast<double>(one.lines()); }

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
void step_locals(ScatterState& state, const ResidualTerms& terms) {
  const VectorXd prior = precision_of(state.spread);
  for (LocalPoles& local : state.local) {
    const double variance = local.variance() * state.correlated;
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

Marginal eliminate(const ScatterState& state) {
  const Index n = 2 * static_cast<Index>(state.poles.size());
  const VectorXd prior = precision_of(state.spread);
  Marginal marginal{MatrixXd::Zero(n, n), VectorXd::Zero(n)};
  for (const LocalPoles& local : state.local) {
    const double variance = local.variance() * state.correlated;
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
void step_common(ScatterState& state) {
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
  for (const LocalPoles& local : state.local) {
    const double variance = local.variance() * state.correlated;
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
      // Offsets are taken about a mean that the same channels give: as much less is known of the spread. While poles
      // are still chosen, the narrower spread of the largest likelihood tells modes from splits better.
      const double count = state.chosen ? static_cast<double>(state.local.size()) : 1;
      const double common = count * covariance(2 * r + i, 2 * r + i) * prior[2 * r + i];
      squares(r, i) /= state.repeated[i];
      known(r, i) = std::max(0.0, known(r, i) / state.repeated[i] - std::clamp(common, 0.0, 1.0));
      if (!state.inside(r)) continue;
      pooled[i] += squares(r, i) / size2;
      pooled_known[i] += known(r, i);
    }
  }
  state.student.resize(n, 2);
  for (Index i = 0; i < 2; ++i) {
    const double mean = pooled[i] / std::max(pooled_known[i], 1e-3);
    (i == 0 ? state.damping_scatter : state.frequency_scatter) = std::sqrt(mean);
    for (Index r = 0; r < n; ++r) {
      const double size2 = std::norm(state.poles[static_cast<std::size_t>(r)]);
      const double width = state.poles[static_cast<std::size_t>(r)].real();
      const double own = state.inside(r) ? kPooled : 0;
      const double value = (squares(r, i) + own * mean * size2) / std::max(1e-6, known(r, i) + own);
      // Degrees of freedom by Satterthwaite; t is 1.96 + 2.37/f + 2.8/f^2. It counts as far as the spread, not noise,
      // makes the error.
      const double freedom =
          std::max(1.0, std::pow(known(r, i) + own, 2) /
                            std::max(1e-6, known(r, i) + own * own / std::max(pooled_known[i], 1e-3)));
      const double most = static_cast<double>(state.local.size()) / state.repeated[i] - 1;
      const double share = std::clamp(known(r, i) / std::max(most, 1e-6), 0.0, 1.0);
      state.student(r, i) = 1 + share * (1.21 / freedom + 1.44 / (freedom * freedom));
      // Not below what no record shows, not so wide that a pole may take its neighbour's place.
      state.spread(r, i) = std::clamp(value, 1e-14 * size2, 4 * width * width);
    }
  }
}

}  // namespace

double LocalPoles::variance() const {
  const double parameters = static_cast<double>(fit.residues.rows());
  const double size = band.energy;
  return std::max(fit.total() / (real_data(band) - parameters), 1e-10 * size / real_data(band));
}

ScatterState::ScatterState(const Band& band, const Poles& start, const ResidualTerms& terms)
    : poles(start), low(band.low), high(band.high) {
  spread.resize(static_cast<Index>(poles.size()), 2);
  for (std::size_t r = 0; r < poles.size(); ++r)
    spread.row(static_cast<Index>(r)).setConstant(std::pow(0.3 * poles[r].real(), 2));
  for (Index c = 0; c < band.channels(); ++c) {
    LocalPoles own{channel_of(band, c), poles, {}};
    own.fit = fit_poles(own.band, poles, terms, true);
    local.push_back(std::move(own));
  }
}

bool ScatterState::inside(Index r) const {
  const double f = std::abs(poles[static_cast<std::size_t>(r)]) / (2 * std::numbers::pi);
  return f >= low && f <= high;
}

void ScatterState::insert(Complex pole) {
  const double frequency = std::max(1e-5, frequency_scatter);
  poles.push_back(pole);
  spread.conservativeResize(spread.rows() + 1, 2);
  spread.bottomRows(1).setConstant(std::pow(frequency * std::abs(pole), 2));
  for (LocalPoles& own : local) own.poles.push_back(pole);
}

void ScatterState::erase(std::size_t r) {
  const auto at = static_cast<std::ptrdiff_t>(r);
  poles.erase(poles.begin() + at);
  const Index later = spread.rows() - 1 - static_cast<Index>(r);
  spread.middleRows(static_cast<Index>(r), later) = spread.bottomRows(later).eval();
  spread.conservativeResize(spread.rows() - 1, 2);
  for (LocalPoles& own : local) own.poles.erase(own.poles.begin() + at);
}

void ScatterState::join(std::size_t r, std::size_t other, const ResidualTerms& terms) {
  Complex sum = 0;
  for (LocalPoles& own : local) {
    if (own.fit.rise[static_cast<Index>(r)] > own.fit.rise[static_cast<Index>(other)]) own.poles[other] = own.poles[r];
    sum += own.poles[other];
  }
  const Complex gone = poles[r];
  poles[other] = sum / static_cast<double>(local.size());
  for (std::size_t k = 0; k < poles.size(); ++k) {
    // What the pole took leaves the FRFs apart: room to follow.
    const double width = -poles[k].real();
    if (std::abs(poles[k] - gone) < 6 * (width - gone.real()))
      spread.row(static_cast<Index>(k)).setConstant(0.1 * width * width);
  }
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (const LocalPoles& own : local) {
    const Complex b = own.poles[other] - poles[other];
    squares += Eigen::Vector2d(b.real() * b.real(), b.imag() * b.imag()) / static_cast<double>(local.size());
  }
  const auto at = static_cast<Index>(other);
  spread.row(at) = spread.row(at).cwiseMax(squares.transpose());
  erase(r);
  refit(terms);
}

void ScatterState::refit(const ResidualTerms& terms) {
  for (LocalPoles& own : local) {
    own.fit = fit_poles(own.band, own.poles, terms, true);
    own.damping = 0;
  }
}

void ScatterState::sweep(const ResidualTerms& terms, int sweeps) {
  for (int i = 0; i < sweeps && !poles.empty(); ++i) {
    step_locals(*this, terms);
    step_common(*this);
  }
}

void ScatterState::settle(const ResidualTerms& terms) {
  constexpr int kMost = 40, kPatience = 3;
  constexpr double kGain = 0.5;  // of -2 log likelihood: less says nothing
  ScatterState best = *this;
  double least = deviance();
  for (int i = 0, idle = 0; i < kMost && idle < kPatience && !poles.empty() && !WorkLimit::over(); ++i) {
    sweep(terms, 1);
    const double now = deviance();
    idle = now < least - kGain ? 0 : idle + 1;
    if (now >= least) continue;
    least = now;
    best = *this;
  }
  *this = std::move(best);
}

MatrixXd ScatterState::information() const { return eliminate(*this).information; }

double ScatterState::deviance() const {
  const VectorXd prior = precision_of(spread);
  double sum = 0;
  for (const LocalPoles& own : local) {
    const double variance = own.variance();
    const double data = real_data(own.band) / correlated;
    const VectorXd b = offset_of(own.poles, poles);
    MatrixXd a = own.fit.jtj / (variance * correlated);
    a = prior.cwiseSqrt().cwiseInverse().asDiagonal() * a * prior.cwiseSqrt().cwiseInverse().asDiagonal();
    a.diagonal().array() += 1;
    sum += data * std::log(variance) + b.dot(prior.cwiseProduct(b)) +
           2 * Eigen::LLT<MatrixXd>(a).matrixL().toDenseMatrix().diagonal().array().log().sum();
  }
  return sum;
}

Eigen::MatrixXcd ScatterState::residual(const Band& band, const ResidualTerms& terms) const {
  Eigen::MatrixXcd result(band.lines(), band.channels());
  for (Index c = 0; c < band.channels(); ++c) {
    const LocalPoles& own = local[static_cast<std::size_t>(c)];
    result.col(c) = residual_of(own.band, own.poles, terms, own.fit);
  }
  return result;
}

double ScatterState::design_effect(const Band& band, Index part) const {
  double effect = 1;
  for (const bool by_column : {false, true}) {
    const Index groups = by_column ? band.grid.cols() : band.grid.rows(), members = band.grid.size() / groups;
    if (groups < 2 || members < 2) continue;
    double between = 0, within = 0;
    for (std::size_t r = 0; r < poles.size(); ++r) {
      if (!inside(static_cast<Index>(r))) continue;
      MatrixXd offset(members, groups);
      for (Index g = 0; g < groups; ++g) {
        for (Index m = 0; m < members; ++m) {
          const int c = by_column ? band.grid(m, g) : band.grid(g, m);
          const Complex d = local[static_cast<std::size_t>(c)].poles[r] - poles[r];
          offset(m, g) = (part == 0 ? d.real() : d.imag()) / std::abs(poles[r]);
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

}  // namespace whirl::modal
