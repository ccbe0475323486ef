#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "command.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::app {

/// The files that say what a design may know about the machine: the options of `design`, `compare` and `robustness`.
struct PlantOptions {
  std::string model, stiffness, modes, hardware;
  double mass_kg = 0;
  std::vector<std::string> fmu_names;

  /// Adds --stiffness, --mass-kg, --modes, --hardware and --fmu-name.
  void add_to(CommandLine* sub);
  /// MODEL is a plant that another program modelled (whirl.plant or an FMU), no model.json.
  bool is_file() const;
  bool is_fmu() const;
  /// The model, the files read, and the hardware and gain put into `design`. Throws Error for a part of the model that
  /// `consumer` refuses. A plant file has mass and structure
  /// itself; an FMU is measured (survey_fmu). Throws Error when the mass is not known.
  IdentifiedModel load(tuning::DesignOptions& design, std::vector<std::filesystem::path>& inputs,
                       identification::Consumer consumer) const;
};

/// A finished design on the FMU it was made for: says what it reaches there, and fails `summary` where it does not
/// hold.
void say_on_fmu(const Session& session, const PlantOptions& plant, const tuning::Hardware& hardware,
                const ControllerDesign& design, Summary& summary);

}  // namespace whirl::app
