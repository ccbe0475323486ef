// Intervals of a correction that rests on an identified model and one run as found.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/rotor_influence.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;

// The machine is one of those that the model's covariance and the stated errors allow; it is built in real coordinates
// of its own, the estimator sees the mean model and noisy vectors of x and y at three speeds.
TEST(RotorPriorProperty, CorrectionsFromAModelAloneHoldTheirIntervals) {
  constexpr int kJobs = 300;
  constexpr double kCommon = 0.06, kEach = 0.03, kNoise = 1e-6, kRadius = 0.08, kMass = 1.5;
  int real = 0, imag = 0;
  for (unsigned job = 0; job < kJobs; ++job) {
    std::mt19937_64 random(7000 + job);
    std::normal_distribution<double> normal;
    const auto complex_normal = [&](double sd) {
      const double a = normal(random), b = normal(random);
      return sd / std::numbers::sqrt2 * Complex(a, b);
    };
    RotorModel model;
    model.k1 = 6000;
    model.c = 9;
    std::vector<double> covariance(25, 0);
    covariance[0] = 50 * 50;
    covariance[12] = 0.6 * 0.6;
    const double k = model.k1 + 50 * normal(random), c = model.c + 0.6 * normal(random);
    const Complex common = 1.0 + complex_normal(kCommon), unbalance = complex_normal(150e-6);  // m, of the disk
    RotorReadings r{.mass = kMass, .radius = kRadius};
    BalancingJob found;
    found.planes = {"disk"};
    BalancingRun run;
    run.name = "as found";
    run.masses = Eigen::VectorXcd::Zero(1);
    run.vibration = Eigen::VectorXcd(6);
    Eigen::VectorXcd influence(6);
    const Complex per_speed[3] = {common, 1.0 + complex_normal(kCommon), 1.0 + complex_normal(kCommon)};
    for (int s = 0; s < 3; ++s)
      for (int probe = 0; probe < 2; ++probe) {
        const double w = 55 + 20 * s, angle = probe * kTwoPi / 4;
        const int m = 2 * s + probe;
        const Complex disk =
            w * w / Complex(k - w * w, c * w) * std::polar(1.0, -angle) * (per_speed[s] + complex_normal(kEach));
        influence[m] = disk * kRadius / kMass;
        run.vibration[m] = disk * unbalance + Complex(normal(random), normal(random)) * kNoise;
        found.rows.push_back(std::string(probe == 0 ? "x " : "y ") + std::to_string(s));
        found.speed.push_back(s);
        r.speed.push_back(w);
        r.probe.push_back(angle);
      }
    found.runs = {run};
    Summary warnings;
    const BayesianBalance b =
        balance_with_prior(found, rotor_prior(model, covariance, r, kCommon, kEach, warnings), kNoise, 800, job);
    const Complex best = -unbalance * kMass / kRadius;  // nulls every reading of this machine
    real += b.real[0].low <= best.real() && best.real() <= b.real[0].high;
    imag += b.imag[0].low <= best.imag() && best.imag() <= b.imag[0].high;
    EXPECT_LT(std::abs(b.masses[0] - best), 0.35 * std::abs(best) + 1e-5) << job;
  }
  RecordProperty("real", real);
  RecordProperty("imag", imag);
  EXPECT_GE(real, 0.91 * kJobs);
  EXPECT_GE(imag, 0.91 * kJobs);
  EXPECT_LE(real, 0.985 * kJobs);
  EXPECT_LE(imag, 0.985 * kJobs);
}

}  // namespace
}  // namespace whirl::diagnosis
