#include "whirl/control/hinfinity.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/SVD>
#include <complex>
#include <random>

#include "whirl/control/controller.hpp"
#include "whirl/control/laws/mpc.hpp"
#include "whirl/control/method.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::control {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;

/// x' = -a x + w + u, z = x, y = x + n.
WeightedPlant first_order(double a) {
  WeightedPlant p;
  p.a = MatrixXd::Constant(1, 1, -a);
  p.b1 = p.b2 = p.c1 = p.c2 = MatrixXd::Ones(1, 1);
  return p;
}

/// The closed loop from (w, n) to (z, u).
struct Closed {
  MatrixXd a, b, c, d;
};
Closed close(const WeightedPlant& p, const HInfinity& k) {
  const Index n = p.a.rows(), m = k.a.rows(), w = p.b1.cols(), z = p.c1.rows();
  Closed out;
  out.a.setZero(n + m, n + m);
  out.a << p.a, p.b2 * k.c, k.b * p.c2, k.a;
  out.b.setZero(n + m, w + 1);
  out.b.topLeftCorner(n, w) = p.b1;
  out.b.bottomRightCorner(m, 1) = k.b;
  out.c.setZero(z + 1, n + m);
  out.c.topLeftCorner(z, n) = p.c1;
  out.c.bottomRightCorner(1, m) = k.c;
  return out;
}

/// Largest singular value over the frequencies, by a sweep that knows nothing of Riccati equations.
double norm(const Closed& l) {
  double largest = 0;
  for (double w = 1e-4; w < 1e4; w *= 1.01) {
    const MatrixXcd s = std::complex<double>(0, w) * MatrixXcd::Identity(l.a.rows(), l.a.rows()) - l.a;
    const MatrixXcd t = l.c * s.inverse() * l.b;
    largest = std::max(largest, t.jacobiSvd().singularValues()[0]);
  }
  return largest;
}

double slowest(const Closed& l) { return l.a.eigenvalues().real().maxCoeff(); }

// Both Riccati equations are scalar: gamma = -a + sqrt(a^2 + 2); sqrt(2) for an integrator, the value of
// Glover and McFarlane (IEEE Trans. AC 34, 1989, 821) for the same plant.
TEST(HInfinityReference, FirstOrderPlantsReachTheClosedForm) {
  for (const double a : {-3.0, -1.0, -0.1, 0.0, 0.2, 0.45}) {
    const HInfinity k = solve_hinfinity(first_order(a));
    const double expected = -a + std::sqrt(a * a + 2);
    EXPECT_NEAR(k.least, expected, 2e-4 * expected) << a;
    const Closed loop = close(first_order(a), k);
    EXPECT_LT(slowest(loop), 0) << a;
    EXPECT_LE(norm(loop), k.norm * (1 + 1e-6)) << a;
    EXPECT_GE(norm(loop), expected * (1 - 1e-4)) << a;  // no controller is better
  }
}

TEST(HInfinityProperty, DrawnPlantsAreHeldWithinTheStatedNorm) {
  std::mt19937 random(7);
  std::normal_distribution<double> any;
  for (int draw = 0; draw < 40; ++draw) {
    const Index n = 2 + draw % 4;
    const auto matrix = [&](Index rows, Index columns) {
      return MatrixXd(MatrixXd::NullaryExpr(rows, columns, [&] { return any(random); }));
    };
    const WeightedPlant p{matrix(n, n), matrix(n, 2), matrix(n, 1), matrix(2, n), matrix(1, n)};
    const HInfinity k = solve_hinfinity(p);
    const Closed loop = close(p, k);
    EXPECT_LT(slowest(loop), 0) << draw;
    EXPECT_LE(norm(loop), k.norm * (1 + 1e-6)) << draw;
    EXPECT_GE(norm(loop), 0.9 * k.least) << draw;
    // A little below the least there is no controller; close above it there is.
    EXPECT_NO_THROW(solve_hinfinity(p, 1.002)) << draw;
    EXPECT_ANY_THROW(solve_hinfinity(p, 0.998)) << draw;
  }
}

TEST(HInfinityProperty, AnUnstablePartOutOfReachIsRefused) {
  WeightedPlant p = first_order(-1);
  p.b2.setZero();
  EXPECT_THROW(solve_hinfinity(p), Error);
}

/// Largest |x| after the first half of a run of one axis that starts off centre; the force acts `late` samples later.
double rest(const ControllerDesign& d, int late) {
  Controller controller = make_controller(d);
  const SampledAxis plant = sample_axis(d.model.k1, d.model.c, d.sample_time);
  std::vector<double> sent(static_cast<std::size_t>(late), 0.0);
  double x = 1e-4, v = 0, largest = 0;
  constexpr long kTicks = 4000;
  for (long k = 0; k < kTicks; ++k) {
    Measurement m;
    m.t = static_cast<double>(k) * d.sample_time;
    m.x = x;
    m.valid = true;
    sent.push_back(controller.step(m)->ux * d.model.gain);
    const double a = sent[static_cast<std::size_t>(k)], x0 = x;
    x = plant.a00 * x0 + plant.a01 * v + plant.b0 * a;
    v = plant.a10 * x0 + plant.a11 * v + plant.b1 * a;
    if (2 * k > kTicks) largest = std::max(largest, std::abs(x));
  }
  return largest;
}

TEST(HInfinityReference, TheSampledLawHoldsARotorAndOneOfNegativeStiffness) {
  for (const double k1 : {5700.0, 0.0, -2000.0}) {
    for (const int late : {0, 2, 4}) {
      ControllerDesign d = testing::design_of("hinf", "lpf");
      d.model.k1 = k1, d.model.k2 = 0;
      d.feedforward = false;
      d.force_limit = 0;
      d.delay = late * d.sample_time;
      d.parameters["sensor_delay"] = 0;
      EXPECT_LT(rest(d, late), 1e-6) << k1 << " " << late;
    }
  }
}

}  // namespace
}  // namespace whirl::control
