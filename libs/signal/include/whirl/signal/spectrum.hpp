#pragma once
#include <Eigen/Core>

#include "whirl/core/quantity.hpp"
#include "whirl/signal/window.hpp"

namespace whirl::signal {

struct SpectrumOptions {
  Window window = Window::hann;
  AmplitudeKind kind = AmplitudeKind::peak;  ///< how amplitudes are stated
  Eigen::Index block = 0;                    ///< samples per averaged block; 0 = the whole record as one block
  double overlap = 0.5;                      ///< of successive blocks, in [0, 0.95]
};

/// Amplitudes on a frequency axis. One-sided for a real signal.
struct AmplitudeSpectrum {
  Eigen::VectorXd frequency;  ///< Hz, uniform
  Eigen::VectorXd amplitude;  ///< unit of the signal, stated as `kind`; rms average over the blocks
  AmplitudeKind kind = AmplitudeKind::peak;
  double noise_bandwidth = 0;  ///< Hz: equivalent noise bandwidth of one line
};

/// One-sided amplitude spectrum of a real signal, corrected for the gain of the window: a sine on a line shows its
/// amplitude of the chosen kind. The mean is shown at 0 Hz as it is, whatever the kind. Throws Error unless dt > 0.
AmplitudeSpectrum amplitude_spectrum(const Eigen::Ref<const Eigen::VectorXd>& x, double dt,
                                     const SpectrumOptions& options = {});

/// Full spectrum of an orbit: transform of z = x + j y, forward whirl at positive, backward whirl at negative
/// frequency. A circular orbit of radius R shows one line of height R (kind peak).
AmplitudeSpectrum full_spectrum(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                                double dt, const SpectrumOptions& options = {});

}  // namespace whirl::signal
