#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <random>
#include <vector>

#include "whirl/core/control_types.hpp"

/// A machine that libs/rig does not know: forces written one by one in real coordinates, fifth-order Dormand-Prince
/// steps of 50 us, its own encoder, hold and delay. Drawn from a seed. Nothing here knows RotorModel or RigParameters.
namespace whirl::testing {

/// A further mode in its own coordinates (p, q): the force at the actuator drives it, the sensor sees it.
struct ForeignMode {
  double hertz = 0, damping = 0;
  double split = 0;         ///< gyroscopic: backward and forward frequency differ by split * speed
  double actuator = 0;      ///< shape at the actuator, relative to the disc's own motion
  double sensor = 0;        ///< shape at the sensor
  double inverse_mass = 0;  ///< 1/kg
  double start = 0;         ///< deflection of both coordinates at t = 0, as the sensor sees it, m
  /// Share of the actuator's force that the loop sees, relative to the disc.
  double participation(double disc_mass) const { return actuator * sensor * inverse_mass * disc_mass; }
};

struct ForeignMachine {
  double mass = 1.5, stiffness = 8500, damping = 1.5;  ///< kg, N/m, N s/m
  double cubic = 0, quintic = 0, quadratic = 0;        ///< N/m^3, N/m^5 radial; N/m^2 along x
  double gyroscopic = 0;                               ///< N s/m per rad/s along i z'
  double unbalance = 300e-6, unbalance_angle = 0;      ///< m, rad
  std::array<ForeignMode, 2> modes{};
  double inertia = 0.05;                                 ///< kg m^2, about the axis; torque coupling by the unbalance
  double top = 190, down = 13, still = 1;                ///< rad/s; s from there to the last speed; s at it
  double bottom = 0;                                     ///< the last speed, rad/s: above `top` in a run-up
  double gain = 1, cross = 0, lag = 5e-4, delay = 1e-3;  ///< of the actuators; force of one axis on the other; s
  double force_limit = 40;                               ///< N
  double sensor_cross = 0;                               ///< share of y in the reading of x and back
  std::array<double, 3> runout{}, runout_phase{};        ///< m, rad
  double noise = 0.7e-6, age = 0.25e-3;                  ///< m rms; age of a reading, s
  int counts = 1024;                                     ///< encoder lines per turn
  bool from_rest = false;                                ///< the disc is at rest when the run begins, at top speed

  double critical() const { return std::sqrt(stiffness / mass); }

  /// Another machine for every seed. `participation`: bound of the signed participation of the modes.
  static ForeignMachine draw(std::uint64_t seed, double participation = 0.3);
};

/// One run of the machine: read, write, advance once per millisecond, as the loop wants it.
class ForeignRig {
 public:
  static constexpr double kTick = 1e-3, kStep = 50e-6;
  static constexpr int kSteps = 20;

  ForeignRig(const ForeignMachine& machine, std::uint64_t seed) : m_(machine), random_(seed) {
    settle();
    commands_.assign(static_cast<std::size_t>(ticks() + 2), {});
    sense();
  }
  long ticks() const { return std::lround((m_.down + m_.still) / kTick); }
  bool done() const { return tick_ >= ticks(); }
  Measurement read() const noexcept { return reading_; }
  void write(const Command& u) noexcept { commands_[static_cast<std::size_t>(tick_)] = u; }
  void advance() noexcept;
  ForeignMachine& machine() { return m_; }  ///< to change it while it runs
  double x() const { return s_[0]; }        ///< of the disc, m
  double y() const { return s_[1]; }
  double angle() const { return s_[12]; }
  double speed() const { return s_[13]; }
  double command_x() const { return last_.ux; }  ///< acting, before lag, N
  double command_y() const { return last_.uy; }

 private:
  // x, y, x', y'; p1, q1, p1', q1'; p2, q2, p2', q2'; angle, speed; force x, y
  using State = std::array<double, 16>;

  Command acting(double t) const;
  void dormand_prince() noexcept;
  void settle();
  double gauss();
  void look();  ///< the reading that the next tick gets
  void sense();

  ForeignMachine m_;
  std::mt19937_64 random_;
  State s_{};
  std::vector<Command> commands_;
  Command last_, seen_;
  Measurement reading_;
  long tick_ = 0, step_ = 0;
  double turn_ = 0, rate_ = 0, change_ = 0;
};

/// The files a laboratory hands over: run-down without control, pull test, five hammer blows at the actuator seen by
/// an accelerometer at the sensor, and the data sheets as TOML. In `folder`: rundown.csv, pull.csv, blow_1..5.csv,
/// lab.toml.
void write_laboratory(const ForeignMachine& m, const std::filesystem::path& folder, std::uint64_t seed);

}  // namespace whirl::testing
