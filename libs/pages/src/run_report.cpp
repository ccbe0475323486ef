#include "whirl/pages/run_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "record/record_maps.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/pages/run_report_tables.hpp"
#include "whirl/pages/steady_response.hpp"
#include "whirl/pages/text/findings.hpp"
#include "whirl/pages/text/standards.hpp"
#include "whirl/pages/verdict.hpp"
#include "whirl/pages/vibration_tables.hpp"
#include "whirl/report/format.hpp"

namespace whirl::pages {
namespace {

using report::Callout;
using report::Document;
using report::format_fixed;
constexpr const char* kBeats =
    "Maxima after the peak of a fast run are beats of the free with the forced vibration, not further resonances.";

class RunReport {
 public:
  RunReport(const ReportInputs& in, const ReportOptions& options) : in_(in), o_(options) {}

  Document build() {
    doc_.title = o_.title;
    doc_.subtitle = fmt::format("{}, whirl {}", counted(in_.files.size(), "file"), version());
    verdict();
    findings();
    if (!in_.records.empty() || !in_.bode.empty()) runs();
    if (!in_.stiffness.empty() || !in_.modes.empty() || !in_.responses.empty()) tests();
    if (!in_.models.empty()) models();
    if (!in_.logs.empty() || !in_.runs.empty() || !in_.controllers.empty()) control();
    judgement();
    doc_.section("Provenance");
    doc_.provenance(io::provenance(in_.files, o_.command_line));
    return std::move(doc_);
  }

 private:
  void verdict() {
    if (in_.records.empty()) return;
    for (const auto& [name, record] : in_.records) {
      Verdict& v = verdicts_.emplace_back(verdict_on(name, record, o_.service_speed));
      if (const RunVibration* worst = worst_housing(name)) {
        v.velocity = worst->channel.housing->rms;
        v.housing_channel = worst->channel.channel;
        if (o_.machine && !changes_speed(*worst)) v.housing_zone = diagnosis::housing_zone(worst->channel, *o_.machine);
      }
    }
    doc_.section("Verdict");
    doc_.table(verdict_table(verdicts_, o_.signature));
  }

  // What a reader should know before anything else; all from the inputs.
  void findings() {
    doc_.section("Findings");
    bool any = add_standard_findings(doc_, verdicts_, balance_quality(in_.models, criticals(), o_.service_speed));
    for (const auto& [name, model] : in_.models) {
      if (model.summary.trust.empty()) continue;
      const Callout::Kind kind = model.summary.status == Status::ok ? Callout::Kind::agrees : Callout::Kind::warning;
      doc_.callout(kind, "Model " + name, model.summary.trust);
      any = true;
    }
    for (const auto& [name, log] : in_.logs) {
      const tuning::ClosedLoopMetrics m = metrics_of_log(log, natural_frequency(log), force_limit());
      doc_.callout(m.closed.all < m.open.all ? Callout::Kind::agrees : Callout::Kind::disagrees, "Closed loop " + name,
                   fmt::format("largest |x| {} with control, {} without: {} % less, by a force of {} N rms in x.",
                               report::format_amplitude(m.closed.all, AmplitudeKind::peak),
                               report::format_amplitude(m.open.all, AmplitudeKind::peak),
                               format_fixed(100 * m.suppression.all, 1), format_fixed(m.force_rms, 2)));
      any = true;
    }
    for (const Verdict& v : verdicts_) {
      std::vector<std::string> lines = lines_of(v.vibration);
      if (lines.empty()) continue;
      doc_.subsection("Vibration of " + v.record);
      doc_.bullets(std::move(lines));
      any = true;
    }
    for (const CriticalRow& c : criticals()) {
      doc_.callout(Callout::Kind::note, "Largest 1X amplitude of " + c.run,
                   fmt::format("{} at {:.0f} rpm in channel {}{}.",
                               report::format_amplitude(c.amplitude, AmplitudeKind::peak, c.curve.quantity),
                               c.critical / kRadPerSecPerRpm, c.channel,
                               c.reading ? fmt::format(", amplification factor {} by half power",
                                                       format_fixed(c.reading->factor, 1))
                                         : ""));
      any = true;
    }
    any = housing_findings() || any;
    if (!any) doc_.paragraph("The inputs hold nothing to assess; see the sections below.");
  }

