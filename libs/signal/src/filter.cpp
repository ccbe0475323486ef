#include "whirl/signal/filter.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::signal {

Eigen::Index gaussian_reach(double sd) { return static_cast<Eigen::Index>(std::ceil(4.0 * sd)); }

Eigen::VectorXd gaussian_filter(const Eigen::Ref<const Eigen::VectorXd>& x, double sd) {
  if (!(sd >= 0)) throw Error::in_field("Gaussian filter width", std::to_string(sd), "at least 0 samples");
  const Eigen::Index n = x.size();
  const Eigen::Index reach = std::min(gaussian_reach(sd), n - 1);
  if (sd == 0 || n == 0) return x;
  Eigen::VectorXd kernel(reach + 1);
  for (Eigen::Index k = 0; k <= reach; ++k) {
    kernel[k] = std::exp(-0.5 * static_cast<double>(k * k) / (sd * sd));
  }
  const double total = 2.0 * kernel.sum() - kernel[0];
  Eigen::VectorXd y(n);
  // Tile so that the accumulating block stays in the first-level cache.
  constexpr Eigen::Index tile = 1024;
  const Eigen::Index inner_end = n - reach;
  for (Eigen::Index start = reach; start < inner_end; start += tile) {
    const Eigen::Index len = std::min(tile, inner_end - start);
    auto out = y.segment(start, len);
    out = kernel[0] * x.segment(start, len);
    for (Eigen::Index k = 1; k <= reach; ++k) {
      out += kernel[k] * (x.segment(start - k, len) + x.segment(start + k, len));
    }
    out /= total;
  }
  const auto edge = [&](Eigen::Index i) {
    double sum = 0, weight = 0;
    for (Eigen::Index j = std::max<Eigen::Index>(0, i - reach); j <= std::min(n - 1, i + reach); ++j) {
      const double w = kernel[std::abs(i - j)];
      sum += w * x[j];
      weight += w;
    }
    y[i] = sum / weight;
  };
  for (Eigen::Index i = 0; i < std::min(reach, n); ++i) edge(i);
  for (Eigen::Index i = std::max(reach, inner_end); i < n; ++i) edge(i);
  return y;
}

Eigen::MatrixXd gaussian_filter_columns(const Eigen::Ref<const Eigen::MatrixXd>& x, double sd) {
  Eigen::MatrixXd y(x.rows(), x.cols());
  for (Eigen::Index j = 0; j < x.cols(); ++j) y.col(j) = gaussian_filter(x.col(j), sd);
  return y;
}

}  // namespace whirl::signal
