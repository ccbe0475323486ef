#pragma once
#include <array>
#include <cstdint>
#include <memory>

#include "whirl/rig/virtual_rig.hpp"

namespace whirl::rig {

/// One number per lane.
template <int Lanes>
struct alignas(64) LaneArray {
  std::array<double, Lanes> v{};
  double& operator[](int lane) { return v[static_cast<std::size_t>(lane)]; }
  double operator[](int lane) const { return v[static_cast<std::size_t>(lane)]; }
};

/// `Lanes` rigs side by side: one plant under many controllers, or as many plants (Monte Carlo over rotors). The
/// arithmetic is that of VirtualRig, in vector registers; a lane gives what VirtualRig gives with the same seed and
/// commands, whatever the other lanes do and however many there are. No fault script, no tilt. Instantiated for 8, 16
/// and 32 lanes.
///
/// Throughput comes from the shared forcing table and from laws that are themselves written as loops over the
/// lanes (copy the reading first: the compiler then knows that nothing overlaps; bench/machine/rig_tsmc_lanes.cpp).
template <int Lanes>
class BatchRig {
 public:
  using Lane = LaneArray<Lanes>;
  struct Reading {
    double t = 0;
    Lane x, y;                                  ///< m
    double beta = 0, omega = 0, omega_dot = 0;  ///< the same for all lanes
  };

  explicit BatchRig(std::shared_ptr<const RigTables> tables, std::uint64_t seed = 1);
  /// One rig and one noise seed per lane. The rigs may differ in the rotor (not its mass) and its further forces, in
  /// gain error, axes, bandwidth, current limit, slew and hysteresis of the actuators, in low-pass, hysteresis and
  /// runout of the sensors, and in sign, participation, frequency and deflection at the start of the structural modes;
  /// all else is the first one's, and the tables must share their angle part (make_rig_tables, `like`). Throws Error
  /// when they do not.
  BatchRig(const std::array<std::shared_ptr<const RigTables>, Lanes>& tables,
           const std::array<std::uint64_t, Lanes>& seeds);
  BatchRig(BatchRig&&) noexcept;
  BatchRig& operator=(BatchRig&&) noexcept;
  ~BatchRig();

  const Reading& read() const noexcept;
  void write(const Lane& ux, const Lane& uy) noexcept;  ///< N
  void advance() noexcept;
  /// advance() of a run without force whose readings nobody takes: true_x and true_y alone move. From the start of a
  /// run to its end, or restart().
  void coast() noexcept;
  bool done() const noexcept;
  long tick() const noexcept;
  /// True displacement of the disk centre, m: for the objective, not for the law.
  const Lane& true_x() const noexcept;
  const Lane& true_y() const noexcept;
  /// Force on the x axis after converter, limit, slew and hysteresis, before lag and gain error, N.
  const Lane& commanded_x() const noexcept;
  void restart(std::uint64_t seed);  ///< lane i of different rigs takes seed + i; lanes of one rig share the noise

 private:
  struct State;
  std::unique_ptr<State> state_;
};

extern template class BatchRig<8>;
extern template class BatchRig<16>;
extern template class BatchRig<32>;

}  // namespace whirl::rig
