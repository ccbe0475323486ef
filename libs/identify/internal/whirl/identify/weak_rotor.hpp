#pragma once
#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/identify/rotor_terms.hpp"

namespace whirl::identification {

struct WeakRotorOptions {
  /// Half-width T of the test functions, s; 0: 1.8 turns at the speed of the largest vibration (0.15 s at 12 Hz).
  double half_width = 0;
  int passes = 4;               ///< the first without, the others with generalised least squares, >= 1
  bool conj_stiffness = false;  ///< term -k1_conj conj(z): stiffness differs between two axes
  bool conj_damping = false;    ///< term -c_conj conj(z')
  bool runout = false;          ///< beside the motion z turns runout e^{i beta}, per record
  /// A linear force that drives a forward whirl by itself (TermEntry::drives_whirl), beside the others.
  std::optional<RotorTerm> whirl_force;
};

/// Result of the weak fit. Parameters in the order of `names`.
struct WeakRotorFit {
  RotorModel model;                          ///< eps and offset of the first record
  std::vector<std::complex<double>> eps;     ///< per record, m
  std::vector<std::complex<double>> offset;  ///< per record, m
  std::vector<std::complex<double>> runout;  ///< per record, m; its force by the damping is left out
  std::vector<RotorTerm> terms;              ///< the whirl_force asked for
  std::vector<std::string> names;  ///< k1, k2, c, [k1_conj_re, ...], [c_rotating or k_cross], then per record eps_re,
                                   ///< eps_im, d_re, d_im, [runout_force_re, runout_force_im: of k1 runout]
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;  ///< from the noise alone, not scaled by chi_square
  Eigen::Index rows = 0;       ///< real equations used
  double half_width = 0;       ///< T used, s
  Summary summary;             ///< chi_square; condition number of the whitened, column-scaled matrix
};

/// Rotor parameters from the weak form of the second-order equation with order-tracked test functions and generalised
/// least squares: no derivative of data, no starting guess.
///
/// Test function psi = (1 - s^2)^6 e^{-i (beta(t) - beta(t_c))}, s = (t - t_c) / T, a centre every T / 4. With
/// P_k v = dt sum psi^(k) v each row reads
///
///   P2 z = -k1 P0 z - k2 P0 (|z|^2 - 2 s2) z + c P1 z + eps P0 F + d P0 1
///        [- k1_conj P0 conj z + c_conj P1 conj z] [+ c_rotating (P1 z + P0 i w z)] [+ k_cross P0 i z],     s2 = noise
///        variance of z
///
/// (2 s2 removes the bias that noise gives to the cubic). A second set of rows with e^{+i beta} sees backward whirl;
/// without it the conj terms are not observable. Row noise is L n with L = P2 + k1 P0 - c P1 + P0 2 k2 |z|^2; its
/// band covariance is factored to whiten the rows. The constant force d moves into the sensor offset d / k1.
///
/// Records share k1, k2, c and the conj terms; eps and offset belong to each. Status unusable with a reason when a
/// record is, or the equations are singular. Throws Error for an empty list or bad options.
WeakRotorFit fit_weak_rotor(const std::vector<RotorRecord>& records, const WeakRotorOptions& options = {});

}  // namespace whirl::identification
