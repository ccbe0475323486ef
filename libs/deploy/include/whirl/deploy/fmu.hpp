#pragma once
#include <filesystem>
#include <vector>

#include "whirl/deploy/code.hpp"
#include "whirl/deploy/system.hpp"

namespace whirl::shaft {
struct RotorController;
}

namespace whirl::deploy {

/// What an FMU (Functional Mock-up Unit, https://fmi-standard.org) offers.
struct FmuOptions {
  CodeOptions code;  ///< prefix is the model identifier; double precision only
  int version = 2;   ///< of the standard: 2 (2.0) or 3 (3.0)
  bool co_simulation = true;
  bool model_exchange = true;  ///< of a model; a sampled controller has none
  double inner_step = 1e-3;    ///< Runge-Kutta step of a model in co-simulation, s; at most the communication step
  bool all_platforms = false;  ///< binaries for Windows on x86-64 and Linux on aarch64 too, where their compilers are
};

/// Files of an FMU except the binary: modelDescription.xml, sources/ and, in version 3, its build description.
///
/// Controller: inputs x, y, beta, omega, omega_dot, valid; a step takes the inputs at its start and the outputs hold
/// until its end; the communication step is a multiple of the sample time. Model: inputs, states, derivatives, outputs
/// of model_system; in co-simulation inputs are held over a step except that the angle goes on with the speed; in model
/// exchange every sgn() is an event. SI units. Throws Error for what has no such form (a map, a controller in model
/// exchange).
std::vector<SourceFile> fmu_files(const ControllerDesign& design, const FmuOptions& options);
std::vector<SourceFile> fmu_files(const IdentifiedModel& model, const FmuOptions& options);

/// Controller of a flexible rotor: an input for every probe, angle, speed; an output for every actuator. The
/// communication step is the sample time; the force that a step returns acts from its end on.
std::vector<SourceFile> fmu_files(const shaft::RotorController& controller, const FmuOptions& options);

/// Compiles the sources with the system's C compiler `cc` for this machine (Linux on x86-64) and, when asked, with
/// x86_64-w64-mingw32-gcc and aarch64-linux-gnu-gcc where these are installed, and packs the FMU. The file is the same
/// for the same input and compilers. Returns the platforms. Throws Error when `cc` is missing, a compiler fails or the
/// file cannot be written.
std::vector<std::string> pack_fmu(const std::vector<SourceFile>& files, const FmuOptions& options,
                                  const std::filesystem::path& path);

}  // namespace whirl::deploy
