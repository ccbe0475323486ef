#include "whirl/study/study.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/paper.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/temporary.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/modal/stiffness.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/rig/rig_file.hpp"

namespace whirl::study {
namespace {

// The study step by step; each writes its files and reports its progress. The files get their names in the user's
// folder when all steps are done: a study that is interrupted leaves what was there before.
class StudyRunner {
 public:
  explicit StudyRunner(const StudyOptions& options) { study_.options = options; }

  Study run() {
    io::write_text(folder() / "rig.toml", rig::rig_toml(options().rig));
    stiffness_test();
    hammer_test();
    record_runs();
    identify();
    validate_models();
    design_controllers();
    close_loops();
    publish();
    step("done", 1);
    return std::move(study_);
  }

 private:
  const StudyOptions& options() const { return study_.options; }
  const std::filesystem::path& folder() const { return kept_.path(); }
  /// Not while an OutputGroup lives: the steps read again what they wrote.
  void publish() const {
    io::make_folder(options().folder);
    io::OutputGroup together;
    for (const auto& file : std::filesystem::directory_iterator(folder())) {
      io::ByteSource from(file.path());
      io::ByteSink to(options().folder / file.path().filename());
      std::string part(std::size_t{1} << 16, '\0');
      for (std::size_t n; (n = from.read(part.data(), part.size())) > 0;) to.write({part.data(), n});
      to.close();
    }
    together.commit();
  }
  void step(const std::string& what, double fraction) const {
    if (options().progress) options().progress(what, fraction);
  }
  Provenance stamp(const std::vector<std::string>& inputs) const {
    Provenance p;
    p.version = version();
    for (const std::string& name : inputs) p.inputs.push_back(io::input_record(folder() / name));
    p.options = options().command_line;
    p.seed = options().seed;
    return p;
  }

  void stiffness_test() {
    step("stiffness test", 0);
    rig::StiffnessTestOptions test;
    test.seed = options().seed;
    study_.stiffness_table = rig::simulate_stiffness_test(options().rig, test);
    io::Table table;
    table.columns = {{"deflection", Quantity::displacement, study_.stiffness_table.deflection},
                     {"force", Quantity::force, study_.stiffness_table.force}};
    io::CsvWriteOptions csv;
    csv.units = {"deflection_mm"};
    io::write_csv(folder() / "stiffness.csv", table, csv);
    study_.stiffness = modal::fit_stiffness(study_.stiffness_table.deflection, study_.stiffness_table.force);
    study_.stiffness.provenance = stamp({"stiffness.csv"});
    io::save(folder() / "stiffness.json", study_.stiffness);
  }

  void hammer_test() {
    step("hammer test", 0.02);
    rig::HammerTestOptions test;
    test.seed = options().seed;
    const std::vector<Recording> blows = rig::simulate_hammer_test(options().rig, test);
    std::vector<std::string> names;
    for (std::size_t i = 0; i < blows.size(); ++i) {
      names.push_back(fmt::format("blow_{}.csv", i + 1));
      io::write_csv(folder() / names.back(), blows[i]);
    }
    study_.frf = modal::estimate_frf(blows);
    study_.frf.provenance = stamp(names);
    study_.modes = modal::fit_modes(study_.frf);
    study_.modes.provenance = stamp(names);
    io::save(folder() / "frf.json", study_.frf);
    io::save(folder() / "modes.json", study_.modes);
  }

  void record_runs() {
    step("run-up and run-down records", 0.06);
    std::uint64_t seed = 1000 * options().seed;
    for (const auto& [label, mass] : {std::pair{"balanced", 0.0}, std::pair{"2.5g", 2.5e-3}, std::pair{"5g", 5e-3}}) {
      for (const bool run_up : {false, true}) {
        for (const bool noisy : {false, true}) {
          StudyRecord r;
          r.name = fmt::format("{}_{}{}", run_up ? "runup" : "rundown", label, noisy ? "_20db" : "");
          r.added_mass = mass;
          r.run_up = run_up;
          r.noisy = noisy;
          rig::RigParameters rig = options().rig;
          rig.rotor.added_mass = mass;
          rig::RigRun run;
          run.seed = ++seed;
          r.record = rig::record_open_loop(run_up ? rig.run_up() : rig, run,
                                           noisy ? std::optional<double>(options().snr_db) : std::nullopt);
          r.record.measured.source = r.name + ".csv";
          io::CsvWriteOptions csv;
          csv.units = {"x_mm", "y_mm"};
          io::write_csv(folder() / (r.name + ".csv"), r.record.measured, csv);
          study_.records.push_back(std::move(r));
        }
      }
    }
  }

