#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "whirl/control/controller.hpp"
#include "whirl/control/laws/lqr.hpp"
#include "whirl/control/laws/mpc.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/testing/designs.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::control {
namespace {

using Bound = BoundedRegulator::Bound;
constexpr double kInf = std::numeric_limits<double>::infinity();

/// A random sampled axis with its regulator, and the same problem as a dense quadratic program.
struct Problem {
  Eigen::Matrix2d a;
  Eigen::Vector2d b, x0;
  Eigen::RowVector2d gain;
  Eigen::MatrixXd h;
  Eigen::VectorXd g;

  // Condensed from Q, r and the Riccati solution P, not from the gain.
  // Over a long horizon the plant must not grow faster than `radius` per sample, or no arithmetic holds it at its
  // limits.
  Problem(std::mt19937_64& random, int n, double radius = 1e9) {
    std::uniform_real_distribution<double> u(-1, 1);
    do {
      a << 1.1 * u(random), u(random), u(random), 1.1 * u(random);
      b << u(random), u(random);
      a *= std::min(1.0, radius / std::max(1e-9, a.eigenvalues().cwiseAbs().maxCoeff()));
    } while (std::abs(b.x() * (a * b).y() - b.y() * (a * b).x()) < 0.05);  // controllable
    const Eigen::Matrix2d q = Eigen::Vector2d(std::exp(2 * u(random)), std::exp(2 * u(random))).asDiagonal();
    const double r = std::exp(2 * u(random));
    Eigen::Matrix2d p = q;
    for (int i = 0; i < 20000; ++i) {
      const Eigen::Matrix2d old = p;
      gain = (b.transpose() * p * a) / (r + b.dot(p * b));
      p = (q + a.transpose() * old * (a - b * gain)).eval();
      p = (0.5 * (p + p.transpose())).eval();
      if ((p - old).norm() < 1e-15 * p.norm()) break;
    }
    x0 << 3 * u(random), 3 * u(random);
    Eigen::MatrixXd map = Eigen::MatrixXd::Zero(2 * n, n), start(2 * n, 2);
    Eigen::MatrixXd weight = Eigen::MatrixXd::Zero(2 * n, 2 * n);
    Eigen::Matrix2d power = a;
    for (int k = 0; k < n; ++k) {
      start.middleRows(2 * k, 2) = power;
      power = (a * power).eval();
      Eigen::Vector2d column = b;
      for (int j = k; j < n; ++j) {
        map.block(2 * j, k, 2, 1) = column;
        column = (a * column).eval();
      }
      weight.block(2 * k, 2 * k, 2, 2) = k == n - 1 ? p : q;
    }
    const double scale = 1 / (r + b.dot(p * b));
    h = scale * (map.transpose() * weight * map + r * Eigen::MatrixXd::Identity(n, n));
    g = scale * (map.transpose() * weight * start * x0);
  }
  SampledAxis axis() const { return {a(0, 0), a(0, 1), a(1, 0), a(1, 1), b(0), b(1)}; }
  BoundedRegulator regulator(int n) const { return {axis(), gain(0), gain(1), n}; }
};

/// Every choice of inputs at their limits: the one that fulfils the optimality conditions.
Eigen::VectorXd by_enumeration(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const Eigen::VectorXd& low,
                               const Eigen::VectorXd& high) {
  const Eigen::Index n = g.size();
  long sets = 1;
  for (Eigen::Index i = 0; i < n; ++i) sets *= 3;
  for (long code = 0; code < sets; ++code) {
    Eigen::VectorXd w = Eigen::VectorXd::Zero(n);
    std::vector<Eigen::Index> free;
    long rest = code;
    std::vector<int> set(static_cast<std::size_t>(n));
    for (Eigen::Index i = 0; i < n; ++i, rest /= 3) {
      set[static_cast<std::size_t>(i)] = static_cast<int>(rest % 3);
      if (rest % 3 == 0) free.push_back(i);
      if (rest % 3 == 1) w(i) = low(i);
      if (rest % 3 == 2) w(i) = high(i);
    }
    if (!free.empty()) {
      const Eigen::VectorXd rhs = -(g + h * w)(free);
      const Eigen::MatrixXd part = h(free, free);
      const Eigen::VectorXd inner = part.ldlt().solve(rhs);
      w(free) = inner;
    }
    const Eigen::VectorXd gradient = h * w + g;
    bool optimal = true;
    for (Eigen::Index i = 0; i < n; ++i) {
      const int s = set[static_cast<std::size_t>(i)];
      optimal = optimal && w(i) >= low(i) - 1e-10 && w(i) <= high(i) + 1e-10;
      optimal = optimal && (s != 1 || gradient(i) >= -1e-10) && (s != 2 || gradient(i) <= 1e-10);
    }
    if (optimal) return w;
  }
  ADD_FAILURE() << "no set is optimal";
  return Eigen::VectorXd::Zero(n);
}

TEST(BoundedRegulatorProperty, EqualsTheEnumerationOfAllSets) {
  std::mt19937_64 random(20240607);
  std::uniform_real_distribution<double> u(-1, 1);
  int limited = 0;
  for (int trial = 0; trial < 300; ++trial) {
    const int n = 1 + trial % 6;
    const Problem problem(random, n);
    BoundedRegulator::Inputs low{}, high{};
    Eigen::VectorXd l(n), r(n);
    const double width = std::exp(1.5 * u(random));
    for (int k = 0; k < n; ++k) {
      const double centre = u(random);
      l(k) = low[static_cast<std::size_t>(k)] = centre - width;
      r(k) = high[static_cast<std::size_t>(k)] = centre + width;
    }
    BoundedRegulator::Bounds set{};
    for (int k = 0; k < n; ++k)
      set[static_cast<std::size_t>(k)] = static_cast<Bound>(static_cast<int>(random() % 3) - 1);
    const auto found = problem.regulator(n).solve(problem.x0.x(), problem.x0.y(), low, high, set);
    ASSERT_TRUE(found.solved) << trial;
    const Eigen::VectorXd expected = by_enumeration(problem.h, problem.g, l, r);
    const double scale = 1 + expected.cwiseAbs().maxCoeff();
    EXPECT_LT(found.residual, 1e-11 * scale) << trial;
    for (int k = 0; k < n; ++k) {
      EXPECT_NEAR(found.w[static_cast<std::size_t>(k)], expected(k), 1e-8 * scale) << trial << " input " << k;
      limited += set[static_cast<std::size_t>(k)] != Bound::none;
    }
  }
  EXPECT_GT(limited, 300);  // the limits did act
}

// The gradient of the dense problem is the certificate at full length, where sets cannot be enumerated.
TEST(BoundedRegulatorProperty, FulfilsTheOptimalityConditionsAtFullLength) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> u(-1, 1);
  constexpr int n = BoundedRegulator::kMaxHorizon;
  int most = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    const Problem problem(random, n, 1.05);
    BoundedRegulator::Inputs low{}, high{};
    const double width = std::exp(2 * u(random)), amplitude = 2 * width * std::abs(u(random)), turn = u(random);
    for (int k = 0; k < n; ++k) {
      const double centre = amplitude * std::cos(turn * k);
      low[static_cast<std::size_t>(k)] = centre - width;
      high[static_cast<std::size_t>(k)] = centre + width;
    }
    BoundedRegulator::Bounds set{};
    const auto found = problem.regulator(n).solve(problem.x0.x(), problem.x0.y(), low, high, set);
    ASSERT_TRUE(found.solved) << trial;
    most = std::max(most, found.iterations);
    if (trial % 20 != 0) continue;
    const Eigen::VectorXd w = Eigen::Map<const Eigen::VectorXd>(found.w.data(), n);
    const Eigen::VectorXd gradient = problem.h * w + problem.g;
    const double scale = 1 + w.cwiseAbs().maxCoeff();
    for (int k = 0; k < n; ++k) {
      const auto i = static_cast<std::size_t>(k);
      EXPECT_GE(w(k), low[i] - 1e-11 * scale);
      EXPECT_LE(w(k), high[i] + 1e-11 * scale);
      EXPECT_NEAR(w(k), std::clamp(w(k) - gradient(k), low[i], high[i]), 1e-6 * scale) << trial << " input " << k;
    }
  }
  EXPECT_GT(most, 10);  // some need single steps
  EXPECT_LT(most, 100);
}

