#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "fit/pole_fit.hpp"

namespace whirl::modal {

/// One FRF with its own poles.
struct LocalPoles {
  Band band;
  Poles poles;
  PoleFit fit;
  double damping = 0;  ///< Levenberg's, relative to the information's diagonal

  /// Variance of one weighted real datum.
  double variance() const;
};

/// Poles p_r common to all FRFs and those of every FRF about them, p_r + b_kr with b_kr ~ N(0, spread).
struct ScatterState {
  Poles poles;
  std::vector<LocalPoles> local;
  Eigen::MatrixXd spread;  ///< poles x 2: variance of Re and Im, (rad/s)^2
  /// By how much intervals widen since `spread` is itself an estimate: Student's t over the normal quantile.
  Eigen::MatrixXd student;
  bool chosen = false;                ///< no poles come or go any more
  double correlated = 1;              ///< lines that count as one
  Eigen::Vector2d repeated = {1, 1};  ///< channels that stray as one (damping, frequency): see design_effect
  double frequency_scatter = 0, damping_scatter = 0;
  double low = 0, high = 0;  ///< Hz, of the band

  ScatterState(const Band& band, const Poles& start, const ResidualTerms& terms);

  /// Poles outside stand for what the residuals cannot: how they differ says nothing of the structure.
  bool inside(Eigen::Index r) const;

  void insert(std::complex<double> pole);
  void erase(std::size_t r);
  /// Takes out pole r; every FRF keeps of r and `other` the one that it shows, as its own pole of `other`.
  void join(std::size_t r, std::size_t other, const ResidualTerms& terms);
  /// Fits of every FRF at its poles, after poles came or went.
  void refit(const ResidualTerms& terms);
  /// Rounds of a step of every FRF's own poles, then of the common ones and the spread. One damped step a round, no
  /// `descend` to the end: the prior moves in between.
  void sweep(const ResidualTerms& terms, int sweeps);
  /// Sweeps until the likelihood grows no more; the best state on the way stays. A pole outside the band can run away.
  void settle(const ResidualTerms& terms);

  /// Of the common poles once the offsets are eliminated.
  Eigen::MatrixXd information() const;
  /// -2 log likelihood, up to a constant of the data.
  double deviance() const;
  Eigen::MatrixXcd residual(const Band& band, const ResidualTerms& terms) const;
  /// How much more the mean of the channels' offsets varies than if every channel strayed on its own: FRFs of one
  /// reference (or of one response) may have been measured together. Analysis of variance over the groups, all modes
  /// taken together; `part`: 0 damping, 1 frequency.
  double design_effect(const Band& band, Eigen::Index part) const;
};

}  // namespace whirl::modal
