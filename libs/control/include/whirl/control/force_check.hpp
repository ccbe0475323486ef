#pragma once
#include <array>
#include <complex>
#include <cstdint>

#include "whirl/control/lateral_model.hpp"

namespace whirl::control {

/// What became of the force on its way to the rotor.
enum class ForceFault : std::uint8_t { none, lost, reversed, late };

struct ForceCheckSettings {
  LateralModel model;
  std::complex<double> eps;  ///< designed with, m: where the estimate of the unbalance starts
  double sample_time = 1e-3;
  double level = 100e-6;  ///< m; forces whose static deflection is below 0.7 of it are not judged
};

/// Compares the force that was asked for with the acceleration of the rotor: fixed size, pure, no allocation, no
/// exception.
///
/// The second difference of three readings less what the model says of stiffness and damping is the acceleration y by
/// force and unbalance; with the force u (as acceleration, at the time at which it acts) and the unbalance
/// e F(t) it is y = u + e F. Both sides go through the same low-pass (three poles of 600 1/s). Over the last 8 ms,
/// weighted exponentially, the residual r = y - u - e F is explained by (a) a gain of each actuator, r = (g - 1) u,
/// (b) u coming 8 ms later, (c) an unbalance that changed. `lost` or `reversed`: (a) leaves less than a fifth of r and
/// clearly less than (b) and (c) (of the wrong sign: less), with one gain below 0.35, for 8 ms; 2 ms are enough for a
/// large residual of the wrong sign; 17 ms are taken while (c) leaves less
/// than a quarter of r too: an unbalance that doubles under a force that cancels it looks like a loss at first. `late`:
/// the same for (b) with a share of 0.6 to 1.6 of the 8 ms. e is followed while r is small, or has been
/// large for 0.15 s and did not rise since. In the first 0.15 s after the first force it is
/// not known yet, (a) and (b) are fitted together with it, and (a) must hold for 10 ms. The first 20 ms tell nothing: a
/// force that cancels the unbalance differs from it by its beginning only, and one that begins some ms earlier than
/// designed for would look like one that does nothing on a rotor without unbalance.
///
/// A force that cancels the unbalance is proportional to it, so that (a) and (c) explain r nearly alike: an unbalance
/// that trebles looks like a force of the wrong sign. Where (a) is not four times as good as (c), and (c) leaves less
/// than half of r, the force is let go (`let_go`) until one of them is three times as good as the other, which takes 8
/// ms, at most 16 ms: a wrong force leaves nothing of r then, another unbalance all of it, and is known (`changed`,
/// `eps`). A large r with a gain below 0.1 is tested at once. Once within half a second; else the force is blamed.
///
/// Actuators that are dead from the first tick on look like twice the unbalance. So until the force has acted for 1 s
/// (half of it or more is found in the motion, with the unbalance designed with), it is let go as well when that
/// unbalance and gains below 0.25 of both actuators explain the motion for 8 ms.
class ForceCheck {
 public:
  using Complex = std::complex<double>;
  ForceCheck() = default;
  explicit ForceCheck(const ForceCheckSettings& settings) noexcept;

  /// One sample: displacement z in m, control acceleration `a` over the interval before it, unbalance per metre
  /// `forcing` at it. A sample that is not fresh is left out.
  ForceFault step(std::complex<double> z, bool fresh, std::complex<double> a, std::complex<double> forcing) noexcept;
  void reset() noexcept;
  /// The force must be let go, to see what acts without it.
  bool let_go() const noexcept { return test_ > 0; }
  /// True for one sample: what was seen without force is another unbalance, `eps`.
  bool changed() const noexcept { return changed_; }
  Complex eps() const noexcept { return eps_; }  ///< the unbalance that acts, m
  /// The readings before a gap are forgotten.
  void interrupt() noexcept { readings_ = 0; }

 private:
  using Signals = std::array<double, 8>;  // real and imaginary parts of y, u, u late, unbalance
  static constexpr int kBlocks = 16;

  void low_pass(Signals& in) noexcept;
  Complex delayed(Complex u) noexcept;
  void collect(Complex y, Complex u, Complex late, Complex unbalance) noexcept;
  void prove() noexcept;
  void follow() noexcept;
  ForceFault judge() noexcept;
  ForceFault test_ended(double rr, Complex fr, double by_gain, double changed) noexcept;

  ForceCheckSettings settings_;
  double threshold_ = 0;          // m/s^2
  double share_ = 0;              // of the filters, a sample
  int samples_ = 1, blocks_ = 1;  // of the delay: samples a block, blocks
  // readings
  int readings_ = 0;
  Complex z1_, z2_, a1_, forcing1_;
  std::array<Complex, kBlocks> ring_{};
  Complex sum_;
  int summed_ = 0, at_ = 0;
  std::array<Signals, 3> filter_{};
  // Weighted means of products: f unbalance per metre, d = y - u, x and y the axes of u, l its change by the delay.
  Complex eps_, now_, fd_, fx_, fy_, fl_;
  double ff_ = 0, dd_ = 0, xx_ = 0, yy_ = 0, xd_ = 0, yd_ = 0, ll_ = 0, ld_ = 0;
  double time_ = 0, loud_ = 0, gain_time_ = 0, late_time_ = 0;  // s; time_ since the first force
  double test_ = 0, tested_ = 0, before_ = 0;  // s since let go and since the last test ended; r^2 when it began
  double usual_ = 0;                           // r^2 of the last 0.3 s
  double proven_ = 0, idle_ = 0;               // s in which the force acted, in which it seemed to do nothing
  ForceFault suspected_ = ForceFault::none;
  bool changed_ = false, risen_ = false;
};

}  // namespace whirl::control