TEST(BoundedRegulatorReference, WithoutLimitsIsTheRegulator) {
  const double h = 1e-3;
  const LqrGains g = lqr_gains(5700, 1, h, 1e-3, 0.05, 3);
  const BoundedRegulator regulator(sample_axis(5700, 1, h), g.kp, g.kd, 20);
  BoundedRegulator::Inputs low, high;
  low.fill(-kInf), high.fill(kInf);
  BoundedRegulator::Bounds set{};
  const auto found = regulator.solve(2e-4, -0.03, low, high, set);
  EXPECT_TRUE(found.solved);
  EXPECT_EQ(found.iterations, 1);
  EXPECT_DOUBLE_EQ(found.w[0], -g.kp * 2e-4 + g.kd * 0.03);
}

TEST(BoundedRegulatorReference, ALimitAheadChangesTheInputNow) {
  const double h = 1e-3;
  const LqrGains g = lqr_gains(5700, 1, h, 1e-3, 0.05, 3);
  BoundedRegulator::Inputs low, high;
  low.fill(-10), high.fill(10);
  for (std::size_t k = 3; k < 12; ++k) high[k] = -2;  // known already: the disturbance will take the force
  BoundedRegulator::Bounds set{};
  const auto found = BoundedRegulator(sample_axis(5700, 1, h), g.kp, g.kd, 16).solve(0, 0.02, low, high, set);
  ASSERT_TRUE(found.solved);
  const double regulator = -g.kd * 0.02;
  EXPECT_GT(found.w[0], regulator + 0.01);  // braces against the push to come
  EXPECT_EQ(found.w[8], -2);
}

