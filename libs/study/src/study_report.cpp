#include "whirl/study/study_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "study_tables.hpp"
#include "whirl/modal/residues.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/pages/run_report_tables.hpp"
#include "whirl/pages/text/sliding.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/signal/spectrum.hpp"
#include "whirl/tuning/sliding.hpp"

namespace whirl::study {
namespace {

using report::Callout;
using report::Document;
using report::format_fixed;
using report::NamedRun;

// Channels of a run log under the names that the figures know.
Recording selected(const Recording& log, const std::vector<std::pair<std::string, std::string>>& channels) {
  Recording r;
  r.t0 = log.t0;
  r.dt = log.dt;
  r.source = log.source;
  for (const auto& [from, to] : channels) r.add(to, log.at(from).quantity, log[from]);
  return r;
}
Recording open_loop(const Recording& log) {
  return selected(log, {{"x_open", "x"}, {"y_open", "y"}, {"beta", "beta"}});
}
Recording closed_loop(const Recording& log) {
  return selected(log, {{"x_true", "x"}, {"y_true", "y"}, {"ux", "ux"}, {"uy", "uy"}, {"beta", "beta"}});
}

Eigen::VectorXcd reconstruction(const FrequencyResponse& frf, const ModalModel& modes, Eigen::Index channel) {
  // The exponential window adds its decay to s (FRF and modes agree only with it).
  Eigen::VectorXcd h = modal::synthesise(modes, channel, frf.frequency, modes.kind, frf.window_decay);
  for (Eigen::Index i = 0; i < h.size(); ++i) {
    if (frf.frequency[i] < modes.band_low || frf.frequency[i] > modes.band_high) h[i] = {NAN, NAN};
  }
  return h;
}

class Report {
 public:
  explicit Report(const Study& study) : s_(study) {}

  Document build() {
    doc_.title = "Identification and control of a rotor through its critical speed";
    doc_.subtitle = "The study of Piramoon, Ayoubi and Bashash (IEEE Access 2024) on a simulated rig";
    doc_.paragraph(
        "Every number below was computed by the run that wrote this page. The machine is simulated: the paper does not "
        "publish its parameters or records, so its method and percentages can be reproduced, not its curves. "
        "Identification and control see what a laboratory sees: records and data sheets. The rig's true parameters "
        "are read by this report only.");
    agreement();
    tests();
    identification();
    validation();
    control();
    doc_.section("Provenance");
    Provenance p;
    p.version = version();
    p.options = s_.options.command_line;
    p.seed = s_.options.seed;
    doc_.provenance(p);
    return std::move(doc_);
  }

