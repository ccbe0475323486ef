#pragma once
#include <Eigen/Core>
#include <complex>
#include <optional>
#include <vector>

#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

/// A free motion Re(shape e^{pole t}) of the whole rotor.
struct Mode {
  std::complex<double> pole;  ///< 1/s, imaginary part > 0
  /// From +1, forward (with the rotation) everywhere, to -1, backward everywhere: (forward^2 - backward^2) over their
  /// sum, where an orbit is the sum of a forward and a backward circle and squares are summed over the stations.
  double direction = 0;
  Eigen::VectorXcd x, y;  ///< deflection at the nodes, the largest is 1
  Eigen::VectorXcd body_x, body_y;

  double frequency() const { return pole.imag(); }                  ///< damped, rad/s
  double damping() const { return -pole.real() / std::abs(pole); }  ///< ratio; negative: unstable
};

/// The `count` modes that oscillate with the smallest |pole|, by |pole|; eigenpairs of the full equations, each to a
/// residual of 1e-9 of the inverse (block Krylov space of it, enlarged until they are; Saad, Numerical Methods for
/// Large Eigenvalue Problems, 2011, ch. 6). Throws Error when that fails.
std::vector<Mode> modes(const System& system, double speed, int count);

struct CampbellPoint {
  double speed = 0;         ///< rad/s
  std::vector<Mode> modes;  ///< in the order of the lines: mode k continues mode k of the point before
};
/// Modes over speed; lines are continued by their shapes, through crossings.
std::vector<CampbellPoint> campbell(const System& system, const std::vector<double>& speeds, int count);

/// Whether a mode grows by more than rounding: an undamped rotor is not unstable.
bool grows(const System& system, const Mode& mode);

/// Whether the stiffness at a speed brings the rotor back to its place. With a negative stiffness of magnets it may
/// not: the rotor then falls away without oscillating, which no frequency shows.
bool returns_to_place(const System& system, double speed);

struct Critical {
  double speed = 0;      ///< of the shaft, rad/s
  double frequency = 0;  ///< of the whirl, rad/s
  double direction = 0;  ///< as of a mode
};
/// Speeds at which an undamped mode whirls with `spin_per_whirl` = speed / frequency, ascending: 1 for unbalance, 1/2
/// for an excitation twice a turn. Directly, without a Campbell diagram: K v = w^2 (M - i s G) v, a Hermitian
/// eigenproblem; with supports that depend on speed solved again at its own answers. Skew parts of stiffness
/// (kxy != kyx), all damping and speeds above `highest` are left out. Throws Error for a rotor that does not return to
/// its place at rest.
std::vector<Critical> criticals(const System& system, double highest, double spin_per_whirl = 1);

/// The lowest speed in [from, to] above which a mode grows, with that mode's frequency; nothing when all are stable.
/// Modes are looked at at `steps` speeds, the crossing is found by bisection. Frequency 0: it falls away.
struct Threshold {
  double speed = 0;      ///< rad/s
  double frequency = 0;  ///< rad/s
  double direction = 0;
};
std::optional<Threshold> stability_threshold(const System& system, double from, double to, int count = 8,
                                             int steps = 60);

/// The first frequencies on the mesh and on one with every element halved. The error of the mesh in use, by Richardson:
/// difference / (1 - 2^-order), order 4, or 2 for the usual element with shear.
struct MeshCheck {
  std::vector<double> frequency, refined;  ///< rad/s
  std::vector<double> error;               ///< estimate, relative to the refined frequency
  double worst = 0;
  bool coarse = false;  ///< worst > limit
};
MeshCheck check_mesh(const Rotor& rotor, double speed, int count, double limit = 0.01);

}  // namespace whirl::shaft
