#include "bow_spline.hpp"

#include <algorithm>
#include <complex>

#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;

BowSpline::BowSpline(std::vector<double> x, const Eigen::VectorXcd& y)
    : x_(std::move(x)), y_(y), second_(Eigen::VectorXcd::Zero(y.size())) {
  const Index n = y_.size();
  if (n < 3) return;
  // Continuity of the slope at the inner points.
  Eigen::MatrixXcd a = Eigen::MatrixXcd::Identity(n, n);
  Eigen::VectorXcd right = Eigen::VectorXcd::Zero(n);
  for (Index i = 1; i + 1 < n; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const double before = x_[k] - x_[k - 1], after = x_[k + 1] - x_[k];
    a(i, i - 1) = before / 6;
    a(i, i) = (before + after) / 3;
    a(i, i + 1) = after / 6;
    right[i] = (y_[i + 1] - y_[i]) / after - (y_[i] - y_[i - 1]) / before;
  }
  second_ = Eigen::PartialPivLU<Eigen::MatrixXcd>(a).solve(right);
}

std::pair<std::complex<double>, std::complex<double>> BowSpline::at(double x) const {
  const double inside = std::clamp(x, x_.front(), x_.back());
  std::size_t k = 1;
  while (k + 1 < x_.size() && inside > x_[k]) ++k;
  const auto i = static_cast<Index>(k);
  const double h = x_[k] - x_[k - 1], b = (inside - x_[k - 1]) / h, a = 1 - b;
  const std::complex<double> value =
      a * y_[i - 1] + b * y_[i] + ((a * a * a - a) * second_[i - 1] + (b * b * b - b) * second_[i]) * (h * h / 6);
  const std::complex<double> slope =
      (y_[i] - y_[i - 1]) / h + ((3 * b * b - 1) * second_[i] - (3 * a * a - 1) * second_[i - 1]) * (h / 6);
  return {value + slope * (x - inside), slope};
}

}  // namespace whirl::shaft
