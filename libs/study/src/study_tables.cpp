#include "study_tables.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "whirl/report/format.hpp"
#include "whirl/study/study_report.hpp"

namespace whirl::study {

using report::Align;
using report::format_estimate;
using report::format_fixed;

namespace {

double wrapped(double angle) { return std::remainder(angle, 2 * std::numbers::pi); }

double true_value(const RotorModel& truth, const std::string& name) {
  if (name == "k1") return truth.k1;
  if (name == "k2") return truth.k2;
  if (name == "c") return truth.c;
  if (name == "e") return std::abs(truth.eps);
  return std::arg(truth.eps);
}

struct ParameterRow {
  const char *name, *symbol, *unit;
};
constexpr ParameterRow kParameters[] = {{"k1", "K1/m", "1/s^2"},
                                        {"k2", "K2/m", "1/(m^2 s^2)"},
                                        {"c", "C/m", "1/s"},
                                        {"e", "e", "m"},
                                        {"e_phase", "phase of e", "rad"}};

std::string error_text(const std::string& name, double value, double truth) {
  if (name == "e_phase") return format_fixed(wrapped(value - truth) * 180 / std::numbers::pi, 2) + "°";
  return format_fixed(100 * (value / truth - 1), 3) + " %";
}

report::Table parameters_against(const RotorModel& truth,
                                 const std::vector<std::pair<std::string, const IdentifiedModel*>>& models) {
  report::Table table;
  table.columns = {
      {"method", "", Align::left}, {"parameter", "", Align::left}, {"found ± sd", ""}, {"truth", ""}, {"error", ""},
      {"95 % interval covers", ""}};
  for (const auto& [label, model] : models) {
    for (const ParameterRow& row : kParameters) {
      const Estimate* found = model->parameter(row.name);
      const double truth_value = true_value(truth, row.name);
      if (found == nullptr) {
        table.add({label, row.symbol, "not found", format_estimate({truth_value}, row.unit), "–", "–"});
        continue;
      }
      const bool has_interval = std::isfinite(found->low) && std::isfinite(found->high);
      table.add({label, row.symbol, format_estimate(*found, row.unit), format_estimate({truth_value}, row.unit),
                 error_text(row.name, found->value, truth_value),
                 !has_interval                ? "–"
                 : found->covers(truth_value) ? "yes"
                                              : "no"});
    }
  }
  return table;
}

}  // namespace

report::Table accuracy_table(const Study& study) {
  report::Table table = parameters_against(study.ideal_truth, {{"weak (default)", &study.models.at("weak_ideal")},
                                                               {"consistent", &study.models.at("consistent_ideal")},
                                                               {"paper", &study.models.at("paper_ideal")}});
  table.caption = "Ideal isotropic rotor, run-down at 20 dB: parameters found and their errors";
  table.notes = {
      "Intervals of the paper's chain are those of independent rows; they do not contain the bias of its filter."};
  return table;
}

report::Table rig_parameter_table(const Study& study) {
  const RotorModel balanced = [&] {
    rig::RigParameters rig = study.options.rig;
    rig.rotor.added_mass = 0;
    return rig.true_model();
  }();
  rig::RigParameters loaded = study.options.rig;
  loaded.rotor.added_mass = 5e-3;
  report::Table table = parameters_against(loaded.true_model(), {{"weak, 5 g", &study.models.at("weak_5g")},
                                                                 {"weak, 5 g, 20 dB", &study.models.at("weak_5g_20db")},
                                                                 {"paper, 5 g", &study.models.at("paper_5g")}});
  for (auto& row : parameters_against(balanced, {{"weak, balanced", &study.models.at("weak_balanced")}}).rows) {
    table.rows.push_back(row);
  }
  table.caption = "Simulated rig: parameters found beside its truth (mean of both axes)";
  table.notes = {
      "The rig is anisotropic, has further modes, runout and sensor delay: its truth has no exact image in five "
      "numbers. Only this report reads it."};
  return table;
}

report::Table validation_table(const Study& study) {
  struct PaperValue {
    const char *figure, *x, *y;
  };
  // Text of section V (figures 7, 8) and Table 2; the paper prints no unit, mm by context.
  constexpr PaperValue kPaper[] = {{"7", "0.081", "0.076"},
                                   {"8, 9a, 10a, 11", "0.045 to 0.078", "0.042 to 0.069"},
                                   {"9b, 10b", "0.128", "0.111"},
                                   {"12", "0.055", "0.076"},
                                   {"13", "0.073", "0.082"}};
  report::Table table;
  table.caption = "Free-run error of the identified models, rms (the paper's Table 2 beside)";
  table.columns = {{"paper's figure", "", Align::left},
                   {"record", "", Align::left},
                   {"method", "", Align::left},
                   {"trained on", "", Align::left},
                   {"kind", "", Align::left},
                   {"x, measured", "mm"},
                   {"y, measured", "mm"},
                   {"x, clean", "mm"},
                   {"y, clean", "mm"},
                   {"paper x", "mm"},
                   {"paper y", "mm"}};
  const auto mm = [](double v) { return std::isfinite(v) ? format_fixed(1e3 * v, 4) : std::string("diverges"); };
  for (const StudyValidation& v : study.validations) {
    std::string px = "–", py = "–";
    for (const PaperValue& p : kPaper) {
      if (v.figure == p.figure) px = p.x, py = p.y;
    }
    std::string kind = v.held_out ? "held-out" : "train";
    if (v.validation.unbalance == identification::UnbalanceSource::refitted) kind += ", unbalance refitted";
    if (v.validation.fold_sensitive) kind += ", fold-sensitive";
    table.add({v.figure, v.record, v.method, v.trained_on, kind, mm(v.validation.rmse_x), mm(v.validation.rmse_y),
               mm(v.validation.clean_rmse_x), mm(v.validation.clean_rmse_y), px, py});
  }
  table.notes = {
      "measured: against the noisy sensor; clean: against the noise-free motion of the disk, which on the rig differs "
      "from the sensor by its runout too. The paper's RMSE is against measured signals and printed without unit.",
      "20 dB: white noise per axis with sd = rms of the clean signal of that axis / 10."};
  return table;
}

report::Table balanced_table(const Study& study) {
  report::Table table;
  table.caption = "Balanced rotor (Fig. 18) and 5 g: all laws, the same tuning budget";
  table.columns = {
      {"run", "", Align::left}, {"open loop, peak", "mm"}, {"closed loop, peak", "mm"}, {"suppression", "%"},
      {"paper", "%"},           {"force in x, rms", "N"},  {"force in x, peak", "N"},   {"total variation", "N/s"},
      {"standstill, rms", "µm"}};
  for (const StudyRun& r : study.runs) {
    if (r.name.starts_with("simulated")) continue;
    const tuning::ClosedLoopMetrics& m = r.run.metrics;
    std::string paper = "–";
    if (r.name == "balanced_pd") paper = "55.1";
    if (r.name == "balanced_tsmc") paper = "82.9";
    if (r.name == "5g_tsmc") paper = "92.7";
    const ControllerDesign& d = study.designs.at(r.law);
    table.add({fmt::format("{}, {}", r.name.starts_with("5g") ? "5 g" : "balanced", design_label(d)),
               format_fixed(1e3 * m.open.all, 3), format_fixed(1e3 * m.closed.all, 4),
               format_fixed(100 * m.suppression.all, 1), paper, format_fixed(m.force_rms, 2),
               format_fixed(m.force_peak, 1), format_fixed(m.total_variation, 0),
               format_fixed(1e6 * m.standstill_rms, 1)});
  }
  table.notes = {
      "Peaks zero-to-peak of the true disk centre, x axis, whole run without the first 0.5 s. The paper's PD was tuned "
      "by hand; here every law is tuned with the same budget."};
  return table;
}

std::string feedforward_statement(const Study& study) {
  const auto peak = [&](const char* name) { return study.run(name).run.metrics.closed.all; };
  const double pd = peak("5g_pd"), pd_with = peak("5g_pd_feedforward");
  const double tsmc = peak("5g_tsmc"), tsmc_without = peak("5g_tsmc_no_feedforward");
  return fmt::format(
      "Each was tuned again with the other's use of the unbalance feedforward. Whole-run peaks at 5 g: PD {} mm, with "
      "feedforward "
      "{} mm; TSMC {} mm, without feedforward {} mm. The feedforward lowers the peak of PD by a factor of {} and that "
      "of TSMC by "
      "{}; the sliding mode lowers it against PD by {} with feedforward and by {} without.",
      format_fixed(1e3 * pd, 3), format_fixed(1e3 * pd_with, 3), format_fixed(1e3 * tsmc, 3),
      format_fixed(1e3 * tsmc_without, 3), format_fixed(pd / pd_with, 1), format_fixed(tsmc_without / tsmc, 1),
      format_fixed(pd_with / tsmc, 1), format_fixed(pd / tsmc_without, 1));
}

std::string design_label(const ControllerDesign& design) {
  return fmt::format("{} with {}{}", design.law, design.estimator, design.feedforward ? "" : ", no feedforward");
}

report::Table design_table(const Study& study) {
  report::Table table;
  table.caption = "Designs, all tuned on the identified model with the same budget";
  table.columns = {{"law and estimator", "", Align::left},
                   {"objective", ""},
                   {"unknown delay survived", "ms"},
                   {"gain margin", ""},
                   {"disturbance bound", "m/s²"},
                   {"κ of eq. 42", "m/s²"},
                   {"reaching", "s"},
                   {"sliding", "s"},
                   {"certified", ""}};
  for (const auto& [name, d] : study.designs) {
    const auto margin = [&](const char* key, double scale, int digits) {
      const auto it = d.margins.find(key);
      return it == d.margins.end() ? std::string("–") : format_fixed(scale * it->second, digits);
    };
    const auto certified = d.margins.find("certified");
    table.add({design_label(d), margin("objective", 1, 4), margin("delay_margin_s", 1e3, 1),
               margin("gain_margin", 1, 2), margin("disturbance_bound", 1, 2), margin("kappa", 1, 2),
               margin("reach_time_s", 1, 3), margin("slide_time_s", 1, 3),
               certified != d.margins.end() && certified->second > 0 ? "yes" : "no"});
  }
  table.notes = {
      "Objective: mean over the tuning scenarios of closed over open peak, with total variation and instability "
      "penalties. "
      "κ < 0: the switching gain is smaller than the disturbance bound, eq. 42 is not met."};
  return table;
}

report::Table mode_table(const Study& study) {
  report::Table table;
  table.caption = "Natural frequencies from the hammer test beside those of the rig at rest";
  table.columns = {{"mode", ""}, {"frequency ± sd", ""}, {"damping ± sd", "%"}, {"rig", "Hz"}};
  std::vector<double> truth;
  const double split = study.options.rig.rotor.stiffness_split;
  for (const double s : {1 - split, 1 + split}) {
    truth.push_back(study.options.rig.natural_frequency() * std::sqrt(s) / (2 * std::numbers::pi));
  }
  for (const rig::RigMode& mode : study.options.rig.modes) truth.push_back(mode.frequency);
  for (std::size_t i = 0; i < study.modes.modes.size(); ++i) {
    const Mode& mode = study.modes.modes[i];
    double nearest = truth.front();
    for (const double f : truth) {
      if (std::abs(f - mode.frequency.value) < std::abs(nearest - mode.frequency.value)) nearest = f;
    }
    table.add({fmt::format("{}", i + 1), format_estimate(mode.frequency, "Hz"),
               format_estimate({100 * mode.damping.value, 100 * mode.damping.sd}),
               std::abs(nearest - mode.frequency.value) < 0.05 * nearest ? format_fixed(nearest, 2) : "–"});
  }
  table.notes = {
      "A line at three times the main mode is the third harmonic that the cubic stiffness makes in hard impacts, not a "
      "mode of the rig (–)."};
  return table;
}

}  // namespace whirl::study
