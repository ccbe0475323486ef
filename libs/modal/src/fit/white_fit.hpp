#pragma once
#include "pole_fit.hpp"
#include "whirl/modal/fit_modes.hpp"

namespace whirl::modal {

/// A pole that others determine: decay Re p + j turn Im p of the pole `parent` (see AmplitudeTerm), and as much of the
/// pole `other` with its own factors.
struct Tie {
  std::size_t parent = 0;
  double decay = 3, turn = 1;
  std::size_t other = 0;
  double other_decay = 0, other_turn = 0;

  std::complex<double> of(const Poles& poles) const {
    return {decay * poles[parent].real() + other_decay * poles[other].real(),
            turn * poles[parent].imag() + other_turn * poles[other].imag()};
  }
};

/// d (Re, Im of all poles) / d (Re, Im of those that are free), where the last poles are tied.
Eigen::MatrixXd tie_slopes(std::size_t poles, const std::vector<Tie>& ties);

/// Poles refined under equal, independent noise in every line (weights), all FRFs having the same poles.
struct Refined {
  Poles poles;
  PoleFit fit;
  bool converged = false;
  Eigen::MatrixXcd residual = {};
  double correlated = 1;    ///< lines, see correlated_lines
  std::size_t started = 0;  ///< so many leading poles come from the stabilisation diagram, the others from the search
  std::vector<Tie> ties = {};  ///< of the last poles
  /// By how much (Re, Im) of the free poles may be off since further terms of the amplitude are left out, rad/s; empty
  /// without ties.
  Eigen::VectorXd truncation = {};

  std::size_t free() const { return poles.size() - ties.size(); }
};

/// Real data minus real parameters: residues and residuals of every channel, and the poles.
double freedom(const Band& band, const Poles& poles, const ResidualTerms& terms);

/// Variance of one weighted real datum; not below 1e-5 of the data, rms.
double noise_variance(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit);
double least_variance(const Band& band);

/// Gauss-Newton with Levenberg damping by the ratio of real to predicted gain (Nielsen), not by the rule of `descend`:
/// a rejected step costs a whole fit of residues, and which of two close modes a pole ends on depends on the path.
/// Stops when a step would gain less than 0.03 of one noise variance per pole, or would move nothing that matters. The
/// last poles of `start` follow the others as `ties` say.
Refined refine(const Band& band, const Poles& start, std::size_t started, const ResidualTerms& terms, int iterations,
               const std::vector<Tie>& ties = {});

/// -2 log likelihood + log(data) x parameters, as that of fit_scatter; `lines` count as one.
double description_length(const Band& band, const Refined& state, const ResidualTerms& terms, double lines = 1);

/// Energy of a pole, per residue parameter, that noise independent between `channels` FRFs does not reach by chance at
/// any place of the band: the chi-square quantile (Wilson and Hilferty) at 6.5 standard deviations for two residue
/// parameters per channel and the pole's own two. Not below 6, where small model errors begin to count, nor above 25.
double chance_gain(double channels);

/// Channels that would carry as much independent noise: fewer than there are where an error is common to several
/// (Satterthwaite, from the covariance of the weighted residuals).
double independent_channels(const Band& band, const Eigen::MatrixXcd& residual);

/// Drops poles that the data do not hold: damping out of range, real part not known to a factor, or an energy that
/// noise could have. Returns true when any was dropped.
bool drop_unsupported(const Band& band, Refined& state, const ResidualTerms& terms, const ModeOptions& options,
                      double correlated = 1);

/// Refines, searches what is left for missed modes and drops what the data do not hold. `equal`: the same lines without
/// weights, empty when `full` has none. Never leaves a larger error than the poles it started from.
Refined fit_white(const Band& full, const Band& equal, const Poles& start, const ResidualTerms& terms,
                  const ModeOptions& options);

/// Covariance of (Re, Im) of the free poles, in their order, from the scatter about the model; `correlated` lines count
/// as one.
Eigen::MatrixXd covariance_of(const Band& band, const Refined& state, const ResidualTerms& terms, double correlated);

/// The same from the scores of the lines themselves: holds when what is left is common to several FRFs (an error of the
/// force) or follows the resonance (sandwich covariance, blocks of `correlated` lines).
Eigen::MatrixXd line_covariance(const Band& band, const Refined& state, const ResidualTerms& terms, double correlated);

}  // namespace whirl::modal
