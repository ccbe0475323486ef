#include "command.hpp"
#include "print.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/pipeline/provenance.hpp"
#include "whirl/pipeline/validate_model.hpp"
#include "whirl/report/equation.hpp"
#include "whirl/report/table.hpp"
#include "whirl/sindy/identify_rotor.hpp"
#include "whirl/sindy/paper.hpp"
#include "whirl/sindy/second_order.hpp"

namespace whirl::app {
namespace {

struct RecordOptions {
  std::vector<std::string> columns;
  double rate = 0;
  std::string rows;
  std::vector<std::string> required;

  CsvOptions csv() const {
    CsvOptions options;
    options.columns = columns;
    options.required = required;
    if (rate > 0) options.rate = rate;
    return options;
  }

  // Reads the record and keeps the rows A:B (0-based, B excluded) when asked.
  Recording read(const std::string& file) const {
    Recording record = read_csv(file, csv());
    if (rows.empty()) return record;
    long first = 0, last = 0;
    int used = 0;
    if (std::sscanf(rows.c_str(), "%ld:%ld%n", &first, &last, &used) != 2 || used != static_cast<int>(rows.size()) ||
        first < 0 || last <= first || last > record.size()) {
      throw Error::in_field("--rows", rows, fmt::format("FIRST:END with 0 <= FIRST < END <= {}", record.size()));
    }
    for (Channel& channel : record.channels) {
      channel.samples = Eigen::VectorXd(channel.samples.segment(first, last - first));
    }
    record.t0 += record.dt * static_cast<double>(first);
    return record;
  }

