#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "whirl/modal/poles.hpp"

namespace whirl::modal {

/// The lines of a fit with their weights. Weights make the noise of every line and channel about equal.
struct Band {
  Eigen::VectorXd omega;        ///< rad/s, uniform, > 0
  Eigen::MatrixXcd h;           ///< lines x channels
  Eigen::MatrixXd weight;       ///< lines x channels
  Eigen::MatrixXi grid;         ///< outputs x references -> channel, as Grid::channel
  bool common_weight = false;   ///< all columns of `weight` are multiples of the first: one Gram matrix serves all
  bool guessed_weight = false;  ///< flat or proportional was chosen by the scatter between lines
  double decay = 0;             ///< of the exponential window, 1/s: the lines lie at s = decay + j omega
  bool leakage_free = false;    ///< no window, no end of a record
  int power = 0;                ///< d: 0 receptance, 1 mobility, 2 accelerance
  double low = 0, high = 0;     ///< Hz, first and last line
  double energy = -1;           ///< sum of (weight |h|)^2; negative: not summed up yet
  double noise_floor = 0;       ///< norm(noise)/norm(h) from the stated variances; 0 when they are unknown

  Eigen::Index lines() const { return h.rows(); }
  Eigen::Index channels() const { return h.cols(); }
  double line_width() const { return (high - low) / static_cast<double>(lines() - 1); }
};

/// Whether the frequency of a pole, |p| / 2 pi, lies in the band.
bool inside(const Band& band, std::complex<double> p);

/// Lines of the band (0 Hz excluded), checked; `low`, `high` in Hz as in PoleOptions.
Band select_band(const FrequencyResponse& frf, double low, double high, LineWeighting weighting);

/// The same lines with one weight for all channels: rms over the channels of the noise they imply.
Band with_common_weight(const Band& band);

/// FRFs as a grid of outputs (rows of H) and references (columns).
struct Grid {
  std::vector<std::string> outputs, references;
  Eigen::MatrixXi channel;  ///< outputs x references -> channel
};
/// References are taken jointly when every response was measured to each of them; else each channel is an output of its
/// own.
Grid arrange_grid(const FrequencyResponse& frf);

}  // namespace whirl::modal
