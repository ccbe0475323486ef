#pragma once
#include <array>
#include <complex>
#include <map>
#include <string>

#include "whirl/control/laws/pd.hpp"

namespace whirl::control {

/// Linear dynamics behind the force of one axis, sampled: q+ = A q + B u, a = C q + D u, with u = (x, y, v_x, v_y) in m
/// and m/s, a in m/s^2. Fixed size; states beyond `order` are not touched.
struct LinearAxis {
  static constexpr int kOrder = 12, kInputs = 4;
  using Inputs = std::array<double, kInputs>;

  int order = 0;
  std::array<double, kOrder * kOrder> a{};   ///< row by row, kOrder apart
  std::array<double, kOrder * kInputs> b{};  ///< row by row
  std::array<double, kOrder> c{};
  Inputs d{};
  std::array<double, kOrder> q{};  ///< state

  double step(const Inputs& u) noexcept;
  void reset() noexcept { q = {}; }
};

/// The law of a user: two of these, each with all inputs, so that axes may be coupled.
class LinearLaw {
 public:
  LinearLaw() = default;
  LinearLaw(const LinearAxis& x, const LinearAxis& y) noexcept : x_(x), y_(y) {}
  /// Displacement and velocity at the time at which the force acts; the acceleration without feedforward.
  std::complex<double> step(std::complex<double> z, std::complex<double> v, double /*omega*/ = 0) noexcept {
    const LinearAxis::Inputs u{z.real(), z.imag(), v.real(), v.imag()};
    return {x_.step(u), y_.step(u)};
  }
  void reset() noexcept { x_.reset(), y_.reset(); }
  const LinearAxis& x() const noexcept { return x_; }
  const LinearAxis& y() const noexcept { return y_; }

 private:
  LinearAxis x_, y_;
};

/// A transfer function or state space that a user wrote, beside the feedforward (a PD without gains).
struct StateSpace {
  Pd x{0, 0}, y{0, 0};
  LinearLaw linear;
};

/// The parameters of a design with this law. `gain`: acceleration per output, 1 where the outputs are accelerations,
/// that of the model where they are forces. `sample_time`: that the numbers hold for, s; 0: any.
std::map<std::string, double> linear_parameters(const LinearAxis& x, const LinearAxis& y, double gain,
                                                double sample_time);

}  // namespace whirl::control
