#include <fmt/format.h>

#include <numbers>

#include "command.hpp"
#include "commands/machine/record_options.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/pages/text/identification.hpp"

namespace whirl::app {
namespace {

struct ValidateFlags {
  std::string model, out;
  std::vector<std::string> files, clean;
  std::string unbalance = "identified";
  double added_um = 0, added_deg = 0;
  RecordOptions record;
};

identification::ValidateOptions validate_options(const ValidateFlags& o) {
  using identification::UnbalanceSource;
  identification::ValidateOptions options;
  options.unbalance = o.unbalance == "refitted" ? UnbalanceSource::refitted
                      : o.unbalance == "added"  ? UnbalanceSource::added
                                                : UnbalanceSource::identified;
  options.added = std::polar(o.added_um * 1e-6, o.added_deg * std::numbers::pi / 180);
  return options;
}

void run_validate(const ValidateFlags& o, Session& session) {
  const IdentifiedModel model = io::load<IdentifiedModel>(o.model);
  if (!o.clean.empty() && o.clean.size() != o.files.size()) {
    throw Error(fmt::format("--clean names {} files for {} records: must be one each", o.clean.size(), o.files.size()));
  }
  if (o.unbalance != "added" && (o.added_um != 0 || o.added_deg != 0))
    throw Error("--added-um and --added-deg are for --unbalance added");
  std::vector<Recording> records, clean;
  RecordOptions reader = o.record;
  reader.gaps = true;
  for (const std::string& file : o.files) {
    const Recording record = model.rotor ? identification::with_motion_names(reader.read(file)) : reader.read(file);
    records.push_back(model.rotor ? identification::with_angle_from_pulses(record, "") : record);
    records.back().source = file;
  }
  for (const std::string& file : o.clean) clean.push_back(o.record.read(file));
  const identification::ValidationReport report = identification::validate(model, records, validate_options(o), clean);
  io::Json document = to_json(report);
  std::vector<std::filesystem::path> inputs{o.model};
  inputs.insert(inputs.end(), o.files.begin(), o.files.end());
  document.set("provenance", to_json(io::provenance(inputs, session.command_line)));
  if (!o.out.empty()) io::save_json(o.out, document);
  session.say(report::to_text(pages::validation_table(report)));
  session.result(document);
  session.finish(report.summary);
}

}  // namespace

void add_validate(CommandLine& app, Session& session) {
  auto o = std::make_shared<ValidateFlags>();
  CommandLine* sub = add_command(
      app, session, "validate", "Free-run prediction of records that were not used for the fit",
      "Input: model.json and CSV records as for identify; --clean: the noise-free record of each, where known.\n"
      "--unbalance identified: the same rotor state; refitted: the unbalance is fitted to each run, the rest is "
      "predicted;\n"
      "added: identified plus the known eccentricity --added-um at --added-deg.\n"
      "Models of other systems are run on their inputs; errors are those of every measured state.\n"
      "Output: rmse_x, rmse_y rms against measured and, where known, clean, in metres or in the unit of records of "
      "velocity\n"
      "or acceleration; nrmse; fold sensitivity.\n\n"
      "Example: whirl validate model.json runup.csv --out validation.json",
      [o, &session] { run_validate(*o, session); });
  sub->add_option("MODEL", o->model, "model.json")->input()->required();
  sub->add_option("RECORDS", o->files, "records (CSV)")->input()->required();
  sub->add_option("--clean", o->clean, "noise-free x, y of each record")->input();
  sub->add_option("--unbalance", o->unbalance, "identified, refitted or added")
      ->one_of({"identified", "refitted", "added"})
      ->show_default();
  sub->add_option("--added-um", o->added_um, "eccentricity of a known added mass")->range(0, 1e6);
  sub->add_option("--added-deg", o->added_deg, "its angle from the angle zero")->range(-360, 360);
  o->record.add_tacho_to(sub);
  sub->add_option("--out", o->out, "write validation.json")->output("whirl.validation");
  o->record.add_to(sub);
}

}  // namespace whirl::app
