#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/modal/poles.hpp"

namespace whirl::modal {

struct ResidueOptions {
  double band_low = 0;   ///< Hz; 0 = first line above 0 Hz
  double band_high = 0;  ///< Hz; 0 = last line
  LineWeighting weighting = LineWeighting::automatic;
  bool lower_residual = true;     ///< L / s^2: modes below the band, rigid-body motion
  bool upper_residual = true;     ///< U: modes above the band
  bool upper_slope = true;        ///< U2 s^2: their next term, felt near the upper edge
  bool complex_residuals = true;  ///< L, U, U2 complex: damped modes far outside, phase errors of the channels
};

/// Residues of given poles.
struct ResidueFit {
  Eigen::MatrixXcd residues;  ///< poles x channels, of receptance
  Eigen::VectorXcd lower;     ///< per channel; zero when not fitted
  Eigen::VectorXcd upper;
  Eigen::VectorXcd upper_slope;
  Eigen::VectorXd channel_error;    ///< norm(measured - model) / norm(measured) per channel, inside the band
  double reconstruction_error = 0;  ///< the same over all channels
};

/// Least-squares frequency-domain fit of paper eq. 20 for fixed poles (which is then linear). `poles` of the structure
/// in rad/s, Im > 0. With d = 0, 1, 2 for receptance, mobility, accelerance, and L, U, U2 real,
///
///   h(s) = s^d [ sum_k ( a_k/(s - p_k) + a_k* /(s - p_k*) ) + L/s^2 + U + U2 s^2 ],  s = sigma_w + j w.
///
/// An exponential window of decay sigma_w shows the response on that line of the s plane: nothing needs correcting
/// after.
ResidueFit fit_residues(const FrequencyResponse& frf, const std::vector<std::complex<double>>& poles,
                        const ResidueOptions& options = {});

/// The fitted response of one channel at the given frequencies (Hz), in the kind of the model. `window_decay` shows it
/// as seen through an exponential window.
Eigen::VectorXcd synthesise(const ModalModel& model, Eigen::Index channel,
                            const Eigen::Ref<const Eigen::VectorXd>& frequency, FrfKind kind, double window_decay = 0);

}  // namespace whirl::modal
