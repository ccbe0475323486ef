#include "whirl/control/runout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {

std::complex<double> Runout::at(std::complex<double> turn) const noexcept {
  const double c1 = turn.real(), s1 = turn.imag();
  double c = 1, s = 0, x = 0, y = 0;
  for (std::size_t k = 0; k < kHarmonics; ++k) {
    const double next = c * c1 - s * s1;
    s = s * c1 + c * s1;
    c = next;
    x += x_cos[k] * c + x_sin[k] * s;
    y += y_cos[k] * c + y_sin[k] * s;
  }
  return {x, y};
}

bool Runout::empty() const noexcept {
  const auto zero = [](double v) { return v == 0; };
  return std::ranges::all_of(x_cos, zero) && std::ranges::all_of(x_sin, zero) && std::ranges::all_of(y_cos, zero) &&
         std::ranges::all_of(y_sin, zero);
}

Runout estimate_runout(const Recording& slow_roll) {
  const Eigen::VectorXd& beta = slow_roll["beta"];
  const double turns = beta.size() > 0 ? (beta.maxCoeff() - beta.minCoeff()) / (2 * std::numbers::pi) : 0;
  if (!(turns >= 1) || beta.size() < 4 * Runout::kHarmonics) {
    throw Error(fmt::format("slow roll of {}: {:.3g} turns in {} samples: must be at least 1 turn in {} samples",
                            slow_roll.source, turns, beta.size(), 4 * Runout::kHarmonics));
  }
  Eigen::MatrixXd basis(beta.size(), 2 * Runout::kHarmonics + 1);
  basis.col(0).setOnes();
  for (int k = 1; k <= Runout::kHarmonics; ++k) {
    basis.col(2 * k - 1) = (k * beta.array()).cos();
    basis.col(2 * k) = (k * beta.array()).sin();
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(basis);
  const Eigen::VectorXd x = qr.solve(slow_roll["x"]), y = qr.solve(slow_roll["y"]);
  Runout r;
  for (int k = 1; k <= Runout::kHarmonics; ++k) {
    const auto i = static_cast<std::size_t>(k - 1);
    r.x_cos[i] = x(2 * k - 1);
    r.x_sin[i] = x(2 * k);
    r.y_cos[i] = y(2 * k - 1);
    r.y_sin[i] = y(2 * k);
  }
  return r;
}

std::map<std::string, double> runout_parameters(const Runout& runout) {
  std::map<std::string, double> out;
  for (std::size_t k = 0; k < Runout::kHarmonics; ++k) {
    out[fmt::format("runout_x_cos_{}", k + 1)] = runout.x_cos[k];
    out[fmt::format("runout_x_sin_{}", k + 1)] = runout.x_sin[k];
    out[fmt::format("runout_y_cos_{}", k + 1)] = runout.y_cos[k];
    out[fmt::format("runout_y_sin_{}", k + 1)] = runout.y_sin[k];
  }
  return out;
}

}  // namespace whirl::control
