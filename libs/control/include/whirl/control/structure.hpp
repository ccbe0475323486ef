#pragma once
#include <array>
#include <complex>

namespace whirl::control {

/// A mode of the structure beside the rotor's own, as the loop sees it.
struct StructureMode {
  double omega = 0;    ///< undamped, rad/s; 0: none
  double damping = 0;  ///< ratio, below 1
  double share = 0;    ///< acceleration per newton relative to the rotor's, signed: shape at the sensor times that at
                       ///< the actuator
};

/// What the actuators make the structure show in the readings: modes driven by the control acceleration over each
/// sample, which is held in two pieces because the loop delay is no whole number of samples. Exact for that input.
/// Subtracted from the readings it leaves the disk, so that an observer of the disk does not take the structure for it.
/// Fixed size, no allocation.
class Structure {
 public:
  static constexpr int kModes = 4;

  Structure() = default;
  /// `split`: the part of a sample, in [0, 1), over which the first of the two accelerations acts. Modes without
  /// frequency or share are left out.
  Structure(const std::array<StructureMode, kModes>& modes, double sample_time, double split) noexcept;

  bool empty() const noexcept { return count_ == 0; }
  /// One sample further; the motion at the sensor, m. `first`, `second`: control acceleration of the disk, m/s^2.
  std::complex<double> step(std::complex<double> first, std::complex<double> second) noexcept;
  void reset() noexcept;

 private:
  /// x' = F x + G1 first + G2 second with x = (q, q').
  struct Mode {
    double f00 = 0, f01 = 0, f10 = 0, f11 = 0, first_q = 0, first_v = 0, second_q = 0, second_v = 0;
    std::complex<double> q, v;
  };
  std::array<Mode, kModes> modes_{};
  int count_ = 0;
};

}  // namespace whirl::control