  // The housing sensor of a run with the highest level; null where it has none.
  const RunVibration* worst_housing(const std::string& name) {
    const RunVibration* worst = nullptr;
    for (const RunVibration& v : vibration()) {
      if (v.run == name && v.channel.housing &&
          (worst == nullptr || v.channel.housing->rms > worst->channel.housing->rms))
        worst = &v;
    }
    return worst;
  }
  static bool changes_speed(const RunVibration& v) { return v.channel.synchronous && !v.channel.synchronous->steady; }

  // Its zone where the class of the machine is stated.
  bool housing_findings() {
    bool any = false;
    for (const auto& [name, record] : in_.records) {
      const RunVibration* worst = worst_housing(name);
      if (worst == nullptr) continue;
      any = true;
      const double level = worst->channel.housing->rms;
      const std::string text =
          fmt::format("{} in channel {}, {:g} Hz to {:g} Hz",
                      report::format_amplitude(level, AmplitudeKind::rms, Quantity::velocity), worst->channel.channel,
                      worst->channel.housing->low, worst->channel.housing->high);
      if (!o_.machine) {
        doc_.callout(Callout::Kind::note, "Housing vibration of " + name,
                     text + ". No zone: the class of the machine is not stated (--machine).");
        continue;
      }
      if (changes_speed(*worst)) {
        doc_.callout(Callout::Kind::note, "Housing vibration of " + name,
                     text + ". The speed of the run changes: the zones apply to steady running.");
        continue;
      }
      const diagnosis::HousingZone zone = diagnosis::housing_zone(worst->channel, *o_.machine);
      doc_.callout(
          zone.zone < 'C' && !zone.at_least ? Callout::Kind::agrees : Callout::Kind::warning,
          "Housing vibration of " + name,
          fmt::format("{}: zone {} of ISO 20816-3, {}.", text, zone_text(zone), diagnosis::to_string(*o_.machine)));
    }
    return any;
  }

  // What each channel of each record says, made once.
  const std::vector<RunVibration>& vibration() {
    if (!vibration_.empty()) return vibration_;
    for (const auto& [name, record] : in_.records) {
      for (diagnosis::ChannelVibration& v : diagnosis::vibration_of(record, readable_rotation(record), o_.slow_roll))
        vibration_.push_back({name, std::move(v)});
    }
    return vibration_;
  }

  // The 1X curves of every record and Bode table, made once.
  const std::vector<CriticalRow>& criticals() {
    if (!critical_rows_.empty()) return critical_rows_;
    const auto add = [&](const std::string& run, const signal::SynchronousCurve& curve) {
      if (curve.vector.size() == 0) return;
      Eigen::Index top = 0;
      const double largest = curve.vector.cwiseAbs().maxCoeff(&top);
      critical_rows_.push_back({run, curve.name, curve.speed[top], largest, diagnosis::amplification(curve), curve});
    };
    for (const auto& [name, record] : in_.records) {
      const auto turning = readable_rotation(record);
      if (!turning) continue;
      for (const Channel& c : record.channels) {
        if (c.quantity == Quantity::displacement || diagnosis::of_a_housing(c, record))
          add(name, diagnosis::shown_curve(record, *turning, c.name, 1, 1, o_.slow_roll));
      }
    }
    for (const auto& [name, curves] : in_.bode) {
      for (const signal::SynchronousCurve& c : curves) add(name, c);
    }
    return critical_rows_;
  }

  ViewOptions view_options() const {
    ViewOptions v;
    v.slow_roll = o_.slow_roll;
    for (const auto& [name, modes] : in_.modes) {
      for (const Mode& m : modes.modes) v.natural_frequencies.push_back(m.frequency.value);
    }
    return v;
  }

