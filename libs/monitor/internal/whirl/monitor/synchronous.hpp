#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

namespace whirl::monitor {

/// The 1X vector of each revolution, from samples of displacement and of the continuous rotor angle:
///
///   Z = (2 / turn) * integral over one turn of x exp(-j beta) d beta
///
/// so that x = Re(Z exp(j beta)), amplitude peak, positive phase leads (trapezoidal rule in the angle, which does not
/// need samples equal in angle). Works in both directions of rotation; a lost sample drops the revolution it is in.
class SynchronousTracker {
 public:
  explicit SynchronousTracker(Eigen::Index channels, double rate)
      : rate_(rate), sum_(Eigen::VectorXcd::Zero(channels)) {}

  struct Revolution {
    double speed = 0;         ///< rad/s, signed, mean over the turn
    double end = 0;           ///< s after the first sample of the call that completed it
    Eigen::VectorXcd vector;  ///< per channel
  };
  /// One row per channel set; returns the revolutions completed.
  std::vector<Revolution> push(const Eigen::Ref<const Eigen::VectorXd>& beta,
                               const Eigen::Ref<const Eigen::MatrixXd>& displacement);
  void reset();

 private:
  double rate_;
  Eigen::VectorXcd sum_;
  Eigen::VectorXd last_;  ///< displacement of the previous sample
  double last_beta_ = 0, turned_ = 0;
  double samples_ = 0;  ///< since the start of the turn, fractional
  bool valid_ = false;
};

}  // namespace whirl::monitor
