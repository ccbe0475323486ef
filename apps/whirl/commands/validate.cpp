#include <cmath>

#include "command.hpp"
#include "identify_evidence.hpp"
#include "record_options.hpp"
#include "whirl/identify/validate_model.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

struct Options {
  std::string model, out;
  std::vector<std::string> files, clean;
  std::string unbalance = "identified";
  double added_um = 0, added_deg = 0;
  RecordOptions record;
};

struct Outcome {
  io::Json::Array runs;
  report::Table table;
  Summary summary;
};

Outcome validate_rotor(const Options& o, const IdentifiedModel& model) {
  Outcome out;
  out.table.caption = "Free-run error, rms";
  out.table.columns = {{"record", "", report::Align::left},
                       {"x", "mm"},
                       {"y", "mm"},
                       {"x clean", "mm"},
                       {"y clean", "mm"},
                       {"nrmse", "%"},
                       {"note", "", report::Align::left}};
  for (std::size_t i = 0; i < o.files.size(); ++i) {
    identification::ValidateOptions options;
    options.unbalance = o.unbalance == "refitted" ? identification::UnbalanceSource::refitted
                        : o.unbalance == "added"  ? identification::UnbalanceSource::added
                                                  : identification::UnbalanceSource::identified;
    options.added = std::polar(o.added_um * 1e-6, o.added_deg * 3.14159265358979323846 / 180);
    if (!o.clean.empty()) options.clean = o.record.read(o.clean[i]);
    const identification::Validation v = identification::validate_model(model, o.record.read(o.files[i]), options);
    std::vector<std::string> row{o.files[i]};
    for (const double m : {v.rmse_x, v.rmse_y, v.clean_rmse_x, v.clean_rmse_y}) {
      row.push_back(std::isfinite(m) ? fmt::format("{:.4f}", 1e3 * m) : "-");
    }
    row.push_back(fmt::format("{:.2f}", 100 * v.nrmse));
    row.push_back(v.fold_sensitive ? "fold-sensitive" : std::string(to_string(v.summary.status)));
    out.table.add(std::move(row));
    for (const std::string& w : v.summary.warnings) out.summary.warn(w);
    if (v.summary.status == Status::unusable) out.summary.status = Status::unusable;
    out.runs.push_back(to_json(v, o.files[i]));
  }
  return out;
}

/// Any other model: every measured state, the whole record from its first sample and restarted every characteristic
/// period.
Outcome validate_general(const Options& o, const IdentifiedModel& model) {
  if (!o.clean.empty()) throw Error("--clean is for rotors");
  Outcome out;
  out.table.caption = "Free-run error, rms";
  out.table.columns = {{"record", "", report::Align::left},
                       {"state", "", report::Align::left},
                       {"error", "SI"},
                       {"noise", "SI"},
                       {"nrmse", "%"},
                       {"restarted every", "s"},
                       {"nrmse", "%"}};
  for (const std::string& file : o.files) {
    const identification::HeldOut h = predict_held_out(model, o.record.read(file), file, false);
    if (!h.reason.empty()) throw Error(h.reason);
    Summary summary;
    for (std::size_t k = 0; k < h.scores.size(); ++k) {
      const identification::StateScore& s = h.scores[k];
      const auto percent = [](double v) { return std::isfinite(v) ? fmt::format("{:.3g}", 100 * v) : "diverges"; };
      out.table.add({file, s.state, show_error(s.rmse), show_error(s.noise), percent(s.nrmse),
                     fmt::format("{:.3g}", h.horizon), percent(h.near[k].nrmse)});
      // Over one characteristic period even chaos can be followed.
      if (!std::isfinite(h.near[k].rmse))
        summary.fail(fmt::format("{}: the free run of {} diverges", file, s.state));
      else if (h.near[k].nrmse > 1) {
        summary.fail(fmt::format("{}: {} is predicted no better than by its mean", file, s.state));
      }
    }
    for (const std::string& w : summary.warnings) out.summary.warn(w);
    if (summary.status == Status::unusable) out.summary.status = Status::unusable;
    Evidence evidence;
    evidence.held_out = h;
    const io::Json shown = to_json(evidence);
    io::Json run = *shown.find("held_out");
    run.set("file", file).set("summary", to_json(summary));
    out.runs.push_back(std::move(run));
  }
  return out;
}

}  // namespace

void add_validate(CLI::App& app, Session& session) {
  auto o = std::make_shared<Options>();
  CLI::App* sub = add_command(
      app, session, "validate", "Free-run prediction of records that were not used for the fit",
      "Input: model.json and CSV records as for identify; --clean: the noise-free record of each, where known.\n"
      "--unbalance identified: the same rotor state; refitted: the unbalance is fitted to each run, the rest is "
      "predicted;\n"
      "added: identified plus the known eccentricity --added-um at --added-deg.\n"
      "Models of other systems are run on their inputs; errors are those of every measured state.\n"
      "Output: rmse_x, rmse_y in metres rms against measured and, where known, clean; nrmse; fold sensitivity.\n\n"
      "Example: whirl validate model.json runup.csv --out validation.json",
      [o, &session] {
        const IdentifiedModel model = io::load<IdentifiedModel>(o->model);
        if (!o->clean.empty() && o->clean.size() != o->files.size()) {
          throw Error(
              fmt::format("--clean names {} files for {} records: must be one each", o->clean.size(), o->files.size()));
        }
        const bool rotor = model.rotor || (!model.states.empty() && model.states.front() == "X1");
        Outcome outcome = rotor ? validate_rotor(*o, model) : validate_general(*o, model);
        io::Json document = io::start_document("whirl.validation", 1);
        document.set("runs", std::move(outcome.runs));
        std::vector<std::filesystem::path> inputs{o->model};
        inputs.insert(inputs.end(), o->files.begin(), o->files.end());
        document.set("summary", to_json(outcome.summary));
        document.set("provenance", to_json(io::provenance(inputs, session.command_line)));
        if (!o->out.empty()) io::save_json(o->out, document);
        session.say(report::to_text(outcome.table));
        session.result(document);
        session.finish(outcome.summary);
      });
  sub->add_option("MODEL", o->model, "model.json")->required();
  sub->add_option("RECORDS", o->files, "records (CSV)")->required();
  sub->add_option("--clean", o->clean, "noise-free x, y of each record");
  sub->add_option("--unbalance", o->unbalance, "identified, refitted or added")
      ->check(CLI::IsMember({"identified", "refitted", "added"}));
  sub->add_option("--added-um", o->added_um, "eccentricity of a known added mass");
  sub->add_option("--added-deg", o->added_deg, "its angle from the angle zero");
  sub->add_option("--out", o->out, "write validation.json");
  o->record.add_to(sub);
}

}  // namespace whirl::app
