#include "whirl/control/estimators.hpp"

#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <map>
#include <random>

#include "whirl/control/method.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;
constexpr double kH = 1e-3;

/// 0.5 mm at 10 Hz circular plus noise: rms velocity error per axis over the last second, m/s.
template <class Estimator>
double velocity_error(Estimator estimator, double noise, double f = 10) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 1);
  const double w = 2 * std::numbers::pi * f;
  double sum = 0;
  for (int k = 0; k < 3000; ++k) {
    const double t = k * kH;
    EstimatorInput in;
    const double nx = normal(random), ny = normal(random);
    in.z = 0.5e-3 * unit_phasor(w * t) + noise * Complex{nx, ny};
    const Complex truth = 0.5e-3 * Complex{0, w} * unit_phasor(w * t);
    const DiskMotion s = estimator.step(in);
    if (k >= 2000) sum += std::norm(s.v - truth);
  }
  return std::sqrt(sum / 2000);
}

TEST(DifferentiatorReference, PublishedErrorsOnTheBenchmarkSignal) {
  // docs: 0.5 mm at 10 Hz with 2 um noise, peak 31.4 mm/s: backward difference 2.83, noise free the implicit
  // form 0.70 mm/s (half a sample of lag).
  const FilteredDifference difference(std::numeric_limits<double>::infinity(), kH);
  EXPECT_NEAR(velocity_error(difference, 2e-6), 2.9e-3, 0.2e-3);
  EXPECT_NEAR(velocity_error(difference, 0), 0.70e-3, 0.02e-3);
  const LevantDifferentiator implicit(4, kH, true), explicit_form(4, kH, false);
  EXPECT_NEAR(velocity_error(implicit, 0), 0.70e-3, 0.05e-3);
  EXPECT_LT(velocity_error(implicit, 2e-6), velocity_error(explicit_form, 2e-6));
  EXPECT_LT(velocity_error(implicit, 2e-6), velocity_error(difference, 2e-6));
}

TEST(DifferentiatorProperty, ImplicitStepAgainstBisection) {
  // x+ = x + h (w+ + k1 sig(y - x+)^(1/2)), w+ = w + h k2 Sgn(y - x+).
  std::mt19937_64 random(4);
  std::uniform_real_distribution<double> value(-1e-2, 1e-2), slope(-1, 1);
  for (int i = 0; i < 2000; ++i) {
    RobustDifferentiator d{20, value(random), slope(random)};
    const RobustDifferentiator before = d;
    const double y = before.x + value(random) * (i % 3 ? 1 : 1e-3), k1 = 1.5 * std::sqrt(20.0), k2 = 22;
    const auto residual = [&](double next, double sign) {
      return next - before.x - kH * (before.w + kH * k2 * sign + k1 * sig(y - next, 0.5));
    };
    double low = -1, high = 1;
    for (int k = 0; k < 200; ++k) {
      const double mid = 0.5 * (low + high);
      (residual(mid, y > mid ? 1 : -1) < 0 ? low : high) = mid;
    }
    d.implicit_step(y, kH);
    EXPECT_NEAR(d.x, 0.5 * (low + high), 1e-12);
  }
}

// Its answer to a ramp is that of a first-order low-pass: 1 - exp(-2 pi fc t), here 1 - exp(-pi) after 5 ms.
TEST(DifferentiatorReference, TheLowPassHasItsCutoff) {
  FilteredDifference lpf(100, kH);
  DiskMotion s;
  for (int k = 0; k <= 5; ++k) {
    EstimatorInput in;
    in.z = Complex{2, -3} * (kH * k);
    s = lpf.step(in);
    EXPECT_EQ(s.z, in.z);
  }
  EXPECT_NEAR(s.v.real(), 2 * 0.95678608, 1e-7);
  EXPECT_NEAR(s.v.imag(), -3 * 0.95678608, 1e-7);
}

