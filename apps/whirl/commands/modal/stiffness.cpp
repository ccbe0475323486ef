#include "whirl/modal/stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "command.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/estimate_text.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

// Readings of any format: the order of the rows counts, not their time.
modal::DirectedStiffnessTable read_pull(const std::string& file, const std::vector<std::string>& columns,
                                        double angle) {
  io::CsvOptions options;
  options.columns = columns;
  options.required = {"deflection_mm", "force_N"};
  if (io::file_format(file) == io::FileFormat::csv) {
    const io::Table table = io::read_table(file, options);
    return {angle, table["deflection"], table["force"]};
  }
  const io::SignalFile signals = io::read_signals(file);
  const bool timed = std::any_of(signals.tables.begin(), signals.tables.end(),
                                 [](const io::SignalTable& t) { return t.abscissa == Quantity::time; });
  if (!timed) options.rate = 1;
  const Recording record = io::recording_of(signals, options);
  return {angle, record["deflection"], record["force"]};
}

std::string describe(const StiffnessLaw& law) {
  std::string text =
      fmt::format("K1 = {}\nK2 = {}\noffset = {}\ncubic term: {} (p = {:.2g})", pages::estimate_text(law.k1, "N/m"),
                  pages::estimate_text(law.k2, "N/m^3"), pages::estimate_text(law.offset, "m"),
                  law.cubic_p_value < 0.05 ? "significant" : "not significant", law.cubic_p_value);
  if (law.hysteresis > 0) text += fmt::format("\nlargest hysteresis: {:.3g} N", law.hysteresis);
  return text;
}

io::Json to_json(const modal::AnisotropicStiffness& stiffness, const std::vector<modal::DirectedStiffnessTable>& tables,
                 const Provenance& source) {
  io::Json out = io::start_document("whirl.anisotropic_stiffness", 1);
  out.set("mean", whirl::to_json(stiffness.mean, "N/m")).set("amplitude", whirl::to_json(stiffness.amplitude, "N/m"));
  out.set("axis_deg", stiffness.axis / kRadPerDegree).set("p_value", stiffness.p_value);
  io::Json directions = io::Json::array();
  for (std::size_t i = 0; i < tables.size(); ++i) {
    directions.push(io::Json::object()
                        .set("angle_deg", tables[i].angle / kRadPerDegree)
                        .set("law", whirl::to_json(stiffness.laws[i])));
  }
  out.set("directions", std::move(directions))
      .set("summary", whirl::to_json(stiffness.summary))
      .set("provenance", whirl::to_json(source));
  return out;
}

struct StiffnessFlags {
  std::vector<std::string> files, columns;
  std::vector<double> angles;
  std::string out, figure;
  modal::StiffnessOptions fit;
  bool zero_known = false, keep_all = false;
  double gauge_um = 0;
};

void set_fit(StiffnessFlags& o) {
  o.fit.fit_offset = !o.zero_known;
  o.fit.leave_out_outliers = !o.keep_all;
  if (o.gauge_um != 0) require_range("--gauge-sd-um", o.gauge_um, 1e-6, 1e6, "um");
  o.fit.deflection_sd = 1e-6 * o.gauge_um;
}

}  // namespace

