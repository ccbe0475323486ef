#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace whirl::control {

/// Numbers that follow the speed: straight lines between nodes, the end values beyond them. Exact at a node; the
/// direction of turning is the caller's business.
template <std::size_t Nodes, std::size_t Columns>
struct SpeedTable {
  static_assert(Nodes >= 2);
  std::array<double, Nodes> speed{};  ///< rad/s, rising
  std::array<std::array<double, Columns>, Nodes> value{};

  std::array<double, Columns> at(double omega) const noexcept {
    const double w = std::abs(omega);
    std::size_t k = 0;
    while (k + 2 < Nodes && w >= speed[k + 1]) ++k;
    const double t = std::clamp((w - speed[k]) / (speed[k + 1] - speed[k]), 0.0, 1.0);
    std::array<double, Columns> out{};
    for (std::size_t i = 0; i < Columns; ++i) out[i] = (1 - t) * value[k][i] + t * value[k + 1][i];
    return out;
  }
};

}  // namespace whirl::control
