#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/banded_cholesky.hpp"
#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification::detail {

using Complex = std::complex<double>;

/// Order-tracked test functions on one record: rows ordered by centre, forward (e^{-i beta}) then backward (e^{+i
/// beta}). The phase beta(t_c) of the centre is left out: it turns a row as a whole and no result depends on it.
class WeakRows {
 public:
  using Parts = Eigen::Matrix<double, Eigen::Dynamic, 4>;

  /// `half` samples on either side of a centre; a centre every half / 4 samples.
  /// `angle` may be a corrected one of the record. Windows of which less than half is measured are left out; the noise
  /// of a row follows the samples left out and, where it is coloured, its density at the speed of the centre. Of one
  /// axis there are forward rows only.
  WeakRows(const RotorRecord& record, const AngleSignal& angle, Eigen::Index half);

  Eigen::Index size() const { return static_cast<Eigen::Index>(rows_.size()); }

  /// P_k v, k = 0, 1, 2, for every row.
  Eigen::VectorXcd apply(int k, const Eigen::VectorXcd& v) const;
  /// Action of the linearised rotor on a displacement added to z: P2 v + P0 (stiffness v) - c P1 v.
  Eigen::VectorXcd rotor(const Eigen::VectorXcd& v, const Eigen::VectorXd& stiffness, double c) const;
  /// Factor of the covariance L L^H of the row noise per unit variance of z. An error n of z is taken for the force
  /// stiffness n + turned_stiffness conj n: k1 + 2 k2 |z|^2 and, in size, k2 |z|^2 per sample. (That real and
  /// imaginary part of a row then depend on each other is left out; their sum of squares is right.)
  BandedCholesky<Complex> whitener(const Eigen::VectorXd& stiffness, const Eigen::VectorXd& turned_stiffness,
                                   double c) const;
  /// e^{i beta} and F = e^{i beta} (beta'^2 - i beta'') at the samples.
  Eigen::VectorXcd carrier() const;
  Eigen::VectorXcd forcing() const;

 private:
  struct Row {
    Eigen::Index first;  ///< first sample of the window
    bool backward;
  };
  /// v e^{-i beta} and v e^{i beta}: real and imaginary part of each.
  Parts turned(const Eigen::VectorXcd& v) const;
  /// Sums of the parts over each window.
  void add_sums(const Eigen::VectorXd& window, const Parts& parts, Eigen::VectorXcd& into) const;

  Eigen::Index half_ = 0, step_ = 0;
  double dt_ = 0;
  std::vector<Row> rows_;
  Eigen::VectorXd phi_, phi_t_, phi_tt_;
  Eigen::ArrayXd noise_;                      ///< sd of the noise of each sample over that of a usable white one
  Eigen::ArrayXd omega_, alpha_, cos_, sin_;  ///< cos and sin of beta
};

/// The equation of motion in weak form on one record, with z taken about the equilibrium.
struct WeakSystem {
  Eigen::MatrixXcd terms;  ///< columns -P0 z, -P0 (|z|^2 - 2 s2) z, P1 z, P0 F, P0 1, -P0 conj z, P1 conj z
  Eigen::VectorXcd right;  ///< P2 z
};
WeakSystem weak_system(const WeakRows& rows, const Eigen::VectorXcd& z, double noise_variance,
                       const Eigen::VectorXcd& forcing);

/// Real equations from complex ones: real rows above imaginary rows.
Eigen::VectorXd stack(const Eigen::VectorXcd& v);
/// |z|^2 smoothed by a Gaussian of 20 ms, noise removed, not negative.
Eigen::VectorXd smooth_square(const Eigen::VectorXcd& z, double dt, double noise_variance);
/// Half-width in samples of the default test function, see WeakRotorOptions::half_width.
Eigen::Index default_half_width(const RotorRecord& record);

}  // namespace whirl::identification::detail