 private:
  // What agrees with the paper, decided by the numbers of this run.
  void agreement() {
    doc_.section("What agrees with the paper, and what does not");
    const tuning::ClosedLoopMetrics& tsmc = s_.run("5g_tsmc").run.metrics;
    constexpr double paper[5] = {0.61, 0.91, 0.96, 0.818, 0.927};
    bool all = true;
    std::string found;
    for (std::size_t i = 0; i < 5; ++i) {
      const double value = i < 4 ? tsmc.suppression.segment[i] : tsmc.suppression.all;
      all = all && value >= paper[i];
      found += fmt::format("{}{} %", i ? ", " : "", format_fixed(100 * value, 1));
    }
    doc_.callout(
        all ? Callout::Kind::agrees : Callout::Kind::disagrees,
        "Suppression of Table 4 by the terminal sliding mode controller",
        fmt::format("Found {} in segments 1 to 4 and over the whole run; the paper has 61, 91, 96, 81.8 and 92.7 %.",
                    found));
    const double open = s_.run("balanced_tsmc").run.metrics.open.all, open5 = tsmc.open.all;
    const bool levels = std::abs(open / 1.242e-3 - 1) < 0.1 && std::abs(open5 / 6.45e-3 - 1) < 0.1;
    doc_.callout(
        levels ? Callout::Kind::agrees : Callout::Kind::disagrees, "Open-loop levels",
        fmt::format("{} mm balanced and {} mm with 5 g, zero-to-peak; the paper has 1.242 and 6.45 mm. The rig was "
                    "calibrated to them, so this is no evidence.",
                    format_fixed(1e3 * open, 3), format_fixed(1e3 * open5, 3)));
    const double pd = s_.run("balanced_pd").run.metrics.suppression.all;
    const double st = s_.run("balanced_tsmc").run.metrics.suppression.all;
    doc_.callout(
        std::abs(pd - 0.551) < 0.05 ? Callout::Kind::agrees : Callout::Kind::disagrees, "PD against TSMC (Fig. 18)",
        fmt::format(
            "With the same tuning budget PD suppresses the balanced rotor by {} % and TSMC by {} %; the paper has "
            "55.1 and 82.9 % with a PD tuned by hand. {}",
            format_fixed(100 * pd, 1), format_fixed(100 * st, 1), feedforward_statement(s_)));
    const auto worst = [&](const char* key) {
      double error = 0;
      for (const char* name : {"k1", "c", "e"}) {
        const Estimate* p = s_.models.at(key).parameter(name);
        const double truth = std::string(name) == "k1"  ? s_.ideal_truth.k1
                             : std::string(name) == "c" ? s_.ideal_truth.c
                                                        : std::abs(s_.ideal_truth.eps);
        if (p == nullptr) return std::numeric_limits<double>::infinity();
        error = std::max(error, std::abs(p->value / truth - 1));
      }
      return error;
    };
    const double paper_error = worst("paper_ideal"), weak_error = worst("weak_ideal");
    doc_.callout(
        paper_error > 0.05 ? Callout::Kind::disagrees : Callout::Kind::agrees,
        "A small simulation error does not show that the coefficients are right",
        fmt::format("On the ideal rotor at 20 dB the worst error among K1, C and e is {} for the paper's chain and "
                    "{} % for the weak form.",
                    std::isfinite(paper_error) ? format_fixed(100 * paper_error, 1) + " %"
                                               : std::string("not defined (a term was dropped)"),
                    format_fixed(100 * weak_error, 3)));
  }

  void tests() {
    doc_.section("Static and modal tests");
    doc_.subsection("Stiffness test (section III-B)");
    doc_.figure(report::force_deflection(s_.stiffness_table.deflection, s_.stiffness_table.force, s_.stiffness,
                                         s_.stiffness.summary.residual),
                "Paper Fig. 4: force against deflection of the shaft, loading and unloading, with the law of eq. 12.");
    doc_.key_values({{"K1", report::format_estimate(s_.stiffness.k1, "N/m")},
                     {"K1 of the rig, x axis",
                      report::format_estimate(
                          {s_.options.rig.rotor.stiffness * (1 + s_.options.rig.rotor.stiffness_split)}, "N/m")},
                     {"K2", report::format_estimate(s_.stiffness.k2, "N/m^3")},
                     {"K2 of the rig", report::format_estimate({s_.options.rig.rotor.cubic}, "N/m^3")},
                     {"cubic term", s_.stiffness.cubic_p_value < 0.05 ? "significant" : "not significant"}});
    doc_.summary(s_.stiffness.summary, "Stiffness test");
    doc_.subsection("Hammer test (section IV-B)");
    doc_.figure(
        report::frequency_response(s_.frf, 0, reconstruction(s_.frf, s_.modes, 0), s_.modes.modes),
        "Paper Fig. 6: accelerance from hammer impacts with the fitted modes of eq. 20. The rig has five modes, the "
        "paper's machine 35.");
    doc_.table(mode_table(s_));
    doc_.summary(s_.modes.summary, "Hammer test");
  }

  void identification() {
    doc_.section("Identification");
    doc_.table(accuracy_table(s_));
    doc_.subsection("The rig, from its 5 g run-down (weak form, default)");
    doc_.equations(s_.models.at("weak_5g"));
    doc_.summary(s_.models.at("weak_5g").summary, "Model");
    doc_.subsection("The same record by the paper's chain");
    doc_.equations(s_.models.at("paper_5g"));
    doc_.summary(s_.models.at("paper_5g").summary, "Model");
    doc_.table(rig_parameter_table(s_));
  }

