#pragma once
#include <Eigen/Core>

#include "whirl/signal/spectrum.hpp"

namespace whirl::signal {

/// Amplitude spectra of successive blocks.
struct Spectrogram {
  Eigen::VectorXd time;       ///< s, middle of each block, from the start of the signal
  Eigen::VectorXd frequency;  ///< Hz, uniform; also negative (backward whirl) in a full spectrogram
  Eigen::MatrixXd amplitude;  ///< frequencies x blocks, unit of the signal, stated as `kind`
  AmplitudeKind kind = AmplitudeKind::peak;
  double noise_bandwidth = 0;  ///< Hz, of one line
};

/// Spectra of about `columns` blocks of `options.block` samples, spread evenly over the signal (they overlap as far as
/// needed; `options.overlap` is not used). Of a sweeping tone a line shows the amplitude while the frequency moves by
/// less than a line per block: `sweep_block` chooses such a block. Throws Error as `amplitude_spectrum`.
Spectrogram spectrogram(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, const SpectrumOptions& options,
                        Eigen::Index columns = 200);
/// The same of z = x + j y: forward whirl at positive, backward whirl at negative frequency.
Spectrogram full_spectrogram(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& y,
                             double dt, const SpectrumOptions& options, Eigen::Index columns = 200);

/// Spectra of a turning shaft without the smear of its sweep: blocks of whole turns, about `options.block` samples long
/// and no fewer than four turns, at equal steps of the rotor angle. An order stays on its line however fast the speed
/// changes; a vibration of fixed frequency smears instead. Amplitudes of the lines stand at their frequency at the mean
/// speed of the block, on one grid of half a block's lines up to `highest` (Hz); `angle` (rad, rising) has one value
/// per sample. With `y`, the full spectra of x + j y. Throws Error as `resample_in_angle`, and for fewer than four
/// turns.
Spectrogram turning_spectrogram(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::VectorXd* y,
                                const Eigen::Ref<const Eigen::VectorXd>& angle, double dt, double highest,
                                const SpectrumOptions& options, Eigen::Index columns = 200);

/// Samples of a block in which a frequency changing at `rate` (Hz/s) moves by one line: sqrt(1 / rate). Between 64
/// samples and a quarter of the signal's `samples`.
Eigen::Index sweep_block(double rate, double dt, Eigen::Index samples);

}  // namespace whirl::signal
