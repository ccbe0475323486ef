// Blows on several points in one estimate: refused, since their average is the response of no point.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/modal/frf.hpp"

namespace {

using Eigen::Index;
using whirl::Quantity;
using whirl::Recording;

/// A structure of five modes with random frequencies, and the part of each mode that a point sees.
class Structure {
 public:
  explicit Structure(unsigned seed) : random_(seed * 6151ull) {
    for (double& f : frequency_) f = 25 + 200 * uniform_(random_);
  }
  /// `blows` on a new point, as one record.
  Recording point(int blows, double noise) {
    std::array<double, 5> shape;
    for (double& s : shape) s = normal_(random_);
    const double dt = 1.0 / 2048;
    const Index each = 2048;
    Eigen::VectorXd force = Eigen::VectorXd::Zero(blows * each), response = Eigen::VectorXd::Zero(blows * each);
    for (int b = 0; b < blows; ++b) {
      const double peak = 40 + 40 * uniform_(random_);
      for (Index i = 0; i < 6; ++i)
        force[b * each + 80 + i] = peak * std::pow(std::sin(std::numbers::pi * (static_cast<double>(i) + 0.5) / 6), 2);
    }
    for (std::size_t m = 0; m < 5; ++m) {
      const double w = 2 * std::numbers::pi * frequency_[m], zeta = 0.02;
      std::complex<double> z = 0;
      const std::complex<double> turn = std::exp(std::complex<double>(-zeta * w, w) * dt);
      for (Index i = 0; i < response.size(); ++i) {
        z = z * turn + force[i];
        response[i] += shape[m] * z.imag();
      }
    }
    const double size = std::sqrt(response.squaredNorm() / static_cast<double>(response.size()));
    for (double& x : response) x += noise * size * normal_(random_);
    for (double& f : force) f += 0.1 * normal_(random_);
    Recording record;
    record.dt = dt;
    record.source = "point";
    record.add("f", Quantity::force, force);
    record.add("a", Quantity::acceleration, response);
    return record;
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_{0, 1};
  std::array<double, 5> frequency_{};
};

bool refused(const std::vector<Recording>& records) {
  try {
    whirl::modal::estimate_frf(records);
    return false;
  } catch (const whirl::Error& e) {
    EXPECT_NE(std::string(e.what()).find("roving"), std::string::npos) << e.what();
    return true;
  }
}

TEST(RovingBlowsProperty, PointsOfARovingTestAreNotAveraged) {
  int found = 0, sets = 0;
  for (unsigned seed = 1; seed <= 30; ++seed) {
    for (const int blows : {1, 3}) {
      Structure plate(seed);
      std::vector<Recording> points;
      for (int p = 0; p < 6; ++p) points.push_back(plate.point(blows, 0.01));
      ++sets;
      if (refused(points)) {
        ++found;
        continue;
      }
      // Shapes drawn at random may agree at more than half of the points: the others are named then, and left out.
      std::vector<whirl::modal::BlowReport> reports;
      whirl::modal::estimate_frf(points, {}, &reports);
      EXPECT_TRUE(std::ranges::any_of(reports, [](const auto& r) { return !r.used && !r.disagreements.empty(); }))
          << seed << " " << blows;
    }
  }
  EXPECT_GE(found, 0.9 * sets) << found << " of " << sets;
}

TEST(RovingBlowsProperty, BlowsOnOnePointAreAveragedWhateverTheirNoise) {
  for (unsigned seed = 101; seed <= 160; ++seed) {
    Structure plate(seed);
    for (const double noise : {0.01, 0.1, 0.5, 1.0, 2.0}) EXPECT_FALSE(refused({plate.point(6, noise)})) << seed;
  }
}

TEST(RovingBlows, TheFlagForOddBlowsAveragesThemAll) {
  Structure plate(7);
  std::vector<Recording> points;
  for (int p = 0; p < 5; ++p) points.push_back(plate.point(2, 0.01));
  EXPECT_EQ(whirl::modal::estimate_frf(points, {.exclude = {.odd = false}}).averages, 10);
}

}  // namespace