  // A figure that the record may not allow (no angle, no y) is left out with its reason.
  void draw(const std::string& what, const std::vector<ViewedRun>& run, const ViewOptions& options,
            const std::string& caption) {
    try {
      doc_.figure(view(what, run, options), caption);
    } catch (const Error& e) {
      if (std::ranges::count(left_out_, e.what()) == 0) left_out_.emplace_back(e.what());
    }
  }

  // Sensors of the shaft and of the housing, those of one quantity together; x and y before other displacements.
  static std::vector<std::vector<std::string>> sensors_by_quantity(const Recording& record) {
    std::vector<std::vector<std::string>> out;
    for (const Quantity q : {Quantity::displacement, Quantity::velocity, Quantity::acceleration}) {
      std::vector<std::string> names;
      for (const Channel& c : record.channels) {
        if (c.quantity == q && (q == Quantity::displacement || diagnosis::of_a_housing(c, record)))
          names.push_back(c.name);
      }
      std::ranges::stable_partition(names, [](const std::string& n) { return n == "x" || n == "y"; });
      if (!names.empty()) out.push_back(std::move(names));
    }
    return out;
  }

  // Figures of the channels of `v`, which have one quantity; maps and orders are those of the first.
  void draw_vibration(const std::vector<ViewedRun>& run, const ViewOptions& v) {
    const std::string of = v.channels.empty() ? "" : fmt::format(" Channels {}.", fmt::join(v.channels, ", "));
    draw("spectrum", run, v, "Spectrum of the whole record." + of);
    draw("run-map", run, v, "Run map: spectra over rotor speed with orders and natural frequencies (Campbell style).");
    draw("waterfall", run, v, "Waterfall: spectra over time.");
    draw("cascade", run, v, "Cascade: spectra at their rotor speeds.");
    draw("bode", run, v,
         "Bode plot of the 1X vectors, one per revolution." + of + " " + std::string(kBeats) + slow_roll_note());
    draw("polar", run, v, "Polar plot of the same vectors, not drawn through beats.");
    draw("orders", run, v, "Orders followed through the run by a Vold-Kalman filter.");
  }

  void runs() {
    doc_.section("Runs");
    doc_.table(run_table(in_.records));
    if (!vibration().empty()) doc_.table(vibration_table(vibration()));
    for (const auto& [name, record] : in_.records) {
      doc_.subsection(name);
      left_out_.clear();
      const auto bad = in_.left_out.find(name);
      const std::vector<ViewedRun> run{
          {name, record, bad == in_.left_out.end() ? std::vector<std::string>{} : bad->second}};
      if (bad != in_.left_out.end())
        doc_.callout(Callout::Kind::warning, "Readings left out of every number and figure",
                     fmt::format("{}", fmt::join(bad->second, "; ")));
      ViewOptions v = view_options();
      draw("traces", run, v, "Time traces of " + name + ".");
      const std::vector<std::vector<std::string>> sensors = sensors_by_quantity(record);
      if (sensors.empty()) draw_vibration(run, v);
      for (const std::vector<std::string>& channels : sensors) {
        v.channels = channels;
        draw_vibration(run, v);
      }
      v.channels.clear();
      if (record.has("x") && record.has("y")) {
        draw("orbit", run, v, "Orbit around the largest radius; dots where the rotor angle is zero.");
        draw("full-spectrum", run, v,
             "Full spectrum: forward whirl at positive, backward whirl at negative frequency.");
      }
      if (!left_out_.empty())
        doc_.callout(Callout::Kind::note, "Figures left out", fmt::format("{}", fmt::join(left_out_, "; ")));
    }
    for (const auto& [name, curves] : in_.bode) {
      doc_.subsection(name);
      report::Figure bode = synchronous_view("bode", curves), polar = synchronous_view("polar", curves);
      bode.runs = polar.runs = {name};
      doc_.figure(bode, "Bode plot of the 1X vectors. " + std::string(kBeats));
      doc_.figure(polar, "Polar plot of the same vectors.");
    }
    if (criticals().empty()) return;
    doc_.table(critical_table(criticals(), o_.service_speed));
    const double lowest = std::ranges::min(criticals(), {}, &CriticalRow::critical).critical;
    const std::string doubt = doubt_of_hertz("the service speed", o_.service_speed, o_.service_speed, lowest);
    if (o_.service_speed > 0 && !doubt.empty()) io::remark("report", doubt);
  }

