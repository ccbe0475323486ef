#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/signal/order.hpp"

namespace whirl::signal {

using Eigen::Index;
using Complex = std::complex<double>;

// Normal equations (r^2 D^T D + C^H C) a = C^H 2x with the unknowns of one instant side by side, which makes them a
// Hermitian band of (poles + 1) * orders: a Cholesky factor without fill outside it, in time linear in the samples.
Eigen::MatrixXcd track_orders(const Eigen::Ref<const Eigen::VectorXd>& x,
                              const Eigen::Ref<const Eigen::VectorXd>& angle, double dt,
                              const std::vector<double>& orders, const VoldKalmanOptions& options) {
  const Index n = x.size();
  const auto k = static_cast<Index>(orders.size());
  require_range("dt", dt, 1e-15, 1e6, "s");
  require_range("poles", options.poles, 1, 3);
  require_range("bandwidth", options.bandwidth, 1e-9, 0.5 / dt, "Hz");
  if (angle.size() != n || n < 8 || k < 1) {
    throw Error(fmt::format(
        "order tracking of {} samples with {} angles and {} orders: must be equally many, at least 8, and one order", n,
        angle.size(), k));
  }
  // Transfer of one order: 1/(1 + r^2 (2 sin(w/2))^(2p)), -3 dB at half the bandwidth.
  const double edge = 2 * std::sin(std::numbers::pi * options.bandwidth * dt / 2);
  const double r2 = (std::numbers::sqrt2 - 1) / std::pow(edge, 2 * options.poles);
  if (r2 > 1e12) {
    throw Error(fmt::format(
        "bandwidth = {:g} Hz with {} poles at {:g} Hz sample rate: too narrow for double precision, reduce the "
        "sample rate or the poles",
        options.bandwidth, options.poles, 1 / dt));
  }
  std::vector<double> difference{1};
  for (int p = 0; p < options.poles; ++p) {
    std::vector<double> next(difference.size() + 1, 0.0);
    for (std::size_t i = 0; i < difference.size(); ++i) {
      next[i] += difference[i];
      next[i + 1] -= difference[i];
    }
    difference = next;
  }
  const auto reach = static_cast<Index>(difference.size());
  std::vector<Eigen::Triplet<Complex>> entries;
  entries.reserve(static_cast<std::size_t>(n * k * (k + reach)));
  Eigen::VectorXcd right(n * k);
  for (Index i = 0; i < n; ++i) {
    for (Index a = 0; a < k; ++a) {
      const double order_a = orders[static_cast<std::size_t>(a)];
      right[i * k + a] = 2 * x[i] * std::polar(1.0, -order_a * angle[i]);
      for (Index b = 0; b <= a; ++b) {
        entries.emplace_back(i * k + a, i * k + b,
                             std::polar(1.0, (orders[static_cast<std::size_t>(b)] - order_a) * angle[i]));
      }
      for (Index j = std::max<Index>(0, i - reach + 1); j <= i; ++j) {
        // (D^T D)(i, j): the differences that hold both instants.
        double sum = 0;
        for (Index row = std::max<Index>(0, i - reach + 1); row <= std::min(j, n - reach); ++row) {
          sum += difference[static_cast<std::size_t>(i - row)] * difference[static_cast<std::size_t>(j - row)];
        }
        entries.emplace_back(i * k + a, j * k + a, r2 * sum);
      }
    }
  }
  Eigen::SparseMatrix<Complex> matrix(n * k, n * k);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLLT<Eigen::SparseMatrix<Complex>, Eigen::Lower, Eigen::NaturalOrdering<int>> factor(matrix);
  if (factor.info() != Eigen::Success) throw Error("order tracking: the orders cannot be separated in this bandwidth");
  const Eigen::VectorXcd solution = factor.solve(right);
  return Eigen::Map<const Eigen::Matrix<Complex, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>>(solution.data(), n,
                                                                                                   k);
}

}  // namespace whirl::signal
