#include "command.hpp"
#include "responses.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/pipeline/provenance.hpp"
#include "whirl/report/table.hpp"

namespace whirl::app {

void add_modes(CLI::App& app, Session& session) {
  struct Options {
    std::string file, out, kind;
    ModeOptions modes;
    double low = 0, high = 0;
  };
  auto o = std::make_shared<Options>();
  CLI::App* sub = add_command(
      app, session, "modes", "Natural frequencies, damping and residues from frequency responses (paper eq. 20)",
      "Input: JSON written by `whirl frf`, a universal file with frequency responses, or a CSV table of them with --kind.\n"
      "Output: every mode with its frequency (Hz) and damping ratio (%), each with its standard deviation; residues and\n"
      "residuals in the JSON.\n\n"
      "Example: whirl modes frf.json --band-low-hz 5 --band-high-hz 400 --out modes.json",
      [o, &session] {
        const std::optional<FrequencyResponse> found = read_responses(o->file, o->kind);
        if (!found) throw Error::in_file(o->file, 0, "holds no frequency responses: make them with `whirl frf`");
        const FrequencyResponse& frf = *found;
        ModeOptions options = o->modes;
        options.poles.band_low = o->low;
        options.poles.band_high = o->high;
        ModalModel modes = fit_modes(frf, options);
        modes.provenance = provenance({o->file}, session.command_line);
        if (!o->out.empty()) save(o->out, modes);
        report::Table table;
        table.caption = "Modes";
        table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"± sd", "Hz"}, {"damping", "%"}, {"± sd", "%"}};
        for (std::size_t i = 0; i < modes.modes.size(); ++i) {
          const Mode& m = modes.modes[i];
          table.add({fmt::format("{}", i + 1), fmt::format("{:.4f}", m.frequency.value),
                     fmt::format("{:.2g}", m.frequency.sd), fmt::format("{:.4f}", 100 * m.damping.value),
                     fmt::format("{:.2g}", 100 * m.damping.sd)});
        }
        session.say(report::to_text(table));
        session.say(fmt::format("reconstruction error {:.2f} % of the FRFs in {:.4g} to {:.4g} Hz",
                                100 * modes.reconstruction_error, modes.band_low, modes.band_high));
        session.result(to_json(modes));
        session.finish(modes.summary);
      });
  sub->add_option("FILE", o->file, "frequency responses")->required();
  sub->add_option("--out", o->out, "write the modes as JSON");
  sub->add_option("--kind", o->kind, "of a CSV table: receptance, mobility or accelerance");
  sub->add_option("--band-low-hz", o->low, "lower end of the band; 0 = first line");
  sub->add_option("--band-high-hz", o->high, "upper end of the band; 0 = last line");
}

}  // namespace whirl::app