  std::string slow_roll_note() const {
    return o_.slow_roll > 0 ? fmt::format(" The mean vector below {:.0f} rpm (slow roll) is taken off.",
                                          o_.slow_roll / kRadPerSecPerRpm)
                            : "";
  }

  void tests() {
    doc_.section("Static and modal tests");
    for (const auto& [name, law] : in_.stiffness) {
      doc_.subsection(name);
      doc_.key_values({{"K1", report::format_estimate(law.k1, "N/m")},
                       {"K2", report::format_estimate(law.k2, "N/m^3")},
                       {"cubic term", law.cubic_p_value < 0.05 ? "significant" : "not significant"},
                       {"readings", std::to_string(law.points)}});
      doc_.summary(law.summary, "Stiffness test");
    }
    for (const auto& [name, frf] : in_.responses) {
      doc_.subsection(name);
      doc_.figure(
          report::frequency_response(frf, 0, {},
                                     in_.modes.empty() ? std::vector<Mode>{} : in_.modes.front().value.modes),
          "Frequency response of " + frf.channels.front().response + " to " + frf.channels.front().reference + ".");
    }
    for (const auto& [name, modes] : in_.modes) {
      doc_.table(mode_list(name, modes));
      doc_.summary(modes.summary, "Modes");
    }
  }

  void models() {
    doc_.section("Identified equations");
    for (const auto& [name, model] : in_.models) {
      doc_.subsection(name);
      doc_.equations(model);
      if (report::Table table = report::parameter_table(model); !table.rows.empty()) doc_.table(table);
      doc_.table(report::coefficient_table(model));
      if (!model.ambiguities.empty()) {
        std::vector<std::string> open;
        for (const Ambiguity& a : model.ambiguities)
          open.push_back(fmt::format("{}: {}. To decide: {}", a.readings, a.consequence, a.experiment));
        doc_.paragraph("What its records cannot tell apart:").bullets(std::move(open));
      }
      doc_.summary(model.summary, "Model " + name);
    }
    validation();
  }

  // Table 2 analogue: every rotor model run free against every record.
  void validation() {
    report::Table table = validation_columns();
    std::optional<Recording> worst_record;
    std::string worst_name;
    identification::Validation worst;
    for (const auto& [model_name, model] : in_.models) {
      if (!model.rotor && (model.states.empty() || model.states.front() != "X1")) continue;
      for (const auto& record : in_.records) {
        const Recording named = model.rotor ? identification::with_motion_names(record.value) : record.value;
        if (!named.has("x") || !named.has("y") || !named.has("beta")) continue;
        const bool trained = std::ranges::any_of(
            model.provenance.inputs, [&](const std::string& input) { return input.starts_with(record.name + " "); });
        const identification::Validation v = identification::validate_model(model, named);
        add_validation(table, model_name, record.name, trained, v);
        if (!trained && v.summary.status != Status::unusable && (!worst_record || v.nrmse > worst.nrmse)) {
          worst_record = named;
          worst_name = record.name;
          worst = v;
        }
      }
    }
    for (const auto& [name, json] : in_.validations) add_validation_file(table, name, json);
    if (table.rows.empty()) return;
    doc_.subsection("Prediction of records");
    doc_.table(table);
    if (worst_record) {
      doc_.figure(report::measured_and_model(*worst_record, "x", worst.simulated["x"]),
                  "The record predicted worst among those not used for the fit: " + worst_name + ".");
    }
  }

