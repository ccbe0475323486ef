#pragma once
#include <Eigen/Core>

#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {

/// The loop response from excitations of known spectrum, with its noise.
///
/// The sensitivity is what is averaged: S = 1 + E[U conj(D)] / E[|D|^2], U the controller's answer to the excitation D.
/// Noise of U does not bias it, and L = 1/S - 1. What a law whose gain follows the motion scatters from line to line is
/// noise that every excitation draws anew (best linear approximation by several random-phase multisines: Pintelon and
/// Schoukens, System Identification, 2012, sec. 4.3). The noise of a line is that of the excitations about their mean.
///
/// Neighbouring lines share a smooth response: the estimate at a line is a local parabola through its neighbours, over
/// the widest window on which the lines keep to it within their noise. A peak narrower than that noise shows is not
/// smoothed away, one that the noise hides is.
class ResponseEstimate {
 public:
  explicit ResponseEstimate(Eigen::Index samples);

  /// Spectra (signal::fft) of the answer and of the excitation of one window.
  void add(const Eigen::VectorXcd& answer, const Eigen::VectorXcd& excitation);

  /// Lines from the lowest frequency on, without that at zero. From one excitation alone: as measured, noise not known.
  LoopResponse response(double sample_time) const;

 private:
  Eigen::VectorXcd sum_;
  Eigen::VectorXd squares_;
  int count_ = 0;
};

/// Whether no line, two standard deviations higher, would raise the peak sensitivity by more than a twentieth. False
/// where the noise is not known.
bool peak_is_certain(const LoopResponse& response);

}  // namespace whirl::tuning