TEST(ModelPredictiveReference, EqualsTheLqrLawAwayFromTheLimit) {
  ControllerDesign d = testing::design_of("mpc", "kfe");
  d.parameters["predict"] = 1;
  Controller mpc = make_controller(d);
  d.law = "lqr";
  Controller lqr = make_controller(d);
  for (const Measurement& m : testing::run_down_readings()) {
    const auto a = mpc.step(m), b = lqr.step(m);
    ASSERT_TRUE(a && b);
    if (lqr.state().saturated) return;
    ASSERT_NEAR(a->ux, b->ux, 1e-12 * (1 + std::abs(b->ux))) << m.t;
    ASSERT_NEAR(a->uy, b->uy, 1e-12 * (1 + std::abs(b->uy))) << m.t;
  }
}

TEST(ModelPredictiveProperty, NeverAsksForMoreThanTheLimitAndSolvesEveryStep) {
  for (const double radius : {1e-4, 1e-3, 5e-3}) {
    for (const double limit : {2.0, 10.0}) {
      ControllerDesign d = testing::design_of("mpc", "kfe");
      d.parameters["predict"] = 1;
      d.parameters["horizon"] = BoundedRegulator::kMaxHorizon;
      d.force_limit = limit;
      Controller c = make_controller(d);
      int most = 0, at_limit = 0;
      for (const Measurement& m : testing::run_down_readings(radius)) {
        const auto out = c.step(m);
        ASSERT_TRUE(out);
        // Before the limit of the controller around the law: the law itself keeps it, up to rounding.
        ASSERT_LE(std::abs(c.state().requested.real()), limit * (1 + 1e-14));
        ASSERT_LE(std::abs(c.state().requested.imag()), limit * (1 + 1e-14));
        const auto& law = std::get<LateralLaw<ModelPredictive>>(c.law());
        for (const ModelPredictive* axis : {&law.x, &law.y}) {
          most = std::max(most, axis->iterations);
          ASSERT_LT(axis->iterations, BoundedRegulator::kMaxIterations);
          ASSERT_LT(axis->residual, 1e-9 * limit);
        }
        at_limit += c.state().saturated;
      }
      EXPECT_LE(most, 25) << radius << " " << limit;
      if (limit == 2.0) {
        EXPECT_GT(at_limit, 1000) << radius;
      }
    }
  }
}

// The cost of a step: at the limit for good, the last answer moved up by one is mostly the answer.
TEST(ModelPredictiveProperty, StartsFromTheLastAnswer) {
  ControllerDesign d = testing::design_of("mpc", "kfe");
  d.parameters["predict"] = 1;
  d.force_limit = 5;
  Controller c = make_controller(d);
  int steps = 0, first_set = 0, most = 0;
  for (const Measurement& m : testing::run_down_readings(2e-3)) {
    c.step(m);
    if (!c.state().saturated) continue;
    const int tried = std::get<LateralLaw<ModelPredictive>>(c.law()).x.iterations;
    ++steps;
    first_set += tried == 1;
    most = std::max(most, tried);
  }
  EXPECT_GT(steps, 15000);
  EXPECT_GT(first_set, 0.75 * steps);
  EXPECT_LE(most, 5);
}

TEST(ModelPredictive, RefusesAHorizonBeyondItsLengthWithoutAUnit) {
  ControllerDesign d = testing::design_of("mpc", "kfe");
  d.parameters["horizon"] = 99;
  EXPECT_EQ(testing::error_of([&] { make_controller(d); }), "horizon = 99: must be between 1 and 32");
}

}  // namespace
}  // namespace whirl::control
