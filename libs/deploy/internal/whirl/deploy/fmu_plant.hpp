#pragma once
#include <complex>
#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "whirl/core/control_types.hpp"
#include "whirl/rotor/speed_profile.hpp"

namespace whirl::deploy {

struct FmuPlantOptions {
  rotor::SpeedProfile profile;  ///< prescribed rotor angle
  double sample_time = 1e-3;    ///< communication step, s
  /// Variables of the FMU by role: x, y (m, outputs), ux, uy (N, inputs), beta, omega, alpha (rad, rad/s, rad/s^2,
  /// inputs). Not named: x_sensor or x, y_sensor or y, ux, uy, beta, omega, alpha; those of the angle may be missing.
  std::map<std::string, std::string> names;
  int delay_samples = 0;  ///< by which commands act late: the delay of a loop that the FMU does not have
};

/// A plant made elsewhere as a rig of the control loop: an FMU for co-simulation, FMI 2.0 or 3.0, with a binary for
/// Linux on x86-64. Its code runs inside this process: load only what you trust.
///
/// Per tick: `read()`, `write(command)`, `advance()`, none of which throws. A step that the FMU refuses is latched in
/// `failed()`; readings are then not valid.
class FmuPlant {
 public:
  /// Throws Error when the file is no such FMU, a variable is missing, or it cannot be initialised.
  FmuPlant(const std::filesystem::path& fmu, const FmuPlantOptions& options);
  ~FmuPlant();
  FmuPlant(const FmuPlant&) = delete;
  FmuPlant& operator=(const FmuPlant&) = delete;

  Measurement read() const noexcept;
  void write(const Command& command) noexcept;
  void advance() noexcept;
  bool failed() const noexcept;
  long ticks() const noexcept;   ///< of the whole profile
  int version() const noexcept;  ///< of the standard, 2 or 3

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace whirl::deploy