  void keep_model(const std::string& name, IdentifiedModel model, const std::string& input) {
    model.provenance = stamp({input});
    io::save(folder() / ("model_" + name + ".json"), model);
    study_.models.emplace(name, std::move(model));
  }

  void identify() {
    int done = 0;
    for (const char* name :
         {"rundown_balanced", "rundown_2.5g", "rundown_5g", "rundown_balanced_20db", "rundown_5g_20db"}) {
      step(fmt::format("identify {}", name), 0.1 + 0.03 * done++);
      const Recording& record = study_.record(name).record.measured;
      const std::string label = std::string(name).substr(8);
      keep_model("weak_" + label, identification::identify_rotor(record), record.source);
      keep_model("paper_" + label, identification::identify_paper(record), record.source);
    }
    // Accuracy where the truth has the model's form: an isotropic rotor, white noise, nothing else.
    step("identify the ideal rotor", 0.26);
    rig::RigParameters ideal = rig::RigParameters::ideal_rotor_a();
    ideal.rotor.added_mass = 0;
    study_.ideal_truth = ideal.true_model();
    rig::RigRun run;
    run.seed = 7 + options().seed;
    StudyRecord r;
    r.name = "ideal_rundown_20db";
    r.noisy = true;
    r.record = rig::record_open_loop(ideal, run, options().snr_db);
    r.record.measured.source = r.name + ".csv";
    io::write_csv(folder() / (r.name + ".csv"), r.record.measured);
    keep_model("weak_ideal", identification::identify_rotor(r.record.measured), r.record.measured.source);
    keep_model("paper_ideal", identification::identify_paper(r.record.measured), r.record.measured.source);
    keep_model("consistent_ideal", identification::identify_consistent(r.record.measured), r.record.measured.source);
    study_.records.push_back(std::move(r));
    StudyRecord held_out;
    held_out.name = "ideal_runup";
    held_out.run_up = true;
    ++run.seed;
    held_out.record = rig::record_open_loop(ideal.run_up(), run, options().snr_db);
    held_out.record.measured.source = held_out.name;
    study_.records.push_back(std::move(held_out));
  }

  void validate_one(const std::string& figure, const std::string& record, const std::string& method,
                    const std::string& trained_on,
                    identification::UnbalanceSource unbalance = identification::UnbalanceSource::identified) {
    const StudyRecord& r = study_.record(record);
    identification::ValidateOptions validate_options;
    validate_options.unbalance = unbalance;
    validate_options.clean = r.record.truth;
    StudyValidation row{figure, record, method, trained_on, record.find(trained_on) == std::string::npos || r.run_up,
                        {}};
    const std::string key = method + "_" + (trained_on.starts_with("ideal") ? "ideal" : trained_on.substr(8));
    row.validation = identification::validate_model(study_.models.at(key), r.record.measured, validate_options);
    if (record == trained_on) row.held_out = false;
    study_.validations.push_back(std::move(row));
  }

  void validate_models() {
    step("validation", 0.3);
    for (const std::string method : {"weak", "paper"}) {
      validate_one("7", "runup_balanced", method, "rundown_balanced");
      validate_one("8, 9a, 10a, 11", "rundown_balanced", method, "rundown_balanced");
      validate_one("9b, 10b", "rundown_balanced_20db", method, "rundown_balanced_20db");
      validate_one("12", "rundown_2.5g", method, "rundown_2.5g");
      validate_one("13", "rundown_5g", method, "rundown_5g");
      validate_one("-", "runup_5g", method, "rundown_5g");
      validate_one("-", "ideal_runup", method, "ideal_rundown_20db");
    }
    validate_one("8", "rundown_balanced", "weak", "rundown_5g", identification::UnbalanceSource::refitted);
    validate_one("12", "rundown_2.5g", "weak", "rundown_5g", identification::UnbalanceSource::refitted);
    io::Json::Array rows;
    for (const StudyValidation& v : study_.validations) {
      rows.push_back(to_json(v.validation, v.record + ".csv").set("method", v.method).set("trained_on", v.trained_on));
    }
    io::save_json(folder() / "validation.json", io::start_document("whirl.validation", 1).set("runs", std::move(rows)));
  }

