#pragma once
#include <Eigen/Core>
#include <complex>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::rotor {

/// Motion at the samples, as the sensors see it: main mode + forced modes + offset, complex x + i y.
struct Response {
  double dt = 0;        ///< s
  Eigen::VectorXcd z;   ///< m
  Eigen::VectorXcd dz;  ///< m/s

  /// Channels x, y (m).
  Recording recording() const;
  /// Largest |z|, m.
  double peak_radius() const { return z.size() ? z.cwiseAbs().maxCoeff() : 0.0; }
};

/// State of the main mode (disk centre, without offset and forced modes).
struct WhirlState {
  std::complex<double> z;   ///< m
  std::complex<double> dz;  ///< m/s
};

/// Steady unbalance response at constant speed omega (rad/s) and angle beta: forward and backward whirl of
/// first order by harmonic balance (third harmonics of the cubic dropped; exact for an isotropic rotor).
/// Where the hardening rotor has three amplitudes it is the smallest, the one reached from far away. Zero at
/// standstill.
WhirlState steady_whirl(const RotorModel& model, double omega, double beta = 0);

/// The angle on a grid `substeps` times finer, by the quintic through beta, beta' and beta'' at both ends of each half
/// sample: error of order h^6, below that of RK4.
AngleSignal refine(const AngleSignal& angle, int substeps);

/// Transient response to a prescribed rotor angle, Runge-Kutta of order 4, one or more steps per sample.
///
/// `start` is the main mode at sample 0. Forced modes start in their steady state at the first speed and are
/// advanced exactly for a forcing that is quadratic over each step, so that stiff modes (w h > 1) stay exact.
/// With substeps = 1 the forcing is taken from the midpoints of `angle`; with more it is evaluated on the
/// quintic through beta, beta' and beta''. `force` (N, complex ux + i uy), when not empty, holds one value
/// per sample, kept constant until the next (zero-order hold); it needs model.gain. Throws Error when sizes
/// do not match or dt <= 0. A diverging motion gives non-finite samples, not an exception.
Response simulate(const RotorModel& model, const AngleSignal& angle, const WhirlState& start, int substeps = 1,
                  const Eigen::VectorXcd& force = {});
inline Response simulate(const RotorModel& model, const AngleSignal& angle, std::complex<double> z0,
                         std::complex<double> dz0) {
  return simulate(model, angle, WhirlState{z0, dz0});
}
/// The same from steady whirl at the first speed, with as many steps a sample as the free and the forced motion need.
Response simulate(const RotorModel& model, const AngleSignal& angle);

/// Steps a sample at which RK4 turns a free motion of frequency `free` by 1e-6 of its angle too little, and follows a
/// forcing of frequency `forced` to 2e-5; both rad/s, at least 1.
int steps_per_sample(double dt, double free, double forced);
/// Frequency of small motion about a whirl of this radius, rad/s: the fastest a RotorModel has.
double free_frequency(const RotorModel& model, double radius);

/// The inner kernel of simulate, for loops over many models with one angle: `forcing` from
/// unbalance_forcing(angle), size 2 N - 1. One step per sample, no forced modes, no offset.
Response simulate_main_mode(const RotorModel& model, const Eigen::VectorXcd& forcing, double dt,
                            const WhirlState& start);

/// Rotor driven by torque, angle and lateral motion coupled both ways (lagrange_acceleration). RK4 at dt / 2.
struct DrivenResponse {
  Response lateral;
  AngleSignal angle;  ///< resulting angle on the half-sample grid
};
DrivenResponse simulate_driven(const UnbalancedDisk& disk, const TorqueModel& torque, const DiskState& start, double dt,
                               Eigen::Index samples);

}  // namespace whirl::rotor
