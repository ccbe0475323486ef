#pragma once
#include <algorithm>
#include <complex>
#include <random>
#include <vector>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/rotor_model.hpp"

namespace whirl::response {

/// Rotors drawn from the covariance (5 x 5, row-major) of (k1, k2, c, eps_re, eps_im).
class CovarianceDraws {
 public:
  CovarianceDraws(const RotorModel& rotor, const std::vector<double>& covariance, unsigned seed)
      : rotor_(rotor), random_(seed) {
    if (covariance.size() != 25) throw Error("a band needs the model's covariance of k1, k2, c, eps");
    const Eigen::Map<const Eigen::Matrix<double, 5, 5>> c(covariance.data());
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd(0.5 * (c + c.transpose())));
    root_ = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
  }
  RotorModel operator()() {
    Eigen::Matrix<double, 5, 1> white;
    for (double& x : white) x = normal_(random_);
    const Eigen::Matrix<double, 5, 1> change = root_ * white;
    RotorModel r = rotor_;
    r.k1 = std::max(r.k1 + change[0], 1e-9);
    r.k2 += change[1];
    r.c += change[2];
    r.eps += std::complex<double>(change[3], change[4]);
    return r;
  }

 private:
  RotorModel rotor_;
  Eigen::Matrix<double, 5, 5> root_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

}  // namespace whirl::response
