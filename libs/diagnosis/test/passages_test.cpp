#include "whirl/diagnosis/passages.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <random>

#include "whirl/core/angles.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/diagnosis/rotation.hpp"

// Runs of rotors with one or two natural frequencies, integrated here with a small step and measured with noise.
namespace {

using Complex = std::complex<double>;

struct Mode {
  double frequency = 0;     // Hz
  double damping = 0;       // of critical
  double eccentricity = 0;  // m
  double cubic = 0;         // 1/(m^2 s^2)
};

struct Course {
  double begin = 0, end = 0;  // Hz
  double seconds = 0;
  double noise = 0;  // m
};

whirl::Recording run_of(const std::vector<Mode>& modes, const Course& course, unsigned seed) {
  constexpr double dt = 1e-3;
  constexpr int substeps = 10;
  const double rate = whirl::kTwoPi * (course.end - course.begin) / course.seconds;
  const auto angle = [&](double t) { return whirl::kTwoPi * course.begin * t + 0.5 * rate * t * t; };
  const auto n = static_cast<Eigen::Index>(course.seconds / dt);
  Eigen::VectorXd x = Eigen::VectorXd::Zero(n), y = x, beta(n);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, course.noise);
  for (const Mode& m : modes) {
    const double w = whirl::kTwoPi * m.frequency;
    const auto acceleration = [&](double t, Complex z, Complex v) {
      const double speed = whirl::kTwoPi * course.begin + rate * t;
      const Complex force = m.eccentricity * Complex(speed * speed, -rate) * std::polar(1.0, angle(t));
      return force - w * w * z - 2 * m.damping * w * v - m.cubic * std::norm(z) * z;
    };
    // The steady answer at the first speed, so that no transient begins the run.
    const double s = whirl::kTwoPi * course.begin;
    Complex z = m.eccentricity * s * s / Complex(w * w - s * s, 2 * m.damping * w * s), v = Complex(0, s) * z;
    for (Eigen::Index i = 0; i < n; ++i) {
      x[i] += z.real();
      y[i] += z.imag();
      for (int k = 0; k < substeps; ++k) {
        const double h = dt / substeps, t = dt * static_cast<double>(i) + h * k;
        const Complex a1 = acceleration(t, z, v), a2 = acceleration(t + h / 2, z + h / 2 * v, v + h / 2 * a1);
        const Complex v2 = v + h / 2 * a1, v3 = v + h / 2 * a2;
        const Complex a3 = acceleration(t + h / 2, z + h / 2 * v2, v3), v4 = v + h * a3;
        const Complex a4 = acceleration(t + h, z + h * v3, v4);
        z += h / 6 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
      }
    }
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    x[i] += noise(random);
    y[i] += noise(random);
    beta[i] = angle(dt * static_cast<double>(i));
  }
  whirl::Recording r;
  r.dt = dt;
  r.source = "made";
  r.add("x", whirl::Quantity::displacement, x);
  r.add("y", whirl::Quantity::displacement, y);
  r.add("beta", whirl::Quantity::angle, beta);
  return r;
}

struct Count {
  int found = 0, wanted = 0, wrong = 0;
};

// A passage lies within a tenth of the natural frequency, or within what the sweep blurs.
void judge(const whirl::Recording& record, const std::vector<Mode>& modes, const Course& course, Count& count) {
  const auto turning = whirl::diagnosis::rotation_of(record);
  ASSERT_TRUE(turning);
  const auto curve = whirl::diagnosis::order_curve(record, *turning, "x");
  const double blur = 1.5 * std::sqrt(std::abs(course.end - course.begin) / course.seconds);
  std::vector<int> hits(modes.size(), 0);
  for (const auto& p : whirl::diagnosis::passages(curve)) {
    bool explained = false;
    for (std::size_t k = 0; k < modes.size(); ++k) {
      if (std::abs(p.speed / whirl::kTwoPi - modes[k].frequency) > 0.1 * modes[k].frequency + blur || hits[k] > 0)
        continue;
      hits[k] = 1;
      explained = true;
      break;
    }
    if (!explained) ++count.wrong;
  }
  for (const int hit : hits) count.found += hit, ++count.wanted;
}

double between(std::mt19937& random, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(random);
}

TEST(PassagesProperty, BeatsAfterAFastPassageAreNoCriticalSpeeds) {
  Count one;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    std::mt19937 random(seed);
    const Mode mode{between(random, 6, 25), between(random, 0.003, 0.02), between(random, 1e-4, 5e-4),
                    seed % 3 == 0 ? between(random, 0, 1e7) : 0.0};
    const bool up = seed % 2 == 0;
    Course course{mode.frequency * between(random, 2, 3.5), mode.frequency * between(random, 0.15, 0.4)};
    if (up) std::swap(course.begin, course.end);
    course.seconds = std::abs(course.end - course.begin) / between(random, 0.6, 4);
    course.noise = 2e-5;
    judge(run_of({mode}, course, seed), {mode}, course, one);
  }
  EXPECT_LE(one.wrong, 1);
  EXPECT_EQ(one.found, one.wanted);
  RecordProperty("one_found", one.found);
  RecordProperty("one_wrong", one.wrong);
}

TEST(PassagesProperty, ASecondCriticalSpeedIsKept) {
  Count two;
  for (unsigned seed = 101; seed <= 140; ++seed) {
    std::mt19937 random(seed);
    const double first = between(random, 6, 14), second = first * between(random, 2.0, 2.8);
    const std::vector<Mode> modes{{first, between(random, 0.005, 0.02), between(random, 1e-4, 5e-4)},
                                  {second, between(random, 0.005, 0.02), between(random, 1e-4, 3e-4)}};
    Course course{second * between(random, 1.4, 1.8), first * between(random, 0.3, 0.5)};
    if (seed % 2 == 0) std::swap(course.begin, course.end);
    course.seconds = std::abs(course.end - course.begin) / between(random, 0.6, 3);
    course.noise = 1e-5;
    judge(run_of(modes, course, seed), modes, course, two);
  }
  EXPECT_LE(two.wrong, 2);
  EXPECT_GE(two.found, static_cast<int>(0.9 * two.wanted));
  RecordProperty("two_found", two.found);
  RecordProperty("two_wrong", two.wrong);
}

}  // namespace
