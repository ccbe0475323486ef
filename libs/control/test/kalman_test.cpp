// The estimator against a Kalman filter in matrices, as textbooks write it.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <random>

#include "whirl/control/estimators.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;
using Matrix = Eigen::Matrix3cd;

constexpr double kStep = 2e-3, kStiffness = 9000, kDamping = 40;

/// Linear rotor at rest, states z, v and the disturbance theta with acceleration g theta; every sample is predicted by
/// the matrix exponential to second order, the process noise is an acceleration held for a sample.
struct Filter {
  KalmanOptions noise;
  Matrix P = Matrix::Zero();
  Eigen::Vector3cd x = Eigen::Vector3cd::Zero();

  static Matrix rates(Complex g) {
    Matrix A = Matrix::Zero();
    A(0, 1) = 1;
    A(1, 0) = -kStiffness, A(1, 1) = -kDamping, A(1, 2) = g;
    return A;
  }
  static Matrix over_a_step(const Matrix& A) { return Matrix::Identity() + kStep * A + 0.5 * kStep * kStep * A * A; }
  /// `g` at its beginning, `mean` over the step, which is what the covariance takes.
  void predict(Complex a, Complex g, Complex mean, double walk) {
    const Matrix A = rates(g), F = over_a_step(rates(mean));
    const Eigen::Vector3cd input(0, a, 0), by_input = kStep * input + 0.5 * kStep * kStep * A * input;
    x = (over_a_step(A) * x + by_input).eval();
    const Eigen::Vector3cd held(0.5 * kStep * kStep, kStep, 0);
    P = (F * P * F.adjoint()).eval() + std::pow(noise.acceleration_noise, 2) * held * held.adjoint();
    P(2, 2) += walk * walk * kStep;
  }
  void update(Complex z) {
    const Complex s = P(0, 0) + std::pow(noise.measurement_noise, 2);
    const Eigen::Vector3cd K = P.col(0) / s;
    x += K * (z - x(0));
    P -= (K * P.row(0)).eval();
  }
};

class KalmanOfAllKindsReference : public ::testing::TestWithParam<DisturbanceState> {};

TEST_P(KalmanOfAllKindsReference, IsTheFilterInMatrices) {
  const DisturbanceState kind = GetParam();
  const bool third = kind != DisturbanceState::none;
  const Complex forcing(300, -120), eps(2e-4, -1e-4), given(0.4, 0.7);
  const KalmanOptions noise{.measurement_noise = 3e-5,
                            .acceleration_noise = 4,
                            .disturbance_walk = kind == DisturbanceState::eccentricity ? 2e-4 : 0.6,
                            .disturbance_prior = kind == DisturbanceState::eccentricity ? 3e-4 : 2};
  LateralModel model;
  model.k1 = kStiffness;
  model.c = kDamping;
  KalmanEstimator estimator(model, kind, eps, noise, kStep);
  std::mt19937_64 random(12);
  std::normal_distribution<double> normal;
  const auto draw = [&](double size) { return Complex(size * normal(random), size * normal(random)); };
  const auto regressor = [&](int k) {  // it jumps round, so that no covariance is real by accident
    return kind == DisturbanceState::eccentricity ? forcing * std::polar(1 + 0.1 * (k % 3), 0.7 * k) : Complex(1);
  };
  for (int round = 0; round < 2; ++round) {
    Filter filter{noise};
    for (int k = 0; k < 60; ++k) {
      const Complex g = regressor(k), last = regressor(std::max(k - 1, 0));
      EstimatorInput in;
      in.z = draw(1e-3);
      in.fresh = k % 7 != 3;
      in.a_second = draw(3);
      in.forcing = regressor(k);
      in.d = given;
      in.omega = k == 0 && kind != DisturbanceState::oscillator ? -50 : 0;  // a whirl at the first sample
      const DiskMotion s = estimator.step(in);
      if (k == 0) {
        const Complex v = Complex(0, in.omega) * in.z;
        filter.x << in.z, v, kind == DisturbanceState::eccentricity ? eps : Complex(0);
        filter.P.diagonal() << std::pow(noise.measurement_noise, 2), std::norm(v) + 1e-4,
            third ? std::pow(noise.disturbance_prior, 2) : 0;
      } else {
        filter.predict(in.a_second + (third ? Complex(0) : given), third ? last : Complex(0),
                       third ? 0.5 * (last + g) : Complex(0), third ? noise.disturbance_walk : 0);
        if (in.fresh) filter.update(in.z);
      }
      ASSERT_LT(std::abs(s.z - filter.x(0)), 1e-12) << k;
      ASSERT_LT(std::abs(s.v - filter.x(1)), 1e-9) << k;
      ASSERT_LT(std::abs(s.d - (third ? g * filter.x(2) : given)), 1e-8) << k;
    }
    estimator.reset();
  }
}

INSTANTIATE_TEST_SUITE_P(All, KalmanOfAllKindsReference,
                         ::testing::Values(DisturbanceState::none, DisturbanceState::eccentricity,
                                           DisturbanceState::oscillator));

}  // namespace
}  // namespace whirl::control
