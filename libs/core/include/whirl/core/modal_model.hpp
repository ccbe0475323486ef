#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"

namespace whirl {

/// Motion per force. The power of s that leads from receptance: 0, 1, 2.
enum class FrfKind { receptance = 0, mobility = 1, accelerance = 2 };
std::string_view to_string(FrfKind kind);

enum class FrfEstimator { h1, h2, hv };
std::string_view to_string(FrfEstimator estimator);

/// One measured frequency response, response at a point per force at a point.
struct FrfChannel {
  std::string response;       ///< name of the response point and direction, e.g. "3:+Z"
  std::string reference;      ///< name of the reference (force) point and direction
  Eigen::VectorXcd value;     ///< SI: m/N, m/(s N) or m/(s^2 N) by kind
  Eigen::VectorXd coherence;  ///< gamma^2 in [0, 1]; empty when only one record was averaged (then undefined)
  Eigen::VectorXd variance;   ///< variance of |value| per line; empty when unknown
};

/// Frequency responses on one uniform frequency axis.
struct FrequencyResponse {
  Eigen::VectorXd frequency;  ///< Hz, uniform, ascending
  FrfKind kind = FrfKind::accelerance;
  FrfEstimator estimator = FrfEstimator::h1;
  std::vector<FrfChannel> channels;
  double window_decay = 0;  ///< sigma_w of the exponential window, 1/s; poles found carry it (docs: modal)
  long averages = 0;        ///< number of blows averaged; 0: not made from blows
  /// No end of a record and no window is in them (shaker records): peaks narrower than a line are true.
  bool leakage_free = false;
  Summary summary;
  Provenance provenance;
};

/// Damping of the modes of a fit. Hysteretic (structural): stiffness k (1 + i eta), a/(s - p) - a/(s + p) instead of a
/// conjugate pair; then `frequency` is sqrt(k/m) / 2 pi and `damping` eta / 2.
enum class DampingModel { viscous, hysteretic };
std::string_view to_string(DampingModel model);

/// One conjugate pole pair p = -zeta w0 + i w0 sqrt(1 - zeta^2) with its residues.
struct Mode {
  Estimate frequency;         ///< undamped natural frequency |p| / 2 pi, Hz
  Estimate damping;           ///< zeta
  std::complex<double> pole;  ///< rad/s, Im > 0, window damping removed
  Eigen::VectorXcd residues;  ///< one per FrfChannel, receptance residues a of paper eq. 20
  /// Pole of each FrfChannel less `pole`, rad/s, where the FRFs differ (roving sensors, warming); empty when they
  /// agree.
  Eigen::VectorXcd offsets = {};
  double frequency_scatter = 0;  ///< relative standard deviation of the frequency between FRFs
  double damping_scatter = 0;    ///< standard deviation of the damping ratio between FRFs
  /// Where the pole depends on the amplitude: the pole just after the average blow less `pole`, which is that of small
  /// motion, rad/s. Zero when no dependence is seen.
  std::complex<double> amplitude_offset = 0;
};

/// What a mode whose stiffness or damping depends on the amplitude adds to the response to a blow. Its ringing
/// A exp(p t) changes its pole by an offset that decays with the square of the amplitude, which adds poles
/// 3 Re p + j Im p, 5 Re p + j Im p, ..., and distorts, which adds poles 2 p (stiffness not symmetric) and 3 p.
struct AmplitudeTerm {
  std::size_t mode = 0;        ///< index in ModalModel::modes
  double decay = 3, turn = 1;  ///< its pole: decay Re p + j turn Im p
  std::complex<double> pole;   ///< rad/s
  /// One per FrfChannel. With turn = 1 the term is a/(s - pole) - a/(s - p), so that the residues of the mode are those
  /// of small motion; with another turn a/(s - pole). Both with the conjugate.
  Eigen::VectorXcd residues;
};

/// Poles, residues and residuals of paper eq. 20.
struct ModalModel {
  std::vector<Mode> modes;                    ///< ascending in frequency
  std::vector<AmplitudeTerm> amplitude = {};  ///< nonlinear part of the response, no modes
  Eigen::VectorXcd lower;                     ///< lower residual L per channel: L / s^2 in receptance
  Eigen::VectorXcd upper;                     ///< upper residual U per channel
  Eigen::VectorXcd upper_slope;        ///< its next term U2 per channel: U + U2 s^2 in receptance; zero when not fitted
  std::vector<std::string> responses;  ///< response point and direction per channel
  std::vector<std::string> references;  ///< reference point and direction per channel
  double window_decay = 0;              ///< 1/s, of the exponential window: removed from `modes`
  FrfKind kind = FrfKind::accelerance;  ///< of the FRFs fitted
  double band_low = 0, band_high = 0;   ///< Hz
  double reconstruction_error = 0;      ///< norm(measured - model) / norm(measured) inside the band
  DampingModel damping_model = DampingModel::viscous;
  double frequency_scatter = 0;  ///< relative sd of the natural frequencies between FRFs, all modes; 0 = none seen
  double damping_scatter = 0;    ///< sd of the damping ratios between FRFs, all modes; 0 = none seen
  double noise_floor = 0;        ///< the same from the measured variance; 0 when unknown
  Summary summary;
  Provenance provenance;
};

}  // namespace whirl