// L = 4: k1 = 3, k2 = 4.4; with h = 1/4 worked out by hand.
TEST(DifferentiatorReference, OneExplicitStepByHand) {
  RobustDifferentiator above{4, 1, 0.5}, below{4, 1, 0.5};
  EXPECT_NEAR(above.explicit_step(0, 0.25), -0.6, 1e-15);
  EXPECT_NEAR(above.x, 0.375, 1e-15);
  EXPECT_NEAR(below.explicit_step(2, 0.25), 1.6, 1e-15);
  EXPECT_NEAR(below.x, 1.875, 1e-15);
  RobustDifferentiator near{4, 0.25, 0.5}, there{4, 1, 0.5};
  EXPECT_NEAR(near.explicit_step(0, 0.25), -0.6, 1e-15);
  EXPECT_NEAR(near.x, 0, 1e-15);
  EXPECT_EQ(there.explicit_step(1, 0.25), 0.5) << "on the signal nothing pulls";
  EXPECT_NEAR(there.x, 1.125, 1e-15);
}

// Both axes alone, the first velocity that of a steady whirl, and the same again after a reset.
TEST(DifferentiatorProperty, AxesAreApartAndTheFirstVelocityIsThatOfTheWhirl) {
  for (const bool implicit : {false, true}) {
    LevantDifferentiator d(20, kH, implicit);
    for (int round = 0; round < 2; ++round) {
      RobustDifferentiator x{20, 1e-3, -0.2}, y{20, 2e-3, 0.1};
      EstimatorInput in;
      in.z = {1e-3, 2e-3};
      in.omega = 100;
      EXPECT_EQ(d.step(in).v, Complex(-0.2, 0.1));
      for (int k = 1; k < 200; ++k) {
        in.z = {1e-3 + 3e-4 * k * kH, 2e-3 * std::cos(20 * k * kH)};
        const DiskMotion s = d.step(in);
        const double vx = implicit ? x.implicit_step(in.z.real(), kH) : x.explicit_step(in.z.real(), kH);
        const double vy = implicit ? y.implicit_step(in.z.imag(), kH) : y.explicit_step(in.z.imag(), kH);
        ASSERT_EQ(s.v, Complex(vx, vy)) << k;
        ASSERT_EQ(s.z, in.z);
      }
      d.reset();
    }
  }
}

TEST(EstimatorCatalogue, SaysWhatEachEstimatorKnows) {
  struct Row {
    const char* name;
    bool model, disturbance, noise;
  };
  for (const Row& r :
       {Row{"difference", false, false, false}, Row{"lpf", false, false, false}, Row{"red", false, false, false},
        Row{"red_implicit", false, false, false}, Row{"eso", true, true, false}, Row{"kalman", true, false, true},
        Row{"kfe", true, true, true}, Row{"kfo", true, true, true}}) {
    EXPECT_EQ(estimator_entry(r.name).model_based, r.model) << r.name;
    EXPECT_EQ(estimator_entry(r.name).finds_disturbance, r.disturbance) << r.name;
    EXPECT_EQ(estimator_entry(r.name).knows_noise, r.noise) << r.name;
  }
}

// As the catalogue makes them: red steps explicitly, red_implicit does not, difference has no low-pass, lpf its own.
TEST(EstimatorCatalogue, MakesWhatItsNameSays) {
  ControllerDesign design;
  design.sample_time = kH;
  const std::array<double, 4> signal{0, 2e-5, 4e-5, 5e-5};
  const auto last = [&](const char* name, const std::map<std::string, double>& values) {
    AnyEstimator made = estimator_entry(name).make(design, values);
    DiskMotion s;
    for (const double z : signal) {
      EstimatorInput in;
      in.z = z;
      s = std::visit([&](auto& e) { return e.step(in); }, made);
    }
    return s.v.real();
  };
  RobustDifferentiator explicitly{30, 0, 0}, implicitly{30, 0, 0};
  double v = 0, w = 0, q = std::exp(-0.2 * std::numbers::pi), low_passed = 0;
  for (std::size_t k = 1; k < signal.size(); ++k) {
    v = explicitly.explicit_step(signal[k], kH);
    w = implicitly.implicit_step(signal[k], kH);
    low_passed = q * low_passed + (1 - q) * (signal[k] - signal[k - 1]) / kH;
  }
  ASSERT_NE(v, w);
  EXPECT_EQ(last("red", {{"derivative_rate", 30}}), v);
  EXPECT_EQ(last("red_implicit", {{"derivative_rate", 30}}), w);
  EXPECT_NEAR(last("difference", {}), 0.01, 1e-12);
  EXPECT_NEAR(last("lpf", {{"cutoff", 100}}), low_passed, 1e-12);
}

