#pragma once
#include <array>
#include <complex>
#include <cstdint>
#include <memory>

#include "whirl/core/control_types.hpp"
#include "whirl/rig/parameters.hpp"
#include "whirl/rt/release.hpp"

namespace whirl::rig {

/// What does not depend on commands and noise, computed once and shared by many runs: above all the
/// prescribed angle. `like`: tables of another rig; their angle part (nearly all of the cost) is shared when
/// profile, laser, encoder and timing are the same, as in a Monte Carlo study over rotors.
class RigTables;
std::shared_ptr<const RigTables> make_rig_tables(const RigParameters& parameters,
                                                 const std::shared_ptr<const RigTables>& like = nullptr);

/// The virtual test rig in closed loop: rotor, structure, sensors, converters, actuators, delay, faults.
///
/// Per control tick: `read()`, `write(command)`, `advance()`. What `read` gives is what real hardware would
/// give; the true state is only in RigTruth, which controllers must not use. After construction nothing
/// allocates or throws; two rigs with the same parameters and run give the same numbers.
///
/// The rotor is integrated by RK4 with steps that end on every control tick and sensor instant; actuators and
/// extra modes are linear with held input and advanced exactly.
class VirtualRig {
 public:
  explicit VirtualRig(const RigParameters& parameters, const RigRun& run = {});
  VirtualRig(std::shared_ptr<const RigTables> tables, const RigRun& run);
  VirtualRig(VirtualRig&&) noexcept;
  VirtualRig& operator=(VirtualRig&&) noexcept;
  ~VirtualRig();

  Measurement read() const noexcept;            ///< at the current tick
  void write(const Command& command) noexcept;  ///< forces asked for, N; kept until the next write
  /// What to send, turned on, in ticks without a command; false: this board cannot (RigActuator::turns_held_force).
  bool hold(const rt::SynchronousRelease& force) noexcept;
  void advance() noexcept;       ///< to the next tick
  bool done() const noexcept;    ///< the profile has ended
  double time() const noexcept;  ///< of the current tick, s
  long tick() const noexcept;
  long ticks() const noexcept;  ///< of the whole profile
  /// Back to t = 0 with another noise seed.
  void restart(std::uint64_t seed) noexcept;

 private:
  friend class RigTruth;
  struct State;
  std::unique_ptr<State> state_;
};

/// What no sensor shows: for the report and for tests only.
class RigTruth {
 public:
  explicit RigTruth(const VirtualRig& rig) : rig_(&rig) {}
  std::complex<double> z() const noexcept;          ///< disk centre, m
  std::complex<double> dz() const noexcept;         ///< m/s
  std::complex<double> tilt() const noexcept;       ///< of the disk axis, rad; 0 for a rotor that does not tilt
  std::complex<double> force() const noexcept;      ///< force acting now on the rotor, N
  std::complex<double> commanded() const noexcept;  ///< force after converter and limit, before lag and gain error, N
  rotor::AngleState angle() const noexcept;
  bool finite() const noexcept;  ///< false: the motion has diverged

 private:
  const VirtualRig* rig_;
};

}  // namespace whirl::rig
