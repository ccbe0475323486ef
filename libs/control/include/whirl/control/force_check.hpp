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
  double delay = 0;       ///< of the loop, s
  double limit = 0;       ///< of the force, as acceleration, m/s^2; 0: none
  double slew = 0;        ///< of the force, as acceleration, m/s^3; 0: not known, then the limit within 5 ms
  double hysteresis = 0;  ///< width of it, as acceleration, m/s^2; 0: not known, then 6 % of the limit
};

/// Compares the force that was asked for with the acceleration of the rotor: fixed size, pure, no allocation, no
/// exception.
///
/// The second difference of three readings less what the model says of stiffness and damping is the acceleration y by
/// force and unbalance; with the force u (as acceleration, at the time at which it acts) and the unbalance
/// e F(t) it is y = u + e F. Both sides go through the same low-pass (three poles of 600 1/s). Means over the last
/// 8 ms, weighted exponentially, explain the residual r = y - u - e F.
///
/// What the model may have wrong is no evidence: r first loses the part along the displacement that an error of the
/// stiffness up to a quarter of k1, real or turned, explains. Nothing is judged for 8 ms and the loop delay after the
/// force was at its limit or changed as fast as its actuator can: what was delivered is then known to be not what was
/// asked for. Forces within the hysteresis of the actuator are not judged.
///
/// A suspicion is an r that (a) a gain of each actuator, r = (g - 1) u, or (b) u coming 8 or 12 ms later explains: it
/// leaves less than a fifth of r for 8 ms (2 ms are enough for a large one of the wrong sign). For (a) one gain is
/// below 0.35, for (b) 0.6 to 1.6 of the better of both delays are found; 12 ms are not tried while the unbalance is
/// not known. `lost` or `reversed`: (a) is four times as good as (c), another unbalance, or clearly better where (c)
/// leaves more than half. Else the force is let go (`let_go`) for 6 to 24 ms: a wrong force leaves nothing of r then,
/// another unbalance all of it, and is known (`changed`, `eps`).
///
/// Where the force was limited, only gains that are fitted together with e count, over the end of the force that is let
/// go. An actuator is blamed where its gain is below 0.35 and a gain of 0.7, which a design is certified for, would
/// leave more of r^2 than twice what the best gains leave (six times where the slew is not stated), and more than the
/// hysteresis. The ratio of both is the F statistic of one gain. A gain below -0.4 that is proven so for 8 ms is blamed
/// at once: nothing that limits a force turns its sign. Nor does a limit leave less than 2 % of r^2 to a mere delay.
///
/// e is followed while r is small, or has been large for 0.15 s and did not rise since. In the first 0.15 s after the
/// first force it is not known yet. The first 20 ms tell nothing: a force that cancels the unbalance differs from it by
/// its beginning only. Actuators that are dead from the first tick on look like twice the unbalance. So until the force
/// has acted for 1 s (half of it or more is found in the motion, with the unbalance designed with), it is let go as
/// well when that unbalance and gains below 0.25 of both actuators explain the motion for 8 ms.
class ForceCheck {
 public:
  using Complex = std::complex<double>;
  ForceCheck() = default;
  explicit ForceCheck(const ForceCheckSettings& settings) noexcept;

  /// One sample: displacement z in m, control acceleration `a` over the interval before it, unbalance per metre
  /// `forcing` at it; `limited`: the force that is asked for is at its limit. A sample that is not fresh is left out.
  ForceFault step(std::complex<double> z, bool fresh, std::complex<double> a, std::complex<double> forcing,
                  bool limited) noexcept;
  void reset() noexcept;
  /// The force must be let go, to see what acts without it.
  bool let_go() const noexcept { return test_ > 0; }
  /// True for one sample: what was seen without force is another unbalance, `eps`.
  bool changed() const noexcept { return changed_; }
  Complex eps() const noexcept { return eps_; }    ///< the unbalance that acts, m
  double late() const noexcept { return found_; }  ///< of a force that is late: by how much, s
  /// The readings before a gap are forgotten.
  void interrupt() noexcept { readings_ = 0; }