  // Of the model, else of the controller's model, else the speed of the open loop's largest amplitude.
  double natural_frequency(const Recording& log) const {
    for (const auto& [name, model] : in_.models) {
      if (model.rotor && model.rotor->natural_frequency() > 0) return model.rotor->natural_frequency();
    }
    for (const auto& [name, design] : in_.controllers) {
      if (design.model.natural_frequency() > 0) return design.model.natural_frequency();
    }
    Eigen::Index top = 0;
    log["x_open"].cwiseAbs().maxCoeff(&top);
    return log["omega"][top];
  }
  double force_limit() const { return in_.controllers.empty() ? 0 : in_.controllers.front().value.force_limit; }

  void control() {
    doc_.section("Closed loop");
    for (const auto& [name, design] : in_.controllers) {
      doc_.subsection(name);
      doc_.key_values(controller_values(design));
      doc_.summary(design.summary, "Design");
    }
    for (const auto& [name, log] : in_.logs) {
      doc_.subsection(name);
      const double w0 = natural_frequency(log);
      const tuning::ClosedLoopMetrics m = metrics_of_log(log, w0, force_limit());
      doc_.table(segment_table(
          m,
          fmt::format("Segments by rotor speed (natural frequency {:.2f} Hz), {}", w0 / (2 * std::numbers::pi), name),
          o_.with_paper));
      doc_.key_values(effort_values(m));
      const std::vector<ViewedRun> runs = viewed_runs(log, name);
      std::vector<report::NamedRun> both;
      for (const ViewedRun& r : runs) both.push_back({r.name, r.record});
      const std::vector<report::Segment> parts = segment_times(log, w0);
      doc_.figure(report::time_traces(both, {"x", "y"}, parts),
                  "Displacement without and with control; segments shaded.");
      doc_.figure(report::radius(both, parts),
                  "Radius √(x² + y²), the largest of each twentieth of a second, on a logarithmic axis.");
      doc_.figure(report::control_force({{name, runs.back().record}}, force_limit(), parts), "Control force.");
      if (runs.back().record.has("s_x")) {
        doc_.figure(report::time_traces({{name, runs.back().record}}, {"s_x", "s_y"}, parts),
                    "Sliding variables s(t).");
      }
      left_out_.clear();
      const ViewOptions v = view_options();
      draw("bode", runs, v, "Bode plot of the 1X vector of x, open (grey) and closed loop.");
      draw("spectrum", runs, v, "Spectra of x, open (grey) and closed loop.");
      draw("orders", {runs.back()}, v, "Orders of the closed loop.");
      doc_.figure(report::phase_plane(both, "x", parts), "Phase plane per segment.");
      draw("funnel", runs, v, "Path of the disk centre over time.");
      if (!left_out_.empty())
        doc_.callout(Callout::Kind::note, "Figures left out", fmt::format("{}", fmt::join(left_out_, "; ")));
    }
    for (const auto& [name, json] : in_.runs) doc_.table(run_file_table(name, json, o_.with_paper));
  }

  void judgement() {
    const report::Table zones = zone_table(criticals(), o_.service_speed);
    const report::Table housing = housing_table(vibration(), o_.machine);
    const report::Table grades = grade_table(balance_quality(in_.models, criticals(), o_.service_speed));
    if (zones.rows.empty() && housing.rows.empty() && grades.rows.empty()) return;
    doc_.section("Assessed by the standards' numbers");
    doc_.callout(Callout::Kind::note, "Guidance, not a statement of compliance",
                 "Limits are those commonly quoted of ISO 20816-3, ISO 21940-11 and API 617; compare with the current "
                 "editions.");
    if (!zones.rows.empty()) doc_.table(zones);
    if (!housing.rows.empty()) doc_.table(housing);
    if (!grades.rows.empty()) doc_.table(grades);
  }

  const ReportInputs& in_;
  const ReportOptions& o_;
  Document doc_;
  std::vector<Verdict> verdicts_;
  std::vector<CriticalRow> critical_rows_;
  std::vector<RunVibration> vibration_;
  std::vector<std::string> left_out_;
};

}  // namespace

Document run_report(const ReportInputs& inputs, const ReportOptions& options) {
  return RunReport(inputs, options).build();
}

}  // namespace whirl::pages
