#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "command_line.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::app {

/// The files that say what a design may know about the machine: the options of `design`, `compare` and `robustness`.
struct PlantOptions {
  std::string model, stiffness, modes, hardware;
  double mass_kg = 0;

  /// Adds --stiffness, --mass-kg, --modes and --hardware.
  void add_to(CommandLine* sub);
  /// MODEL is a plant that another program modelled (whirl.plant), no model.json.
  bool is_file() const;
  /// The model, the files read, and the hardware and gain put into `design`. A plant file has mass and structure
  /// itself. Throws Error when the mass is not known.
  IdentifiedModel load(tuning::DesignOptions& design, std::vector<std::filesystem::path>& inputs) const;
};

}  // namespace whirl::app
