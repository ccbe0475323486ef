#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::modal {

struct FddOptions {
  double band_low = 0, band_high = 0;  ///< Hz; 0 = first line, 80 % of half the sample rate
  double line = 0;                     ///< resolution wanted, Hz; 0 = 64 blocks of the record, half overlapping
  double prominence = 6;               ///< dB by which a peak of the first singular value stands above its surroundings
  double least_mac = 0.8;              ///< of the shapes that belong to the bell of one mode
};

/// A mode seen in records of an unknown, broad-band excitation. Shapes are unscaled: the force is not known.
struct AmbientMode {
  double frequency = 0;    ///< Hz, undamped
  double damping = 0;      ///< ratio; NaN when the bell is too narrow for it
  Eigen::VectorXcd shape;  ///< per channel, largest component 1
};

struct AmbientModes {
  std::vector<std::string> channels;
  std::vector<AmbientMode> modes;   ///< ascending in frequency
  Eigen::VectorXd frequency;        ///< Hz, of the spectra
  Eigen::MatrixXd singular_values;  ///< lines x channels, descending, (unit)^2/Hz
  Summary summary;
};

/// Frequency domain decomposition (Brincker, Zhang, Andersen, 2001): singular values of the cross-spectral matrix of
/// all channels, averaged over Hann blocks. Peaks of the first are modes, its vector there the shape. Frequency and
/// damping come from the decay of the bell's autocorrelation (enhanced FDD), which is freed of the lag window of the
/// Hann blocks. Damping assumes white excitation.
/// Tones are taken off the record first, each with a warning. Channels must be of one quantity. Throws Error for too
/// short records.
AmbientModes decompose_ambient(const Recording& recording, const FddOptions& options = {});

}  // namespace whirl::modal
