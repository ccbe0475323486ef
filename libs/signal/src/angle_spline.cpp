#include "angle_spline.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "whirl/core/banded_cholesky.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::signal::detail {
namespace {

constexpr int kDegree = 5;
using Basis = std::array<double, kDegree + 1>;

// Cardinal B-spline N_d at u + j, j = 0 .. d, from N_{d-1}: N_d(x) = (x N_{d-1}(x) + (d + 1 - x) N_{d-1}(x - 1)) / d.
template <int d>
void raise(Basis& b, double u) {
  for (int j = d; j >= 0; --j) {
    const double x = u + j;
    const double below = j > 0 ? b[static_cast<std::size_t>(j - 1)] : 0.0;
    const double here = j < d ? b[static_cast<std::size_t>(j)] : 0.0;
    b[static_cast<std::size_t>(j)] = (x * here + (d + 1 - x) * below) / d;
  }
}

Basis cubic(double u) {
  Basis b{1};
  raise<1>(b, u);
  raise<2>(b, u);
  raise<3>(b, u);
  return b;
}

}  // namespace

SmoothCurve SmoothCurve::polynomial(const Eigen::VectorXd& t, const Eigen::VectorXd& y, int degree) {
  SmoothCurve c;
  c.start_ = 0.5 * (t[0] + t[t.size() - 1]);
  c.width_ = 0.5 * (t[t.size() - 1] - t[0]);
  const Eigen::ArrayXd u = (t.array() - c.start_) / c.width_;
  Eigen::MatrixXd powers(t.size(), degree + 1);
  powers.col(0).setOnes();
  for (int k = 1; k <= degree; ++k) powers.col(k) = powers.col(k - 1).array() * u;
  c.coefficients_ = powers.householderQr().solve(y);
  c.rms_ = std::sqrt((powers * c.coefficients_ - y).squaredNorm() / static_cast<double>(t.size()));
  return c;
}

SmoothCurve SmoothCurve::spline(const Eigen::VectorXd& t, const Eigen::VectorXd& y, int intervals) {
  SmoothCurve c;
  c.intervals_ = intervals;
  c.start_ = t[0];
  c.width_ = (t[t.size() - 1] - t[0]) / intervals;
  const Eigen::Index size = intervals + kDegree;
  // Fit the difference to the end-to-end chord: keeps the normal equations accurate for angles of thousands of radians.
  const double slope = (y[y.size() - 1] - y[0]) / (t[t.size() - 1] - t[0]);
  BandedCholesky<double> normal(size, kDegree);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(size, 1);
  for (Eigen::Index n = 0; n < t.size(); ++n) {
    const double x = (t[n] - c.start_) / c.width_;
    const int i = std::clamp(static_cast<int>(x), 0, intervals - 1);
    Basis b = cubic(x - i);
    raise<4>(b, x - i);
    raise<kDegree>(b, x - i);
    const double value = y[n] - y[0] - slope * (t[n] - t[0]);
    for (int j = 0; j <= kDegree; ++j) {  // coefficient i + j has value b[5 - j]
      const double bj = b[static_cast<std::size_t>(kDegree - j)];
      right(i + j, 0) += bj * value;
      for (int d = 0; j + d <= kDegree; ++d) normal.band(d, i + j) += bj * b[static_cast<std::size_t>(kDegree - j - d)];
    }
  }
  // Intervals without readings (pulses near standstill) are bridged at constant acceleration: third differences of the
  // coefficients count a little.
  const double weight = 5e-9 * normal.band.row(0).mean();
  constexpr std::array<double, 4> kThird{-1, 3, -3, 1};
  for (Eigen::Index k = 0; k + 3 < size; ++k) {
    for (int j = 0; j < 4; ++j) {
      for (int d = 0; j + d < 4; ++d)
        normal.band(d, k + j) += weight * kThird[static_cast<std::size_t>(j)] * kThird[static_cast<std::size_t>(j + d)];
    }
  }
  normal.factorize();
  normal.solve_lower(right);
  normal.solve_upper(right);
  // The chord as B-spline coefficients: a line takes its value at the centre of each basis function.
  c.coefficients_ = right.col(0);
  for (Eigen::Index k = 0; k < size; ++k) {
    c.coefficients_[k] += y[0] + slope * c.width_ * (static_cast<double>(k - kDegree) + 0.5 * (kDegree + 1));
  }
  c.set_residual(t, y);
  return c;
}

Eigen::Vector3d SmoothCurve::at(double t) const {
  Eigen::Vector3d v = Eigen::Vector3d::Zero();
  const double x = (t - start_) / width_;
  if (intervals_ == 0) {
    for (Eigen::Index k = coefficients_.size() - 1; k >= 0; --k) {
      v[2] = v[2] * x + 2 * v[1];
      v[1] = v[1] * x + v[0];
      v[0] = v[0] * x + coefficients_[k];
    }
  } else {
    const int i = std::clamp(static_cast<int>(std::floor(x)), 0, intervals_ - 1);
    const double u = x - i;
    const Basis b3 = cubic(u);
    Basis b4 = b3;
    raise<4>(b4, u);
    Basis b5 = b4;
    raise<kDegree>(b5, u);
    const auto get = [](const Basis& b, int j, int degree) {
      return j >= 0 && j <= degree ? b[static_cast<std::size_t>(j)] : 0.0;
    };
    for (int j = 0; j <= kDegree; ++j) {
      const double c = coefficients_[i + kDegree - j];
      v[0] += c * get(b5, j, 5);
      v[1] += c * (get(b4, j, 4) - get(b4, j - 1, 4));
      v[2] += c * (get(b3, j, 3) - 2 * get(b3, j - 1, 3) + get(b3, j - 2, 3));
    }
  }
  v[1] /= width_;
  v[2] /= width_ * width_;
  return v;
}

void SmoothCurve::set_residual(const Eigen::VectorXd& t, const Eigen::VectorXd& y) {
  double sum = 0;
  for (Eigen::Index n = 0; n < t.size(); ++n) {
    const double x = (t[n] - start_) / width_;
    const int i = std::clamp(static_cast<int>(x), 0, intervals_ - 1);
    Basis b = cubic(x - i);
    raise<4>(b, x - i);
    raise<kDegree>(b, x - i);
    double v = 0;
    for (int j = 0; j <= kDegree; ++j) v += coefficients_[i + kDegree - j] * b[static_cast<std::size_t>(j)];
    sum += (v - y[n]) * (v - y[n]);
  }
  rms_ = std::sqrt(sum / static_cast<double>(t.size()));
}

}  // namespace whirl::signal::detail