  // Everything below uses the identified models and the data sheets; the rig's parameters appear in `close_loops` only.
  void design_controllers() {
    struct Entry {
      const char *name, *law, *estimator;
      bool feedforward;
    };
    // The paper's two; each with the other's use of feedforward, to tell the law from the feedforward; the best known.
    const Entry entries[] = {{"tsmc", "tsmc", "lpf", true},
                             {"tsmc_no_feedforward", "tsmc", "lpf", false},
                             {"pd", "pd", "lpf", false},
                             {"pd_feedforward", "pd", "lpf", true},
                             {"best", "lsmc", "kfe", true}};
    int done = 0;
    for (const Entry& entry : entries) {
      tuning::DesignOptions d;
      d.law = entry.law;
      d.estimator = entry.estimator;
      d.feedforward = entry.feedforward;
      d.hardware = tuning::data_sheet(options().rig);
      const IdentifiedModel& model = study_.models.at("weak_5g");
      d.hardware.modes = tuning::structure_modes(study_.modes, model.rotor->natural_frequency());
      // Mass from two tests: K1 of the stiffness test over K1/m of the run-down.
      d.gain = model.rotor->k1 / study_.stiffness.k1.value;
      d.evaluations = options().evaluations;
      d.seed = 40 + options().seed;
      const double share = 0.6 / std::size(entries), start = 0.32 + share * done++;
      d.progress.tuning = [&](const tuning::DesignProgress& p) {
        if (p.evaluation % 10 == 0) {
          step(fmt::format("design {} (best objective {:.4f})", entry.name, p.best),
               start + share * std::min(1.0, static_cast<double>(p.evaluation) / static_cast<double>(p.budget)));
        }
      };
      ControllerDesign result = tuning::design(model, d);
      result.provenance = stamp({"model_weak_5g.json", "stiffness.json", "modes.json"});
      io::save(folder() / fmt::format("controller_{}.json", entry.name), result);
      study_.designs.emplace(entry.name, std::move(result));
    }
  }

  void close_loop(const std::string& name, const std::string& law, ControllerDesign d, const rig::RigParameters& rig) {
    tuning::ClosedLoopOptions loop;
    loop.run.seed = 500 + options().seed;
    StudyRun run{name, law, tuning::run_closed_loop(d, rig, loop)};
    run.run.log.source = name;
    io::save_json(folder() / fmt::format("run_{}.json", name), pages::to_json(run.run.metrics));
    io::write_csv(folder() / fmt::format("run_{}.csv", name), run.run.log);
    study_.runs.push_back(std::move(run));
  }

  void close_loops() {
    step("closed loop", 0.93);
    rig::RigParameters rig = options().rig;
    rig.rotor.added_mass = 5e-3;
    for (const auto& [name, d] : study_.designs) close_loop("5g_" + name, name, d, rig);
    rig.rotor.added_mass = 0;
    for (auto [name, d] : study_.designs) {
      d.model.eps = study_.models.at("weak_balanced").rotor->eps;  // the balanced rotor's own identification
      close_loop("balanced_" + name, name, d, rig);
    }
    // Fig. 17: the closed loop as simulated on the identified model, against the measured open loop.
    const IdentifiedModel& model = study_.models.at("weak_5g");
    RotorModel rotor = *model.rotor;
    rotor.gain = study_.designs.at("tsmc").model.gain;
    close_loop("simulated_tsmc", "tsmc", study_.designs.at("tsmc"),
               tuning::tuning_plant(rotor, tuning::data_sheet(options().rig)));
  }

  io::TemporaryFolder kept_{"study"};
  Study study_;
};

}  // namespace

const StudyRecord& Study::record(const std::string& name) const {
  const auto it = std::find_if(records.begin(), records.end(), [&](const StudyRecord& r) { return r.name == name; });
  if (it == records.end()) throw Error("no record named " + name);
  return *it;
}

const StudyRun& Study::run(const std::string& name) const {
  const auto it = std::find_if(runs.begin(), runs.end(), [&](const StudyRun& r) { return r.name == name; });
  if (it == runs.end()) throw Error("no run named " + name);
  return *it;
}

Study run_study(const StudyOptions& options) { return StudyRunner(options).run(); }

}  // namespace whirl::study
