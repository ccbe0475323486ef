#pragma once
#include <array>
#include <complex>
#include <cstdint>
#include <string>

#include "whirl/control/lateral_model.hpp"

namespace whirl::control {

/// Bits of the status word of a re-identification.
enum ReidentificationBit : std::uint32_t {
  kStiffnessKnown = 1,  ///< the data determine it: its sd is below a quarter of its bound
  kDampingKnown = 2,
  kActuatorKnown = 4,
  kStiffnessBound = 8,  ///< the estimate is beyond its bound, where it is held
  kDampingBound = 16,
  kActuatorBound = 32,
  kUndetermined = 64,         ///< the data determine none of them
  kOtherMachine = 128,        ///< no such numbers explain the motion: the design's own act
  kReidentifierFrozen = 256,  ///< too slow or fast, force at its limit, reading lost, or supervision steps in
};

/// Stiffness, damping and gain of the actuators, in this order: dk / k1, dc / c, g - 1.
using MachineShares = std::array<double, 3>;

struct ReidentifierSettings {
  LateralModel model;
  std::complex<double> eps;  ///< m
  double sample_time = 1e-3;
  MachineShares bounds{0.2, 1, 0.3};
  bool acts = true;  ///< false: `acting` stays zero
};

/// What the machine differs by from the design.
struct Reidentification {
  MachineShares estimate{}, sd{};
  MachineShares acting{};  ///< what the force is corrected for
  std::uint32_t word = kUndetermined;
};

/// "stiffness -14.8 +- 2.1 %, ..." of what is determined, or why nothing is.
std::string reidentification_text(const Reidentification& last);

/// One sample, at the time the displacement was taken.
struct ReidentifierInput {
  std::complex<double> z;        ///< displacement, m
  std::complex<double> a;        ///< the design's gain times the force sent, mean of the last interval, m/s^2
  std::complex<double> forcing;  ///< unbalance_per_metre
  std::complex<double> turn;     ///< e^{i beta}
  std::complex<double> half;     ///< e^{i omega h / 2}
  double omega = 0, omega_dot = 0;
  bool frozen = false;  ///< nothing is learned from this sample
  bool taken = false;   ///< supervision took a step: back to the design's numbers
};

/// k1, c and the gain of the actuators while the machine runs, beside an unbalance that is not known. Fixed size, no
/// allocation, no exception; a copy is an independent one in the same state.
///
/// Weak form over windows of three turns: with theta from 0 to 6 pi, w = sin^4(theta / 6) and phi = w e^{-i beta},
///   <z, phi''> - <a(z, 0), phi> + <a(0, z), phi'> - <b u, phi> - eps <f, phi>
///     = -dk <z, phi> + dc <z, phi'> + (g - 1 + i s) <b u, phi> + de <f, phi> + k1 q <1, w>,
/// a(z, v) the design's acceleration without control, f = unbalance_per_metre. No derivative of a reading is taken, the
/// change of speed and amplitude is in it, and offset, harmonics and what turns backward have no part in <., phi>.
/// Least squares with forgetting and a prior at the design's numbers, in which change of unbalance de, runout q and
/// force across s are unknown, too: what those explain as well is not claimed. A PD law at a steady speed gives one
/// complex equation, a pass through the critical speed tells stiffness and gain apart.
///
/// The error of an equation is a share of its elastic and control acceleration. `acting` follows what is determined and
/// differs by more, slowly, stiffness and damping only while the gain is known, because a force replaces them; it is
/// held while nothing is determined.
class Reidentifier {
 public:
  static constexpr int kUnknowns = 8;  ///< dk, dc, g - 1, de, q, s
  Reidentifier() = default;
  explicit Reidentifier(const ReidentifierSettings& settings) noexcept;

  const Reidentification& step(const ReidentifierInput& in) noexcept;
  void reset() noexcept;

 private:
  using Vector = std::array<double, kUnknowns>;
  using Row = std::array<std::complex<double>, kUnknowns>;
  void forget() noexcept;
  void collect(const ReidentifierInput& in) noexcept;
  void close() noexcept;
  void judge(double square, const Vector& mean, const Vector& variance) noexcept;

  ReidentifierSettings settings_;
  double slow_ = 0;                         // rad/s
  double theta_ = -1;                       // of the window; negative: none is open
  std::complex<double> y_, z_, v_, a_, f_;  // sums over the window
  double weight_ = 0;
  std::array<Vector, kUnknowns> information_{};
  Vector moment_{};
  double square_ = 1;  // of the residual, relative to the error of the equation
  MachineShares target_{};
  Reidentification out_;
};

}  // namespace whirl::control