/// A rotor turning at constant speed: simulated at the sensor instants with fine steps.
struct EstimatedPlant {
  LateralModel model{5700, 1e7, 1.0, {60, 13}, {0.1, 0}};
  Complex eps{150e-6, 60e-6};
  double omega = 120;
  DiskMotion s{{1e-4, -5e-5}, {0, 0}, {}};
  double t = 0;

  Complex forcing() const { return unbalance_per_metre(omega * t, omega, 0); }
  void advance(Complex a) {
    for (int i = 0; i < 50; ++i) {
      s.d = product(eps, forcing());
      s = predict_motion(model, s, a, omega, kH / 50);
      t += kH / 50;
    }
    s.d = product(eps, forcing());
  }
};

template <class Estimator>
DiskMotion track(Estimator& estimator, EstimatedPlant& plant, int samples, double noise, bool tell_disturbance) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> normal(0, 1);
  DiskMotion out;
  Complex a{}, last{};
  for (int k = 0; k < samples; ++k) {
    EstimatorInput in;
    const double nx = normal(random), ny = normal(random);
    in.z = plant.s.z + noise * Complex{nx, ny};
    in.a_second = last;
    in.forcing = plant.forcing();
    in.d = tell_disturbance ? product(plant.eps, in.forcing) : Complex{};
    in.omega = plant.omega;
    out = estimator.step(in);
    if (k + 1 == samples) break;
    last = a = 0.5 * unit_phasor(0.3 * k);  // a known, changing force
    plant.advance(a);
  }
  return out;
}

TEST(KalmanReference, FindsTheEccentricityItWasNotTold) {
  EstimatedPlant plant;
  KalmanEstimator kf(plant.model, DisturbanceState::eccentricity, {}, {1e-6, 0.05, 1e-5, 3e-4}, kH);
  const DiskMotion s = track(kf, plant, 3000, 1e-6, false);
  EXPECT_LT(std::abs(kf.disturbance_parameter() - plant.eps), 2e-6);
  EXPECT_LT(std::abs(s.z - plant.s.z), 1.5e-6);
  EXPECT_LT(std::abs(s.v - plant.s.v), 1e-3);
}

TEST(KalmanReference, OscillatorNeedsTheSpeedOnly) {
  EstimatedPlant plant;
  KalmanEstimator kf(plant.model, DisturbanceState::oscillator, {}, {1e-6, 0.05, 0.5, 5}, kH);
  const DiskMotion s = track(kf, plant, 3000, 1e-6, false);
  EXPECT_LT(std::abs(s.d - plant.s.d), 0.05 * std::abs(plant.s.d));
  EXPECT_LT(std::abs(s.v - plant.s.v), 1e-3);
}

TEST(KalmanReference, TwoStatesWithAKnownUnbalanceBeatTheDifference) {
  EstimatedPlant plant, same;
  KalmanEstimator kf(plant.model, DisturbanceState::none, plant.eps, {2e-6, 0.02, 0, 0}, kH);
  FilteredDifference difference(std::numeric_limits<double>::infinity(), kH);
  const DiskMotion s = track(kf, plant, 2000, 2e-6, true);
  const DiskMotion d = track(difference, same, 2000, 2e-6, true);
  EXPECT_LT(std::abs(s.v - plant.s.v), 0.2 * std::abs(d.v - same.s.v));
}