  const identification::Validation& validation_of(const std::string& record, const std::string& method,
                                                  const std::string& trained) const {
    for (const StudyValidation& v : s_.validations) {
      if (v.record == record && v.method == method && v.trained_on == trained) return v.validation;
    }
    throw Error("no validation of " + record);
  }

  void overlay(const std::string& figure, const std::string& record, const std::string& trained, const char* channel,
               const std::string& what) {
    const identification::Validation& v = validation_of(record, "weak", trained);
    doc_.figure(report::measured_and_model(s_.record(record).record.measured, channel, v.simulated[channel]),
                fmt::format("Paper Fig. {}: {}, {} axis. Model: weak form, trained on {}.", figure, what,
                            std::string(channel) == "x" ? "X" : "Y", trained));
  }

  void validation() {
    doc_.section("Validation");
    doc_.table(validation_table(s_));
    overlay("7", "runup_balanced", "rundown_balanced", "x", "run-up, balanced rotor, held out");
    overlay("8", "rundown_balanced", "rundown_balanced", "x", "run-down, balanced rotor");
    for (const char* c : {"x", "y"}) {
      const std::string number = *c == 'x' ? "9" : "10";
      overlay(number + "a", "rundown_balanced", "rundown_balanced", c, "balanced rotor without added noise");
      overlay(number + "b", "rundown_balanced_20db", "rundown_balanced_20db", c, "balanced rotor with 20 dB noise");
    }
    for (const char* c : {"x", "y"}) overlay("11", "rundown_balanced", "rundown_balanced", c, "deceleration, balanced");
    for (const char* c : {"x", "y"}) overlay("12", "rundown_2.5g", "rundown_2.5g", c, "deceleration, 2.5 g added");
    for (const char* c : {"x", "y"}) overlay("13", "rundown_5g", "rundown_5g", c, "deceleration, 5 g added");
  }

  void control() {
    doc_.section("Control");
    doc_.table(design_table(s_));
    for (const auto& [name, d] : s_.designs) doc_.summary(d.summary, "Design " + design_label(d));
    const Recording& simulated = s_.run("simulated_tsmc").run.log;
    const Recording measured_open = s_.record("rundown_5g").record.measured;
    const Recording simulated_closed = closed_loop(simulated);
    doc_.subsection("Simulation before the experiment (Fig. 17)");
    doc_.figure(report::time_traces(
                    {{"measured, open loop", measured_open}, {"simulated, closed loop", simulated_closed}}, {"x"}),
                "Paper Fig. 17: closed loop simulated on the identified model against the measured open loop.");
    const ControllerDesign& tsmc = s_.designs.at("tsmc");
    const auto seconds = [&](const char* key) {
      const auto it = tsmc.margins.find(key);
      return it == tsmc.margins.end() ? std::string("none is guaranteed") : report::format_number(it->second, 3) + " s";
    };
    doc_.paragraph(fmt::format(
        "The paper reads 0.55 s from its figure as the time to reach a finite-time state. Its eq. 30 is the time "
        "of sliding on the surface only. Upper bounds for this design: reaching {}, sliding {}.",
        seconds("reach_time_s"), seconds("slide_time_s")));
    reaching();
    balanced();
    loaded();
  }

  // The paper's argument, eqs. 28 to 42, along the run of Table 4.
  void reaching() {
    const std::optional<tuning::SlidingStudy> study =
        tuning::sliding_study(s_.designs.at("tsmc"), s_.run("5g_tsmc").run.log);
    if (!study) return;
    doc_.subsection("Reaching the sliding surface (eqs. 28 to 42)");
    doc_.table(pages::sliding_table(*study));
    const std::optional<Finding> missed = study->missed();
    doc_.callout(missed ? Callout::Kind::disagrees : Callout::Kind::agrees, "Switching gain above the disturbance (42)",
                 missed ? text(*missed)
                        : fmt::format("{} against {} m/s² at most along the run with 5 g.",
                                      report::format_number(study->switching_gain, 3),
                                      report::format_number(study->largest_disturbance, 3)));
    doc_.figure(pages::sliding_figure(*study),
                "The argument along the run with 5 g: S with the layer, disturbance with the switching gain, V, dV/dt "
                "with its bound.");
  }