  void add_to(CLI::App* sub) {
    sub->add_option("--columns", columns, "columns to read, HEADER or HEADER:name_unit, e.g. V1:u_V");
    sub->add_option("--rate", rate, "sample rate in Hz, for files without a time column");
    sub->add_option("--rows", rows, "use rows FIRST:END of the record only (from 0, END not included)");
  }
};

std::string describe_model(const IdentifiedModel& model) {
  std::string text = fmt::format("method: {}\n", model.method);
  for (const Equation& equation : model.equations) {
    text += report::to_text(equation, report::names_of(model)) + "\n";
  }
  for (const auto& [name, value] : model.parameters) {
    text += fmt::format("{:18} {}\n", name, show(value, parameter_unit(name)));
  }
  if (std::isfinite(model.summary.chi_square)) {
    text += fmt::format("chi^2 = {:.3g} (1: the model explains the record down to its noise)", model.summary.chi_square);
  }
  return text;
}

}  // namespace

void add_identify(CLI::App& app, Session& session) {
  struct Options {
    std::vector<std::string> files;
    std::string out, method = "weak", modes, angle = "measured", output = "y", input = "u";
    double filter_ms = 0;
    RecordOptions record;
  };
  auto o = std::make_shared<Options>();
  CLI::App* sub = add_command(
      app, session, "identify", "Equations of motion from run-up or run-down records (SINDy)",
      "Input: CSV records with t_s (or --rate), x_mm, y_mm (any length unit), beta_rad: displacement of the disk centre\n"
      "and rotor angle. Several records share the rotor; each has its own unbalance.\n"
      "Methods: weak (default): tied second-order weak form with order-tracked test functions, generalised least squares,\n"
      "then output-error refinement; terms are added on evidence only. paper: Gaussian filter, 4th-order differences twice,\n"
      "library of eq. 24, LASSO with cross-validation. consistent: same filter on every column, five tied parameters.\n"
      "second-order: y'' = f(y, y', u) of one degree of freedom from channels --output and --input.\n"
      "Output: equations, parameters per unit mass with 95 % intervals (k1 1/s^2, k2 1/(m^2 s^2), c 1/s, e m, e_phase rad),\n"
      "chi^2 and a sentence on what the model may be trusted for.\n\n"
      "Example: whirl identify rundown.csv --out model.json",
      [o, &session] {
        o->record.required = o->method == "second-order" ? std::vector{o->output, o->input}
                                                         : std::vector<std::string>{"x", "y", "beta"};
        std::vector<Recording> records;
        for (const std::string& file : o->files) records.push_back(o->record.read(file));
        IdentifiedModel model;
        session.progress("identify", 0);
        if (o->method == "weak") {
          RotorIdentifyOptions options;
          if (o->angle == "profile") options.angle_source = AngleSource::profile;
          if (!o->modes.empty()) options.modal = load<ModalModel>(o->modes);
          model = identify_rotor(records, options);
        } else {
          if (records.size() != 1) throw Error("--method " + o->method + " takes one record");
          if (o->method == "paper") {
            PaperOptions options;
            if (o->filter_ms > 0) options.filter_sd = o->filter_ms * 1e-3;
            if (!o->modes.empty()) {
              const ModalModel modes = load<ModalModel>(o->modes);
              for (const Mode& mode : modes.modes) options.poles.push_back(mode.pole);
            }
            model = identify_paper(records.front(), options);
          } else if (o->method == "consistent") {
            ConsistentOptions options;
            if (o->filter_ms > 0) options.filter_sd = o->filter_ms * 1e-3;
            model = identify_consistent(records.front(), options);
          } else {
            model = identify_second_order(records.front(), o->output, o->input);
          }
        }
        session.progress("identify", 1);
        model.provenance = provenance({o->files.begin(), o->files.end()}, session.command_line);
        if (!o->out.empty()) save(o->out, model);
        session.say(describe_model(model));
        session.result(to_json(model));
        session.finish(model.summary);
      });
  sub->add_option("RECORDS", o->files, "records (CSV)")->required();
  sub->add_option("--out", o->out, "write the model as JSON");
  sub->add_option("--method", o->method, "weak, paper, consistent or second-order")
      ->check(CLI::IsMember({"weak", "paper", "consistent", "second-order"}));
  sub->add_option("--modes", o->modes, "modes of the hammer test (modes.json): candidates beside the main mode");
  sub->add_option("--angle", o->angle, "measured, or profile: the rate of an assumed profile is refined too")
      ->check(CLI::IsMember({"measured", "profile"}));
  sub->add_option("--filter-ms", o->filter_ms, "Gaussian filter of paper and consistent, standard deviation");
  sub->add_option("--output", o->output, "second-order: displacement channel");
  sub->add_option("--input", o->input, "second-order: input channel");
  o->record.add_to(sub);
}

void add_validate(CLI::App& app, Session& session) {
  struct Options {
    std::string model, out;
    std::vector<std::string> files, clean;
    std::string unbalance = "identified";
    double added_um = 0, added_deg = 0;
    RecordOptions record;
  };
  auto o = std::make_shared<Options>();
  CLI::App* sub = add_command(
      app, session, "validate", "Free-run prediction of records that were not used for the fit",
      "Input: model.json and CSV records as for identify; --clean: the noise-free record of each, where known.\n"
      "--unbalance identified: the same rotor state; refitted: the unbalance is fitted to each run, the rest is predicted;\n"
      "added: identified plus the known eccentricity --added-um at --added-deg.\n"
      "Output: rmse_x, rmse_y in metres rms against measured and, where known, clean; nrmse; fold sensitivity.\n\n"
      "Example: whirl validate model.json runup.csv --out validation.json",
      [o, &session] {
        const IdentifiedModel model = load<IdentifiedModel>(o->model);
        if (!o->clean.empty() && o->clean.size() != o->files.size()) {
          throw Error(fmt::format("--clean names {} files for {} records: must be one each", o->clean.size(),
                                  o->files.size()));
        }
        Json::Array runs;
        Summary all;
        const bool one_dof = !model.rotor && model.inputs.size() == 1 && model.states.size() == 2;
        report::Table table;
        table.caption = "Free-run error, rms";
        table.columns = {{"record", "", report::Align::left}};
        if (one_dof) {
          table.columns.push_back({model.states[0], "SI"});
        } else {
          for (const char* name : {"x", "y", "x clean", "y clean"}) table.columns.push_back({name, "mm"});
        }
        table.columns.push_back({"nrmse", "%"});
        table.columns.push_back({"note", "", report::Align::left});
        for (std::size_t i = 0; i < o->files.size(); ++i) {
          const Recording record = o->record.read(o->files[i]);
          Validation v;
          if (one_dof) {
            v.rmse_x = v.rmse_y = free_run_error(model, record, model.states[0]);
            const Eigen::VectorXd& y = record[model.states[0]];
            v.nrmse = v.rmse_x / std::sqrt((y.array() - y.mean()).square().mean());
            if (!std::isfinite(v.rmse_x)) v.summary.fail("the free run of the model diverges");
          } else {
            ValidateOptions options;
            options.unbalance = o->unbalance == "refitted" ? UnbalanceSource::refitted
                                : o->unbalance == "added"  ? UnbalanceSource::added
                                                           : UnbalanceSource::identified;
            options.added = std::polar(o->added_um * 1e-6, o->added_deg * 3.14159265358979323846 / 180);
            if (!o->clean.empty()) options.clean = o->record.read(o->clean[i]);
            v = validate_model(model, record, options);
          }
          const auto cell = [](double m) { return std::isfinite(m) ? fmt::format("{:.4f}", 1e3 * m) : "-"; };
          std::vector<std::string> row{o->files[i]};
          if (one_dof) {
            row.push_back(fmt::format("{:.4g}", v.rmse_x));
          } else {
            for (const double m : {v.rmse_x, v.rmse_y, v.clean_rmse_x, v.clean_rmse_y}) row.push_back(cell(m));
          }
          row.push_back(fmt::format("{:.2f}", 100 * v.nrmse));
          row.push_back(v.fold_sensitive ? "fold-sensitive" : std::string(to_string(v.summary.status)));
          table.add(std::move(row));
          for (const std::string& w : v.summary.warnings) all.warn(w);
          if (v.summary.status == Status::unusable) all.status = Status::unusable;
          runs.push_back(to_json(v, o->files[i]));
        }
        Json document = start_document("whirl.validation", 1);
        document.set("runs", std::move(runs));
        std::vector<std::filesystem::path> inputs{o->model};
        inputs.insert(inputs.end(), o->files.begin(), o->files.end());
        document.set("summary", to_json(all));
        document.set("provenance", to_json(provenance(inputs, session.command_line)));
        if (!o->out.empty()) save_json(o->out, document);
        session.say(report::to_text(table));
        session.result(document);
        session.finish(all);
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