TEST(KalmanReference, SteadyGainSolvesTheRiccatiEquation) {
  // Constant [z v] filter against the 2 x 2 Riccati recursion iterated here with plain matrices.
  EstimatedPlant plant;
  plant.model.k2 = 0;
  const KalmanOptions options{2e-6, 0.5, 0, 0};
  KalmanEstimator kf(plant.model, DisturbanceState::none, {}, options, kH);
  EstimatorInput in;
  for (int k = 0; k < 5000; ++k) kf.step(in);
  in.z = 1e-6;  // innovation of a unit step reveals the gain
  const DiskMotion s = kf.step(in);
  const double k = plant.model.k1, c = plant.model.c, h = kH;
  const double f[2][2] = {{1 - 0.5 * k * h * h, h - 0.5 * c * h * h},
                          {-k * h * (1 - 0.5 * c * h), 1 - c * h + 0.5 * (c * c - k) * h * h}};
  double p[2][2] = {{1, 0}, {0, 1}}, gain[2] = {};
  for (int i = 0; i < 5000; ++i) {
    double fp[2][2], m[2][2];
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) fp[a][b] = f[a][0] * p[0][b] + f[a][1] * p[1][b];
    }
    const double q[2][2] = {{0.25 * h * h * h * h, 0.5 * h * h * h}, {0.5 * h * h * h, h * h}};
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) m[a][b] = fp[a][0] * f[b][0] + fp[a][1] * f[b][1] + 0.25 * q[a][b];
    }
    const double variance = m[0][0] + 4e-12;
    gain[0] = m[0][0] / variance;
    gain[1] = m[1][0] / variance;
    for (int a = 0; a < 2; ++a) {
      for (int b = 0; b < 2; ++b) p[a][b] = m[a][b] - gain[a] * gain[b] * variance;
    }
  }
  EXPECT_NEAR(s.z.real() / 1e-6, gain[0], 1e-9);
  EXPECT_NEAR(s.v.real() / 1e-6, gain[1], 1e-6 * gain[1]);
}

TEST(KalmanReference, CoastsThroughLostSamples) {
  EstimatedPlant plant;
  KalmanEstimator kf(plant.model, DisturbanceState::eccentricity, plant.eps, {1e-6, 0.05, 1e-5, 1e-4}, kH);
  track(kf, plant, 1000, 0, false);
  for (int k = 0; k < 50; ++k) {
    plant.advance({});
    EstimatorInput in;
    in.z = {9e-3, 9e-3};  // must not be looked at
    in.fresh = false;
    in.forcing = plant.forcing();
    in.omega = plant.omega;
    if (k > 0) {
      const DiskMotion s = kf.step(in);
      EXPECT_LT(std::abs(s.z - plant.s.z), 30e-6);
    } else {
      in.a_second = 0.5 * unit_phasor(0.3 * 998);
      kf.step(in);
    }
  }
}

TEST(EsoReference, RotatingDisturbanceIsFoundAndPolesStandAtTheBandwidth) {
  EstimatedPlant plant;
  ExtendedStateObserver eso(plant.model, 300, kH);
  const DiskMotion s = track(eso, plant, 2000, 0, false);
  EXPECT_LT(std::abs(s.d - plant.s.d), 0.02 * std::abs(plant.s.d));
  EXPECT_LT(std::abs(s.v - plant.s.v), 2e-3);

  // Standstill and no model: the error of a constant disturbance decays like k^2 lam^k with lam = exp(-w h).
  ExtendedStateObserver plain({}, 300, kH);
  EstimatorInput in;
  plain.step(in);
  double x = 0, v = 0, e[2] = {};
  for (int k = 1; k <= 80; ++k) {
    x += kH * v + 0.5 * kH * kH;
    v += kH;
    in.z = x;
    const double error = std::abs(plain.step(in).d.real() - 1);
    if (k == 40) e[0] = error / (40.0 * 40.0);
    if (k == 80) e[1] = error / (80.0 * 80.0);
  }
  EXPECT_NEAR(std::log(e[0] / e[1]) / (40 * kH), 300, 10);
}

TEST(PredictConvergence, MidpointStepIsOfOrderTwo) {
  // One step of length dt against many: local error falls with dt^3.
  const LateralModel model{5700, 1e7, 1.0, {60, 13}, {0.1, 0}};
  const DiskMotion s{{1e-3, 5e-4}, {0.05, -0.1}, {1, 2}};
  const auto error = [&](double dt) {
    DiskMotion fine = s;
    for (int i = 0; i < 400; ++i) fine = predict_motion(model, fine, {0.5, 0}, 120, dt / 400);
    return std::abs(predict_motion(model, s, {0.5, 0}, 120, dt).v - fine.v);
  };
  EXPECT_NEAR(std::log2(error(2e-3) / error(1e-3)), 3, 0.25);
}

}  // namespace
}  // namespace whirl::control
