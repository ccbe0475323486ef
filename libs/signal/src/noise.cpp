#include "whirl/signal/noise.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "whirl/core/error.hpp"

namespace whirl::signal {

double noise_sd(const Eigen::Ref<const Eigen::VectorXd>& s) {
  const Eigen::Index n = s.size() - 6;
  if (n < 10) throw Error::in_field("samples", fmt::format("{}", s.size()), "at least 16 to estimate the noise");
  std::vector<double> difference(static_cast<std::size_t>(n));
  for (Eigen::Index i = 0; i < n; ++i) {
    difference[static_cast<std::size_t>(i)] =
        std::abs((s[i] + s[i + 6]) - 6 * (s[i + 1] + s[i + 5]) + 15 * (s[i + 2] + s[i + 4]) - 20 * s[i + 3]);
  }
  const auto middle = difference.begin() + n / 2;
  std::nth_element(difference.begin(), middle, difference.end());
  return *middle / 0.6745 / std::sqrt(924.0);
}

double innovation_sd(const Eigen::Ref<const Eigen::VectorXd>& s, double correlation) {
  const Eigen::Index n = std::max<Eigen::Index>(s.size(), 1) - 1;
  return noise_sd(s.tail(n) - correlation * s.head(n));
}

}  // namespace whirl::signal
