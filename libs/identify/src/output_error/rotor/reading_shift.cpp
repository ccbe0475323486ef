#include "output_error/rotor/reading_shift.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace whirl::identification::detail {
namespace {

using Eigen::Index;
constexpr Index kPoints = 6, kBefore = 2;
using Weights = std::array<double, kPoints>;

/// Of the values at 0 .. 5, for the polynomial through them at x.
Weights value_weights(double x) {
  Weights w;
  for (Index j = 0; j < kPoints; ++j) {
    double product = 1;
    for (Index m = 0; m < kPoints; ++m)
      if (m != j) product *= (x - static_cast<double>(m)) / static_cast<double>(j - m);
    w[static_cast<std::size_t>(j)] = product;
  }
  return w;
}

/// For its slope at x.
Weights slope_weights(double x) {
  Weights w;
  for (Index j = 0; j < kPoints; ++j) {
    double sum = 0;
    for (Index l = 0; l < kPoints; ++l) {
      if (l == j) continue;
      double product = 1 / static_cast<double>(j - l);
      for (Index m = 0; m < kPoints; ++m)
        if (m != j && m != l) product *= (x - static_cast<double>(m)) / static_cast<double>(j - m);
      sum += product;
    }
    w[static_cast<std::size_t>(j)] = sum;
  }
  return w;
}

template <class F>
Eigen::VectorXd stencil_applied(const Eigen::VectorXd& y, double samples, F weights) {
  const Index n = y.size(), whole = static_cast<Index>(std::floor(samples));
  if (n < kPoints) return y;
  const Weights inside = weights(samples - static_cast<double>(whole) + kBefore);
  Eigen::VectorXd out(n);
  for (Index i = 0; i < n; ++i) {
    const Index wanted = i + whole - kBefore, first = std::clamp(wanted, Index{0}, n - kPoints);
    const Weights w = first == wanted ? inside : weights(static_cast<double>(i - first) + samples);
    double sum = 0;
    for (Index j = 0; j < kPoints; ++j) sum += w[static_cast<std::size_t>(j)] * y[first + j];
    out[i] = sum;
  }
  return out;
}

}  // namespace

Eigen::VectorXd later(const Eigen::VectorXd& y, double samples) {
  return samples == 0 ? y : stencil_applied(y, samples, value_weights);
}

Eigen::VectorXd later_rate(const Eigen::VectorXd& y, double samples) {
  return stencil_applied(y, samples, slope_weights);
}

}  // namespace whirl::identification::detail
