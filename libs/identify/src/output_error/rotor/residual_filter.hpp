#pragma once
#include <Eigen/Core>

#include "whirl/identify/rotor_record.hpp"

namespace whirl::identification::detail {

/// What stands between a residual in m and independent numbers of variance 1: the size and colour of the noise, samples
/// left out, and what is estimated beside the motion without being a parameter (mains hum, slow drift; a linear
/// part projected out, Golub and Pereyra 1973).
class ResidualFilter {
 public:
  explicit ResidualFilter(const RotorRecord& record);

  /// Columns of readings, x above y, m; whitened in place.
  void apply(Eigen::Ref<Eigen::MatrixXd> columns) const;
  /// Hum and drift of a residual (x above y, m), m.
  Eigen::VectorXcd beside(const Eigen::VectorXd& residual) const;
  bool has_beside() const { return base_.cols() > 0; }
  bool masks() const { return used_x_.size() > 0; }
  /// Usable samples of x and y, 1 or 0; only when masks().
  const Eigen::ArrayXd& used_x() const { return used_x_; }
  const Eigen::ArrayXd& used_y() const { return used_y_; }
  /// Of clipped axes a reading between the limits counts as it is, one at a limit by the probability of lying there or
  /// beyond (Tobin 1958): its residual, sd sqrt(-2 log P), m. Not beside coloured noise, hum or drift.
  bool censors() const { return censored_; }
  /// Puts these into `residual` (x above y); returns by what the derivatives of the readings are to be multiplied.
  Eigen::ArrayXd censor(const RotorRecord& record, const Eigen::VectorXcd& model, Eigen::VectorXd& residual) const;
  /// Independent numbers in a whitened residual.
  double values() const { return values_; }

 private:
  void whiten(Eigen::Ref<Eigen::VectorXd> v, double sd, const Eigen::ArrayXd& weight) const;

  Eigen::Index n_;
  bool censored_;
  double sd_x_, sd_y_, values_;
  Eigen::VectorXd colour_;
  Eigen::ArrayXd used_x_, used_y_;         ///< empty: all samples
  Eigen::ArrayXd weight_x_, weight_y_;     ///< 0 also where the colour reaches back to a sample left out
  Eigen::MatrixXd base_;                   ///< columns of hum and drift, the same for both axes
  Eigen::MatrixXd q_x_, q_y_, r_x_, r_y_;  ///< of the whitened base; empty for an axis not measured
};

}  // namespace whirl::identification::detail
