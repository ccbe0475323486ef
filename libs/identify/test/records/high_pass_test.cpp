#include "output_error/rotor/high_pass.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace whirl::identification::detail {
namespace {

const HighPass kOrders[] = {{0.02, 0}, {0.03, 4e-4}, {0.5, 0.01}};

// A reading that stays decays as the charge does: exp(-a t), and y'' + a y' + b y = 0 from y = 1, y' = -a.
TEST(HighPassReference, AConstantReadingDecays) {
  const Eigen::VectorXd one = Eigen::VectorXd::Ones(200);
  const Eigen::VectorXd first = high_passed(one, {0.02, 0}), second = high_passed(one, {0.03, 4e-4});
  const double half = 0.015, root = std::sqrt(4e-4 - half * half);
  for (Eigen::Index i = 0; i < one.size(); ++i) {
    const double t = static_cast<double>(i);
    EXPECT_NEAR(first[i], std::exp(-0.02 * t), 1e-12);
    EXPECT_NEAR(second[i], std::exp(-half * t) * (std::cos(root * t) - half / root * std::sin(root * t)), 1e-12);
  }
}

TEST(HighPassProperty, AllColumnsAtOnceAreEachOnItsOwn) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> normal;
  for (const HighPass& h : kOrders) {
    for (const Eigen::Index samples : {0, 1, 2, 300}) {
      Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> rows(samples, 5);
      for (double& v : rows.reshaped()) v = normal(random);
      const Eigen::MatrixXd before = rows;
      high_pass_rows(rows, h);
      for (Eigen::Index k = 0; samples > 0 && k < rows.cols(); ++k)
        EXPECT_LT((rows.col(k) - high_passed(before.col(k), h)).cwiseAbs().maxCoeff(), 1e-12) << h.spring;
    }
  }
}

}  // namespace
}  // namespace whirl::identification::detail
