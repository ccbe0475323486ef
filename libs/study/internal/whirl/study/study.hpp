#pragma once
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/core/stiffness_law.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/tuning/closed_loop.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::study {

/// Settings of the whole study.
struct StudyOptions {
  rig::RigParameters rig;        ///< the virtual machine; its parameters are read by the report only
  std::uint64_t seed = 1;        ///< of every noise; tuning uses others
  int evaluations = 160;         ///< per control law
  double snr_db = 20;            ///< of the noisy records, relative to each axis' clean rms
  std::filesystem::path folder;  ///< every step's files go here
  std::string command_line;
  std::function<void(const std::string& step, double fraction)> progress;
};

/// A record of the rig with what is known about it.
struct StudyRecord {
  std::string name;       ///< "rundown_5g_20db"
  double added_mass = 0;  ///< kg
  bool run_up = false, noisy = false;
  rig::OpenLoopRecord record;
};

/// One row of the Table 2 analogue: a model run free against a record.
struct StudyValidation {
  std::string figure;  ///< of the paper, e.g. "9b"
  std::string record;  ///< StudyRecord::name
  std::string method, trained_on;
  bool held_out = false;
  identification::Validation validation;
};

/// One closed-loop run.
struct StudyRun {
  std::string name;  ///< "5 g, TSMC"
  std::string law;
  tuning::ClosedLoopRun run;
};

/// Everything `whirl reproduce` computes, in the paper's order.
struct Study {
  StudyOptions options;
  rig::StiffnessTable stiffness_table;
  StiffnessLaw stiffness;
  FrequencyResponse frf;
  ModalModel modes;
  std::vector<StudyRecord> records;
  std::map<std::string, IdentifiedModel> models;  ///< "weak_5g", "weak_balanced", "weak_ideal", "paper_ideal", ...
  std::vector<StudyValidation> validations;
  RotorModel ideal_truth;                           ///< of the ideal isotropic rotor of the accuracy check
  std::map<std::string, ControllerDesign> designs;  ///< "tsmc", "tsmc_kfe", "pd", ...
  std::vector<StudyRun> runs;

  const StudyRecord& record(const std::string& name) const;
  const StudyRun& run(const std::string& name) const;
};

/// Runs the paper's study on the virtual rig: stiffness test, hammer test, records, identification, validation, design,
/// closed loop. Every intermediate result is also written to `options.folder` in the formats of the subcommands.
Study run_study(const StudyOptions& options);

}  // namespace whirl::study
