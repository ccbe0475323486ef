#pragma once
#include <array>
#include <complex>
#include <map>
#include <string>

#include "whirl/core/recording.hpp"

namespace whirl::control {

/// Sensor runout (form and electrical error of the surface the sensors look at) as a function of the rotor
/// angle, per axis sum over k = 1..5 of cos_k cos(k beta) + sin_k sin(k beta). A table of 1x to 5x, fixed
/// size.
struct Runout {
  static constexpr int kHarmonics = 5;
  std::array<double, kHarmonics> x_cos{}, x_sin{}, y_cos{}, y_sin{};  ///< m

  std::complex<double> at(std::complex<double> turn) const noexcept;  ///< m; `turn`: e^{i beta}
  std::complex<double> at(double beta) const noexcept { return at(std::polar(1.0, beta)); }
  bool empty() const noexcept;
};

/// Least squares on a slow-roll record (channels x, y, beta; the rotor turns so slowly that its own response
/// is negligible: Omega below a tenth of the natural frequency costs 1 % of e). Whole turns are not required.
/// Throws Error when the record covers less than one turn.
Runout estimate_runout(const Recording& slow_roll);

/// The same as parameters of a ControllerDesign: runout_x_cos_1, ..., runout_y_sin_5, in m.
std::map<std::string, double> runout_parameters(const Runout& runout);

}  // namespace whirl::control
