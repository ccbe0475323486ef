#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/core/stiffness_law.hpp"
#include "whirl/diagnosis/standards.hpp"
#include "whirl/io/json.hpp"
#include "whirl/pages/record_views.hpp"
#include "whirl/pages/verdict.hpp"
#include "whirl/report/document.hpp"

namespace whirl::pages {

template <class T>
struct NamedFile {
  std::string name;  ///< of the file, without its folder
  T value;
};

/// Files of a project, sorted by what they hold.
struct ReportInputs {
  std::vector<std::filesystem::path> files;
  std::vector<NamedFile<Recording>> records;                           ///< open-loop runs, without their bad samples
  std::map<std::string, std::vector<std::string>> left_out;            ///< by the name of the record, a line each
  std::vector<NamedFile<Recording>> logs;                              ///< closed-loop runs (`whirl run --log`)
  std::vector<NamedFile<std::vector<signal::SynchronousCurve>>> bode;  ///< tables of `read_bode_table`
  std::vector<NamedFile<IdentifiedModel>> models;
  std::vector<NamedFile<ControllerDesign>> controllers;
  std::vector<NamedFile<FrequencyResponse>> responses;
  std::vector<NamedFile<ModalModel>> modes;
  std::vector<NamedFile<StiffnessLaw>> stiffness;
  std::vector<NamedFile<io::Json>> runs;         ///< whirl.run
  std::vector<NamedFile<io::Json>> validations;  ///< whirl.validation
};

/// How a record is read: with the columns and the tacho that the caller states.
using ReadRecord = std::function<Recording(const std::filesystem::path&)>;

/// Reads records (any format), Bode tables and JSON results. Throws Error for a file that holds none of them.
ReportInputs read_report_inputs(const std::vector<std::filesystem::path>& files, const ReadRecord& read = {});

struct ReportOptions {
  std::string title = "Rotor vibration report";
  Signature signature;       ///< of the verdict
  double service_speed = 0;  ///< rad/s, largest continuous speed: zones, grade and separation margin are stated for it
  double slow_roll = 0;      ///< rad/s: the mean 1X vector below this speed is taken off
  std::optional<diagnosis::MachineClass> machine;  ///< for the zones of housing vibration
  bool with_paper = false;                         ///< numbers of the paper's Table 4 beside the segments
  std::string command_line;
};

/// What a file says of a machine and its measurement (TOML, docs/formats.md): name, date, analyst, service speed, speed
/// of slow roll, class of ISO 20816-3. Throws Error with file, line, key and what is allowed.
ReportOptions about_machine(const std::filesystem::path& file);

/// The report of the inputs: runs in time, over speed and in their planes; models with their equations, their trust
/// sentence and their prediction of every record; closed loop with segments and effort; judgement by the standards'
/// numbers; provenance. Sections whose inputs are missing are left out.
report::Document run_report(const ReportInputs& inputs, const ReportOptions& options = {});

}  // namespace whirl::pages
