#include <complex>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/run_report.hpp"

namespace whirl::pages {
namespace {

void add_json(ReportInputs& in, const std::filesystem::path& file, const std::string& name) {
  const io::Json document = io::load_json(file);
  const io::Json* schema = document.find("schema");
  const std::string kind =
      schema != nullptr && schema->get<std::string>() != nullptr ? *schema->get<std::string>() : "";
  const auto is = [&](const char* what) { return kind.starts_with(std::string(what) + "/"); };
  const std::string source = file.string();
  if (is("whirl.model")) {
    in.models.push_back({name, io::from_json<IdentifiedModel>(document, source)});
  } else if (is("whirl.controller")) {
    in.controllers.push_back({name, io::from_json<ControllerDesign>(document, source)});
  } else if (is("whirl.frf")) {
    in.responses.push_back({name, io::from_json<FrequencyResponse>(document, source)});
  } else if (is("whirl.modes")) {
    in.modes.push_back({name, io::from_json<ModalModel>(document, source)});
  } else if (is("whirl.stiffness")) {
    in.stiffness.push_back({name, io::from_json<StiffnessLaw>(document, source)});
  } else if (is("whirl.run")) {
    in.runs.push_back({name, document});
  } else if (is("whirl.validation")) {
    in.validations.push_back({name, document});
  } else {
    throw Error::in_file(source, 0,
                         "schema '" + kind +
                             "' cannot be reported: must be a model, controller, frf, modes, stiffness, "
                             "run or validation of whirl");
  }
}

}  // namespace

std::optional<signal::SynchronousCurve> read_bode_table(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return std::nullopt;
  io::Table table;
  try {
    table = io::read_table(file);
  } catch (const Error&) {
    return std::nullopt;  // a record: its reader says what is wrong with it
  }
  const Channel *amplitude = nullptr, *phase = nullptr, *speed = table.find("speed");
  for (const Channel& c : table.columns) {
    if (c.name.starts_with("amp")) amplitude = &c;
    if (c.name.starts_with("phase")) phase = &c;
  }
  if (speed == nullptr || amplitude == nullptr || phase == nullptr) return std::nullopt;
  signal::SynchronousCurve curve{file.stem().string(), speed->samples, {}};
  curve.vector.resize(speed->samples.size());
  for (Eigen::Index i = 0; i < curve.vector.size(); ++i)
    curve.vector[i] = std::polar(amplitude->samples[i], phase->samples[i]);
  return curve;
}

ReportInputs read_report_inputs(const std::vector<std::filesystem::path>& files) {
  ReportInputs in;
  in.files = files;
  for (const std::filesystem::path& file : files) {
    const std::string name = file.filename().string();
    if (name.ends_with(".json") || name.ends_with(".json.gz")) {
      add_json(in, file, name);
    } else if (auto curve = read_bode_table(file)) {
      in.bode.push_back({name, *std::move(curve)});
    } else {
      Recording record = io::read_recording(file);
      (record.has("x_open") && record.has("x_true") ? in.logs : in.records).push_back({name, std::move(record)});
    }
  }
  return in;
}

}  // namespace whirl::pages
