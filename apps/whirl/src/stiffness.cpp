#include "command.hpp"
#include "print.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/modal/stiffness.hpp"
#include "whirl/pipeline/provenance.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {

void add_stiffness(CLI::App& app, Session& session) {
  struct Options {
    std::string file, out, figure;
    StiffnessOptions fit;
    bool zero_known = false;
  };
  auto o = std::make_shared<Options>();
  CLI::App* sub = add_command(
      app, session, "stiffness", "Stiffness law F = K1 d + K2 d^3 from a force-deflection table",
      "Input: CSV table with the columns deflection (deflection_mm, deflection_um, ...) and force (force_N, force_lbf,\n"
      "...), in the order measured; loading and unloading may follow each other.\n"
      "Output: K1 (N/m), K2 (N/m^3) and the gauge offset with 95 % intervals, whether the cubic term is significant,\n"
      "hysteresis.\n\n"
      "Example: whirl stiffness pull_x.csv --out stiffness.json",
      [o, &session] {
        CsvOptions csv;
        csv.required = {"deflection", "force"};
        const Table table = read_table(o->file, csv);
        o->fit.fit_offset = !o->zero_known;
        StiffnessLaw law = fit_stiffness(table["deflection"], table["force"], o->fit);
        law.provenance = provenance({o->file}, session.command_line);
        if (!o->out.empty()) save(o->out, law);
        session.say(fmt::format("K1 = {}\nK2 = {}\noffset = {}\ncubic term: {} (p = {:.2g})", 
                                show(law.k1, "N/m"), show(law.k2, "N/m^3"), show(law.offset, "m"),
                                law.cubic_p_value < 0.05 ? "significant" : "not significant", law.cubic_p_value));
        if (law.hysteresis > 0) session.say(fmt::format("largest hysteresis: {:.3g} N", law.hysteresis));
        if (!o->figure.empty()) report::write_figure(report::force_deflection(table["deflection"], table["force"], law), o->figure);
        session.result(to_json(law));
        session.finish(law.summary);
      });
  sub->add_option("FILE", o->file, "force-deflection table (CSV)")->required();
  sub->add_option("--out", o->out, "write the law as JSON");
  sub->add_option("--figure", o->figure, "draw the readings with the law (.svg .png .pdf .csv)");
  sub->add_flag("--zero-known", o->zero_known, "the gauge is exactly zero at no force: do not fit an offset");
}

}  // namespace whirl::app
