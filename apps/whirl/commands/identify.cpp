#include <cmath>

#include "command.hpp"
#include "identify_compare.hpp"
#include "identify_evidence.hpp"
#include "identify_options.hpp"
#include "identify_stream.hpp"
#include "print.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/report/equation.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {
namespace {

std::string describe_model(const IdentifiedModel& model) {
  std::string text = fmt::format("method: {}\n", model.method);
  for (const Equation& equation : model.equations) {
    // x' = x' and X1' = X2 say no more than the names do.
    const bool kinematic =
        equation.terms.size() == 1 && equation.terms[0].coefficient.sd == 0 &&
        (equation.terms[0].function == equation.lhs || equation.lhs == "X1'" || equation.lhs == "X3'");
    if (kinematic) continue;
    text += report::to_text(equation, report::names_of(model)) + "\n";
  }
  for (const auto& [name, value] : model.parameters) {
    if (!report::names_term(model, name))
      text += fmt::format("{:18} {}\n", name, show(value, io::parameter_unit(name)));
  }
  if (!model.rotor && !model.equations.empty()) text += "\n" + report::to_text(report::coefficient_table(model)) + "\n";
  return text;
}

/// One identification of the records by the chosen method.
IdentifiedModel identify_records(const IdentifyOptions& o, const std::vector<Recording>& records,
                                 std::vector<identification::BoundOutcome>* bounds = nullptr) {
  const std::string method = o.chosen_method();
  if (method == "weak") return identification::identify_rotor(records, o.weak());
  if (method == "sindy" && !o.library.empty()) {
    return identification::fit_library(records, o.candidate_library(records.front()), o.sindy(records.front()));
  }
  if (method == "sindy") return identification::fit_sindy(records, o.sindy(records.front()), bounds);
  if (records.size() != 1) throw Error("--method " + method + " takes one record");
  if (method == "paper") return identification::identify_paper(records.front(), o.paper());
  if (method == "consistent") return identification::identify_consistent(records.front(), o.consistent());
  return identification::identify_second_order(records.front(), o.output, o.input, o.second_order());
}

void add_evidence(const IdentifyOptions& o, const std::vector<Recording>& records, const IdentifiedModel& model,
                  Evidence& evidence) {
  if (model.summary.status == Status::unusable) return;
  const Recording first = identification::with_derivatives(records.front(), model.inputs);
  evidence.collinear = identification::collinear_groups(model, first);
  if (o.no_holdout) return;
  const auto again = [&](const std::vector<Recording>& train) { return identify_records(o, train); };
  evidence.held_out =
      o.rotor() ? hold_out_rotor(records, o.holdout, again) : hold_out_general(records, o.holdout, again);
}

void warn_of_poor_prediction(const Evidence& evidence, Summary& summary) {
  const identification::HeldOut& h = evidence.held_out;
  double worst = 0;
  for (const identification::StateScore& s : h.horizon > 0 ? h.near : h.scores) worst = std::max(worst, s.nrmse);
  if (worst > 0.5) {
    summary.warn(
        std::isfinite(worst)
            ? fmt::format("a model of the rest does not predict {}: error {:.0f} % of the motion", h.what, 100 * worst)
            : fmt::format("the free run of a model of the rest diverges on {}", h.what));
  }
}

void run_identify(const IdentifyOptions& o, Session& session) {
  o.check();
  RecordOptions reader = o.record;
  reader.required = o.required();
  session.progress("identify", 0);
  IdentifiedModel model;
  Evidence evidence;
  if (o.stream) {
    model = identify_stream(o, session, evidence);
  } else {
    std::vector<Recording> records;
    for (const std::string& file : o.files) records.push_back(reader.read(file));
    if (o.compare) {
      compare_methods(o, records, session);
      return;
    }
    model = identify_records(o, records, &evidence.bounds);
    session.progress("identify", 0.6);
    add_evidence(o, records, model, evidence);
  }
  session.progress("identify", 1);
  warn_of_poor_prediction(evidence, model.summary);
  model.provenance = io::provenance({o.files.begin(), o.files.end()}, session.command_line);
  io::Json document = to_json(model);
  document.set("evidence", to_json(evidence));
  if (!o.out.empty()) io::save_json(o.out, document);
  session.say(describe_model(model));
  if (model.summary.status != Status::unusable) session.say(describe(evidence, model.summary));
  session.result(document);
  session.finish(model.summary);
}

}  // namespace

void add_identify(CLI::App& app, Session& session) {
  auto o = std::make_shared<IdentifyOptions>();
  CLI::App* sub = add_command(
      app, session, "identify", "Equations of motion from records of a rotor or of any system (SINDy)",
      "Rotor: CSV records of a run-up or run-down with t_s (or --rate), x_mm, y_mm (any length unit), beta_rad: "
      "displacement\n"
      "of the disk centre and rotor angle. Several records share the rotor; each has its own unbalance.\n"
      "Any other system: CSV records with one column name_unit per signal; several files are several trajectories.\n"
      "Methods: weak (default): tied second-order weak form with order-tracked test functions, generalised least "
      "squares,\n"
      "then output-error refinement; terms are added on evidence only. paper: Gaussian filter, 4th-order differences "
      "twice,\n"
      "library of eq. 24, LASSO with cross-validation. consistent: same filter on every column, five tied parameters.\n"
      "second-order: y'' = f(y, y', u) of one degree of freedom from channels --output and --input. sindy: any number "
      "of\n"
      "states and inputs, weak form then refinement on free runs, one setting for clean and noisy records; with "
      "--library the\n"
      "terms, ties and known parts of library.toml (written by hand or by whirl derive).\n"
      "Output: equations with 95 % intervals (rotor: k1 1/s^2, k2 1/(m^2 s^2), c 1/s, e m, e_phase rad), chi^2, "
      "condition\n"
      "number, terms that cannot be told apart, free-run error on a part that was held out, and a sentence on what the "
      "model\n"
      "may be trusted for.\n\n"
      "Example: whirl identify rundown.csv --out model.json\n"
      "         whirl identify a.csv b.csv --method sindy --states x,v --inputs u --degree 3\n"
      "         whirl identify a.csv --states x,v --inputs u --sign \"v':v=-\"   (damping takes energy)\n"
      "         whirl identify rundown.csv --library rotor.toml\n"
      "         whirl identify rundown.csv --compare",
      [o, &session] { run_identify(*o, session); });
  o->add_to(sub);
}

}  // namespace whirl::app
