#pragma once
#include <cstdint>
#include <string>

#include "whirl/core/identified_model.hpp"
#include "whirl/tuning/closed_loop.hpp"
#include "whirl/tuning/design.hpp"

/// Design and run in their shortest form, in `whirl::`; everything that can be chosen stands in `whirl::tuning`.
namespace whirl {

using tuning::ClosedLoopRun;

/// The test rig that a controller runs on in simulation, by default that of the paper with its 1.5 kg disk.
struct VirtualRig {
  rig::RigParameters parameters;
  tuning::ClosedLoopOptions options;  ///< seed of the sensor noise, faults, safety limits
};

/// What a design needs beside the model.
struct DesignRequest {
  double mass_kg = 0;  ///< turns forces into accelerations; 0: the input gain of the model
  std::string law = "tsmc";
  std::string estimator = "kfe";
  /// Data sheets of sensors, converters and actuators and the speed profile; by default those of the virtual rig.
  tuning::Hardware hardware = tuning::data_sheet(rig::RigParameters{});
  int evaluations = 160;  ///< of the objective
  std::uint64_t seed = 1;
};

/// A tuned controller for an identified rotor. Throws Error for a mass below 0 or not finite, and as tuning::design
/// does.
ControllerDesign design(const IdentifiedModel& model, const DesignRequest& request = {});

/// One run of the whole speed profile under control: log and metrics.
ClosedLoopRun run(const ControllerDesign& controller, const VirtualRig& rig);

}  // namespace whirl
