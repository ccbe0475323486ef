#pragma once
#include <Eigen/Core>
#include <optional>

#include "whirl/core/quantity.hpp"
#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::signal {

/// What the peak of a sine is multiplied by to state it as `kind`.
double factor_from_peak(AmplitudeKind kind);

/// Displacement, velocity and acceleration of one motion, converted in the frequency domain: integration divides a line
/// of frequency f by j 2 pi f. It is exact for each line. What a sensor drifts by at low frequency grows with 1/f, so
/// that a lower limit is needed; what was left out below it is stated.

/// How many times `from` is integrated over time to give `to`: 1 from acceleration to velocity, -1 from velocity to
/// acceleration, 0 for the same quantity; nothing where one of them is no motion.
std::optional<int> integrations(Quantity from, Quantity to);

/// Frequencies that are kept, Hz.
struct Band {
  double low = 10, high = 1000;  ///< ISO 20816-1: broad-band vibration of housings
};

/// The motion integrated `times` times (negative: differentiated) within the band, gain 1 from `low` to `high` with
/// cosine flanks down to low / 2 and up to 1.1 high. Mean and trend are taken off first. About 3/low s at either end
/// are less exact: there the filter looks beyond the record. Throws Error unless 0 < low < high, and where the record
/// holds less than two periods of `low`.
Eigen::VectorXd integrated(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int times, const Band& band = {});

/// The vectors as those of another quantity: Z (j order Omega)^-times, exact at every speed. Throws Error where the
/// quantity of the curve is no motion.
SynchronousCurve in_quantity(SynchronousCurve curve, Quantity quantity);

/// Broad-band level of a record, rms, from the lines of Hann blocks (half overlapping).
struct BandLevel {
  double rms = 0;            ///< over the record
  double largest = 0;        ///< of the block with the largest level
  double below = 0;          ///< rms of what lies below the band: slow motion, or drift of the sensor
  double low = 0, high = 0;  ///< Hz: the band, up to half the sample rate
  double block = 0;          ///< s: length of one block
  Eigen::Index blocks = 0;   ///< those that hold every sample
};
/// Of x integrated `times` times. Blocks of 40 periods of `band.low`, or the whole record where it is shorter. A block
/// with a missing sample (NaN) is left out. Nothing where no block is left or the record has less than ten periods of
/// `band.low`, or samples slower than 2.5 times it.
std::optional<BandLevel> band_level(const Eigen::Ref<const Eigen::VectorXd>& x, double dt, int times,
                                    const Band& band = {});

}  // namespace whirl::signal