 private:
  static constexpr int kBlocks = 16;
  /// What explains r; mean squares, m^2/s^4.
  struct Fit {
    double rr = 0, changed = 0, by_gain = 0, by_delay = 0;  // r^2, and what is left by unbalance, gains, delay
    double gain_x = 1, gain_y = 1, sure_x = 0, sure_y = 0;  // gains; r^2 for each squared difference of one
    double share = 0, delay = 0;                            // of the probe that fits best; the delay, s
    Complex eps;                                            // unbalance beside those gains, m
    double low() const noexcept { return gain_x < gain_y ? gain_x : gain_y; }
    double high() const noexcept { return gain_x < gain_y ? gain_y : gain_x; }
  };

  /// What is multiplied: d = y - u, the axes x and y of u, its changes l and m by the delays, z, unbalance per metre f.
  enum Factor : std::size_t { kD, kX, kY, kL, kM, kZ, kF, kFactors = 8 };
  using Row = std::array<double, kFactors>;
  typedef double Vector __attribute__((vector_size(sizeof(Row))));
  using LowPass = std::array<Row, 3>;  // its poles
  void low_pass(Vector& now, LowPass& poles) const noexcept;
  /// Weighted means of the products of each factor: with the conjugate of f, with that of z, the squares, and the real
  /// part of that with the conjugate of d. One row beside the other in vector registers.
  struct Means {
    Row f_re{}, f_im{}, z_re{}, z_im{}, square{}, with_d{};
    Complex f(Factor of) const noexcept { return {f_re[of], f_im[of]}; }
    Complex z(Factor of) const noexcept { return {z_re[of], z_im[of]}; }
  };
  struct Late {
    Complex near, far;  // u as it was 8 ms and 12 ms ago
  };
  Late delayed(Complex u) noexcept;
  /// Real and imaginary parts of y, u, u late, unbalance; of displacement, u later.
  void collect(const Vector& first, const Vector& second) noexcept;
  /// What is left of r by the unbalance and by an error of the stiffness.
  struct Rest {
    double per = 0, zz = 0, rr = 0;
    Complex fr, zr, q;
  };
  Rest rest(Complex e, bool known, double share = 1) const noexcept;
  Fit fit(Complex e, bool known, double share = 1) const noexcept;
  bool lost(const Fit& f, double proof) const noexcept;
  bool turned(const Fit& f) const noexcept;
  void prove() noexcept;
  void follow() noexcept;
  ForceFault judge() noexcept;
  ForceFault judge(const Fit& f, bool starting) noexcept;
  ForceFault test_ended(const Fit& f) noexcept;

  ForceCheckSettings settings_;
  double threshold_ = 0, play_ = 0, least_ = 0;  // (m/s^2)^2: of r that is seen, of hysteresis, the larger
  double change_ = 0, model_ = 0;                // m/s^2 a sample, 1/s^2
  double share_ = 0, rate_ = 0;                  // of the filters, a sample; 1/s
  int samples_ = 1, near_ = 1, blocks_ = 1;      // of the delays: samples a block, blocks
  // readings
  int readings_ = 0;
  Complex z1_, z2_, a1_, forcing1_;
  std::array<Complex, kBlocks> ring_{};
  Complex sum_;
  int summed_ = 0, at_ = 0;
  LowPass first_{}, second_{};  // of the signals that `collect` takes
  Complex eps_, now_;
  Means means_;
  double time_ = 0, loud_ = 0, gain_time_ = 0, late_time_ = 0, proof_time_ = 0;  // s; time_ since the first force
  double unsure_ = 0;                          // s in which what is delivered is not known
  double test_ = 0, tested_ = 0, before_ = 0;  // s since let go and since the last test ended; r^2 when it began
  double usual_ = 0;                           // r^2 of the last 0.3 s
  double found_ = 0;                           // delay of a force that seems late, s
  double proven_ = 0, idle_ = 0;               // s in which the force acted, in which it seemed to do nothing
  ForceFault suspected_ = ForceFault::none;
  bool changed_ = false, risen_ = false, known_ = false;
};

}  // namespace whirl::control
