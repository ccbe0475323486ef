#include "whirl/core/error.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/bode_table.hpp"
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

ReportInputs read_report_inputs(const std::vector<std::filesystem::path>& files, const ReadRecord& read) {
  ReportInputs in;
  in.files = files;
  for (const std::filesystem::path& file : files) {
    const std::string name = file.filename().string();
    if (name.ends_with(".json") || name.ends_with(".json.gz")) {
      add_json(in, file, name);
    } else if (std::vector<signal::SynchronousCurve> curves = read_bode_table(file); !curves.empty()) {
      in.bode.push_back({name, std::move(curves)});
    } else {
      Recording record = read ? read(file) : io::read_recording(file);
      if (record.has("x_open") && record.has("x_true")) {
        in.logs.push_back({name, std::move(record)});
        continue;
      }
      CleanRecord clean = without_bad_samples(std::move(record));
      in.records.push_back({name, std::move(clean.record)});
      if (!clean.left_out.empty()) in.left_out[name] = std::move(clean.left_out);
    }
  }
  return in;
}

}  // namespace whirl::pages