void add_stiffness(CommandLine& app, Session& session) {
  auto o = std::make_shared<StiffnessFlags>();
  CommandLine* sub = add_command(
      app, session, "stiffness", "Stiffness law F = K1 d + K2 d^3 from a force-deflection table",
      "Input: a table (any format of `whirl info`) with the columns deflection (deflection_mm, ...) and "
      "force\n"
      "(force_N, force_lbf, ...), in the order measured; loading and unloading may follow each other. Several tables, "
      "one per\n"
      "direction of the pull stated with --angle-deg, give the anisotropy of the shaft as well.\n"
      "Output: K1 (N/m), K2 (N/m^3) and the gauge offset with 95 % intervals, whether the cubic term is significant,\n"
      "hysteresis; from several directions the mean stiffness, half the difference of the principal ones and their "
      "axis.\n\n"
      "Example: whirl stiffness pull_x.csv --out stiffness.json\n"
      "         whirl stiffness pull_x.csv pull_y.csv pull_45.csv --angle-deg 0 90 45",
      [o, &session] {
        if (o->files.size() > 1 && o->angles.size() != o->files.size()) {
          throw Error::in_field("--angle-deg", fmt::format("{} values", o->angles.size()),
                                fmt::format("one per table, {}", o->files.size()));
        }
        if (o->angles.size() > o->files.size())
          throw Error::in_field("--angle-deg", fmt::format("{} values", o->angles.size()), "one per table, 1");
        set_fit(*o);
        std::vector<modal::DirectedStiffnessTable> tables;
        for (const double angle : o->angles) require_range("--angle-deg", angle, -360, 360, "deg");
        for (std::size_t i = 0; i < o->files.size(); ++i) {
          tables.push_back(read_pull(o->files[i], o->columns, o->angles.empty() ? 0 : o->angles[i] * kRadPerDegree));
        }
        const Provenance source = io::provenance({o->files.begin(), o->files.end()}, session.command_line);
        session.write_together();
        const auto draw = [&](std::size_t i, const StiffnessLaw& law) {
          if (!o->figure.empty() && i == 0)
            report::write_figure(report::force_deflection(tables[i].deflection, tables[i].force, law), o->figure);
        };
        if (tables.size() == 1) {
          StiffnessLaw law = modal::fit_stiffness(tables[0].deflection, tables[0].force, o->fit);
          law.provenance = source;
          if (!o->out.empty()) io::save(o->out, law);
          session.say(describe(law));
          draw(0, law);
          session.result(whirl::to_json(law));
          session.finish(law.summary);
          return;
        }
        const modal::AnisotropicStiffness stiffness = modal::fit_anisotropic_stiffness(tables, o->fit);
        for (std::size_t i = 0; i < tables.size(); ++i) {
          session.say(fmt::format("{} at {:g} deg\n{}\n", o->files[i], o->angles[i], describe(stiffness.laws[i])));
          draw(i, stiffness.laws[i]);
        }
        session.say(
            fmt::format("mean K1 = {}\nhalf the difference of the principal stiffnesses = {}\nstiffest at {:.3g} deg "
                        "from x\nanisotropy: {} (p = {:.2g})",
                        pages::estimate_text(stiffness.mean, "N/m"), pages::estimate_text(stiffness.amplitude, "N/m"),
                        stiffness.axis / kRadPerDegree, stiffness.p_value < 0.05 ? "significant" : "not significant",
                        stiffness.p_value));
        const io::Json result = to_json(stiffness, tables, source);
        if (!o->out.empty()) io::save_json(o->out, result);
        session.result(result);
        session.finish(stiffness.summary);
      });
  sub->add_option("FILES", o->files, "force-deflection tables")->input()->required();
  sub->add_option("--angle-deg", o->angles, "direction of each pull, degrees from x towards y")->range(-360, 360);
  sub->add_option("--columns", o->columns,
                  "columns to read, HEADER or HEADER:name_unit, e.g. V1:force_N V2:deflection_mm");
  sub->add_option("--out", o->out, "write the law as JSON")->output("whirl.stiffness|whirl.anisotropic_stiffness");
  sub->add_option("--figure", o->figure, "draw the readings of the first table with the law (.svg .png .pdf .csv)")
      ->output("figure");
  sub->add_option("--gauge-sd-um", o->gauge_um,
                  "standard deviation of the deflection gauge, um; without it the force alone is taken as noisy")
      ->range(1e-6, 1e6);
  sub->add_flag("--keep-outliers", o->keep_all, "use every reading, also those far off the law of the others");
  sub->add_flag("--zero-known", o->zero_known, "the gauge is exactly zero at no force: do not fit an offset");
}

}  // namespace whirl::app
