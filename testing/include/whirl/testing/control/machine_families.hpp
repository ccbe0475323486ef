#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "whirl/testing/control/foreign_rig.hpp"

/// Makes of machines, to hold a stated probability against: a make has what its papers say, and members that scatter
/// about it. On the rig of foreign_rig.hpp; nothing here knows how `robustness` draws.
namespace whirl::testing {

/// Standard deviations that the papers state. How the members are spread within them they do not say.
struct StatedSpread {
  double stiffness = 0.05, damping = 0.2, unbalance = 0.02, gain = 0.03, axes = 0.02;
  double runout = 0.3, participation = 0.3;
};

class MachineFamily {
 public:
  /// The structure is that of the model: radial cubic spring, symmetric shaft, no gyroscopic terms, no torque coupling.
  /// Another make for every seed: size, damping, unbalance, modes of the structure, lag; and the way its members
  /// scatter, which the papers do not say. Nor do they, unless `measured`, say the runout of the sensors and how the
  /// structure rings when a run begins.
  MachineFamily(std::uint64_t seed, bool measured) : random_(seed * 104729 + 71) {
    ForeignMachine& m = centre_;
    m.mass = 0.8 * std::pow(8, in(0, 1));
    const double w = 2 * std::numbers::pi * in(9, 15);
    m.stiffness = m.mass * w * w;
    m.damping = 2 * in(0.005, 0.02) * m.mass * w;
    m.unbalance = in(120e-6, 350e-6);
    m.unbalance_angle = in(-3, 3);
    m.cubic = in(0, 0.08) * m.stiffness / (6e-3 * 6e-3);
    m.inertia = 1e9;
    m.top = 2.5 * w;
    m.modes[0] = {in(35, 60), in(0.006, 0.02), 0, 1, in(0, 1) < 0.5 ? -1.0 : 1.0, in(0.01, 0.06) / m.mass};
    m.modes[1] = {in(90, 160), in(0.006, 0.02), 0, 1, in(0, 1) < 0.5 ? -1.0 : 1.0, in(0.005, 0.03) / m.mass};
    m.lag = in(3e-4, 1.2e-3);
    m.delay = 1e-3;
    m.force_limit = 1.6 * m.mass * m.unbalance * m.top * m.top;
    m.down = 8;
    way_ = static_cast<int>(in(0, 4));
    const double level = std::exp(0.25 * gauss()), ringing = in(0, 1) * 0.15 * m.unbalance * m.top;
    if (!measured) level_ = level, ringing_ = ringing;
  }

  /// What the papers say: the mean of the make.
  const ForeignMachine& centre() const { return centre_; }
  /// Runout of the sensors as their data sheet states it, m, once, twice, three times a turn.
  static constexpr std::array<double, 3> kRunout{10e-6, 5e-6, 2.5e-6};

  /// The next member; `spread` as stated.
  ForeignMachine member(const StatedSpread& spread) {
    ForeignMachine m = centre_;
    m.stiffness *= 1 + spread.stiffness * scatter();
    m.damping *= 1 + spread.damping * scatter();
    const double larger = spread.unbalance * scatter(), turned = spread.unbalance * scatter();
    m.unbalance *= 1 + larger;
    m.unbalance_angle += turned;
    m.gain = 1 + spread.gain * scatter();
    m.cross = -spread.axes * scatter();
    for (std::size_t k = 0; k < kRunout.size(); ++k) {
      m.runout[k] = kRunout[k] * level_ * std::max(1 + spread.runout * scatter(), 0.0);
      m.runout_phase[k] = in(-3.141, 3.141);
    }
    for (ForeignMode& mode : m.modes) {
      mode.inverse_mass *= std::max(1 + spread.participation * scatter(), 0.0);
      mode.start = ringing_ / (2 * std::numbers::pi * mode.hertz) * in(-1, 1);
    }
    return m;
  }
  /// Its way of scattering, for messages.
  const char* way() const {
    static constexpr const char* kNames[] = {"even between limits", "normal", "triangular", "two lots"};
    return kNames[way_];
  }
  double level() const { return level_; }      ///< runout of the make / data sheet
  double ringing() const { return ringing_; }  ///< largest velocity of a mode at the start, m/s

 private:
  double in(double low, double high) { return low + (high - low) * static_cast<double>(random_() >> 11) * 0x1p-53; }
  double gauss() {
    double sum = -6;  // of twelve even ones: no tails, close to normal
    for (int i = 0; i < 12; ++i) sum += in(0, 1);
    return sum;
  }
  /// Mean 0, standard deviation 1.
  double scatter() {
    switch (way_) {
      case 0:
        return std::sqrt(3.0) * in(-1, 1);
      case 1:
        return gauss();
      case 2:
        return std::sqrt(6.0) * (in(0, 1) - in(0, 1));
      default:  // two lots, each narrow
        return (in(0, 1) < 0.5 ? -0.9 : 0.9) + std::sqrt(0.19) * gauss();
    }
  }

  std::mt19937_64 random_;
  ForeignMachine centre_;
  int way_ = 0;
  double level_ = 1, ringing_ = 0;
};

}  // namespace whirl::testing