  void balanced() {
    doc_.subsection("Balanced rotor: PD and TSMC (Fig. 18)");
    const Recording open = open_loop(s_.run("balanced_tsmc").run.log);
    const Recording pd = closed_loop(s_.run("balanced_pd").run.log);
    const Recording st = closed_loop(s_.run("balanced_tsmc").run.log);
    doc_.figure(report::time_traces({{"open loop", open}, {"PD", pd}, {"TSMC", st}}, {"x"}),
                "Paper Fig. 18, time: balanced rotor without control, with PD, with TSMC.");
    std::vector<report::SpectrumCurve> curves;
    for (const auto& [name, r] : {std::pair{"open loop", &open}, std::pair{"PD", &pd}, std::pair{"TSMC", &st}}) {
      const signal::AmplitudeSpectrum a = signal::amplitude_spectrum((*r)["x"], r->dt);
      const Eigen::Index lines = std::min<Eigen::Index>(a.frequency.size(), std::lround(60 / a.frequency[1]));
      curves.push_back({name, a.frequency.head(lines), a.amplitude.head(lines)});
    }
    doc_.figure(report::spectrum(curves, AmplitudeKind::peak), "Paper Fig. 18, frequency: spectra of the same runs.");
    doc_.table(balanced_table(s_));
  }

  void loaded() {
    doc_.subsection("5 g added (Figs. 19 to 28, Table 4)");
    const StudyRun& run = s_.run("5g_tsmc");
    const Recording open = open_loop(run.run.log), closed = closed_loop(run.run.log);
    const auto parts = pages::segment_times(run.run.log, s_.models.at("weak_5g").rotor->natural_frequency());
    const std::vector<NamedRun> both{{"open loop", open}, {"TSMC", closed}};
    const double limit = s_.designs.at("tsmc").force_limit;
    doc_.table(pages::segment_table(run.run.metrics, "Table 4: peaks per segment, 5 g, TSMC", true));
    std::vector<report::Suppression> rows;
    constexpr double paper[5] = {61, 91, 96, 81.8, 92.7};
    for (std::size_t i = 0; i < 4; ++i) {
      rows.push_back(
          {pages::kSegmentNames[i], run.run.metrics.open.segment[i], run.run.metrics.closed.segment[i], paper[i]});
    }
    rows.push_back({"whole run", run.run.metrics.open.all, run.run.metrics.closed.all, paper[4]});
    doc_.figure(report::suppression(rows, AmplitudeKind::peak), "Suppression per segment beside the paper's Table 4.");
    doc_.table(pages::segment_table(s_.run("5g_best").run.metrics,
                                    "The same with the best design (" + s_.designs.at("best").law + " with " +
                                        s_.designs.at("best").estimator + ")",
                                    true));
    doc_.figure(report::time_traces(both, {"x"}), "Paper Fig. 19: X displacement, open and closed loop, 5 g.");
    report::Figure force_x = report::control_force({{"TSMC", closed}}, limit), force_y = force_x;
    force_x.panels = {force_x.panels.at(0)};
    force_y.panels = {force_y.panels.at(1)};
    doc_.figure(force_x, "Paper Fig. 20: control force U_X of Fig. 19.");
    doc_.figure(report::time_traces(both, {"y"}), "Paper Fig. 21: Y displacement, open and closed loop, 5 g.");
    doc_.figure(force_y, "Paper Fig. 22: control force U_Y of Fig. 21.");
    doc_.figure(report::funnel(both), "Paper Fig. 23: path of the disk centre over time.");
    doc_.figure(report::time_traces(both, {"x"}, parts), "Paper Fig. 24: Fig. 19 with its four segments.");
    for (std::size_t i = 0; i < parts.size() && i < 4; ++i) {
      doc_.figure(report::phase_plane(both, "x", {parts[i]}),
                  fmt::format("Paper Fig. {}: phase plane of segment {}.", 25 + i, parts[i].name));
    }
  }

  const Study& s_;
  Document doc_;
};

}  // namespace

report::Document study_report(const Study& study) { return Report(study).build(); }

}  // namespace whirl::study
