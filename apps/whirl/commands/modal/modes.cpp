#include "whirl/pages/text/modes.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "ambient.hpp"
#include "command.hpp"
#include "response_options.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/geometry.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/modal/hann_window.hpp"
#include "whirl/pages/modal_page.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

bool names_universal_file(const std::string& file) {
  std::filesystem::path path = file;
  if (path.extension() == ".gz") path.replace_extension();
  return path.extension() == ".uff" || path.extension() == ".unv";
}

// The command that made a page, to which the page adds its own choice of poles.
std::string without_selection(const std::string& line) {
  const std::size_t at = line.find(" --select ");
  if (at == std::string::npos) return line;
  const std::size_t next = line.find(" -", at + 10);
  return line.substr(0, at) + (next == std::string::npos ? "" : line.substr(next));
}

struct ModesOptions {
  std::vector<std::string> files;
  std::string out, reference, geometry, page, method = "plscf", window = "auto";
  std::vector<std::string> figures;
  bool no_refine = false;
  modal::ModeOptions modes;
  ResponseFlags responses;
  double low = 0, high = 0, window_end_percent = 100;
};

// The responses of all files; `remarks`: what their readers say.
std::vector<FrequencyResponse> read_parts(const ModesOptions& o, std::vector<std::string>& remarks) {
  std::vector<FrequencyResponse> parts;
  for (const std::string& file : o.files) {
    std::optional<FrequencyResponse> found = io::read_responses(file, o.responses.options());
    if (!found)
      throw Error::in_file(
          file, 0,
          fmt::format("holds no frequency responses (a table of them has freq_hz, H1_re, H1_im, ...): of records, make "
                      "them with `whirl frf {} --out frf.json`, then give frf.json",
                      file));
    // Those of a document written by `whirl frf` were shown when it was made.
    if (io::file_format(file) != io::FileFormat::json) {
      for (const std::string& remark : found->summary.warnings) remarks.push_back(file + ": " + remark);
    }
    parts.push_back(std::move(*found));
  }
  return parts;
}

void find_modes(ModesOptions* o, Session& session) {
  if (o->method == "fdd") {
    if (o->files.size() > 1)
      throw Error::in_field("FILES", fmt::format("{} files", o->files.size()), "one record with --method fdd");
    require_json_name(o->out);
    show_fdd(io::read_recording(o->files[0]), {.band_low = o->low, .band_high = o->high}, o->out, o->figures, session);
    return;
  }
  const bool universal = names_universal_file(o->out);
  if (!universal) require_json_name(o->out);
  if (!o->page.empty() && std::filesystem::path(o->page).extension() != ".html")
    throw Error::in_field("--page", o->page, "a name that ends in .html");
  const io::Geometry geometry = o->geometry.empty() ? io::Geometry{} : io::read_geometry(o->geometry);
  std::vector<std::string> remarks;
  const std::vector<FrequencyResponse> parts = read_parts(*o, remarks);
  std::vector<std::string> dead;
  FrequencyResponse frf = modal::without_dead_channels(modal::join_references(parts), dead);
  require_range("--window-end-percent", o->window_end_percent, 1e-10, 100, "%");
  if (o->window == "hann") {
    if (o->window_end_percent != 100)
      throw Error("--window hann: not with --window-end-percent, which states another window");
    frf = modal::without_hann_window(frf);
  }
  if (o->window_end_percent != 100) modal::state_exponential_window(frf, o->window_end_percent / 100);
  for (const std::string& name : dead) remarks.push_back("channel " + name + " is zero on every line: left out");
  modal::ModeOptions options = o->modes;
  options.poles.method = o->method == "lsce"  ? modal::PoleMethod::lsce
                         : o->method == "era" ? modal::PoleMethod::era
                         : o->method == "rfp" ? modal::PoleMethod::rfp
                                              : modal::PoleMethod::plscf;
  if (o->no_refine) options.refine = options.search = false;
  options.poles.band_low = o->low;
  options.poles.band_high = o->high;
  options.find_hann_window = o->window == "auto";
  ModalModel modes = modal::fit_modes(frf, options);
  std::string again = without_selection(session.command_line);
  if (modes.window_decay != frf.window_decay) {
    frf = modal::without_hann_window(frf);  // what was fitted, for all figures
    again += " --window hann";
  }
  for (const std::string& remark : remarks) modes.summary.warn(remark);
  modal::warn_of_contradictions(frf, modes);
  modes.provenance = io::provenance({o->files.begin(), o->files.end()}, session.command_line);
  const modal::ModeShapes shapes = modal::mode_shapes(modes);
  session.write_together();
  if (universal) {
    io::write_uff(o->out, io::uff_from_modes(modes, shapes.points, shapes.value, geometry));
  } else if (!o->out.empty()) {
    io::save(o->out, modes);
  }
  if (!o->page.empty()) {
    io::write_text(o->page, pages::modal_page(frf, modes, shapes, modal::stabilisation_diagram(frf, options.poles),
                                              geometry, again));
  }
  session.say(report::to_text(pages::modes_table(modes)));
  if (modes.frequency_scatter > 0) {
    session.say(fmt::format(
        "frequencies differ by {:.2g} % between FRFs (one standard deviation){}; the modes are their means",
        100 * modes.frequency_scatter,
        modes.damping_scatter > 0 ? fmt::format(", damping ratios by {:.2g} %", 100 * modes.damping_scatter) : ""));
  }
  for (const std::string& line : pages::amplitude_lines(modes)) session.say(line);
  session.say(fmt::format("reconstruction error {:.2f} % of the FRFs in {:.4g} to {:.4g} Hz{}",
                          100 * modes.reconstruction_error, modes.band_low, modes.band_high,
                          modes.noise_floor > 0 ? fmt::format("; their noise {:.2f} %", 100 * modes.noise_floor) : ""));
  if (!o->reference.empty()) {
    report::Table table = pages::change_table(modes, io::load<ModalModel>(o->reference));
    table.caption = "Against " + o->reference;
    session.say(report::to_text(table));
  }
  for (const std::string& file : o->figures)
    report::write_figure(pages::modes_figure(file, frf, modes, options.poles), file);
  session.result(to_json(modes));
  session.finish(modes.summary);
}

}  // namespace

void add_modes(CommandLine& app, Session& session) {
  auto o = std::make_shared<ModesOptions>();
  CommandLine* sub = add_command(
      app, session, "modes", "Natural frequencies, damping and residues from frequency responses (paper eq. 20)",
      "Input: JSON written by `whirl frf`, a universal file with frequency responses, or a CSV table of them with "
      "--kind;\n"
      "with --method fdd a record of responses (displacements or accelerations) to an unknown excitation.\n"
      "Output: every mode with its frequency (Hz) and damping ratio (%), each with its standard deviation, and the "
      "phase\n"
      "collinearity (MPC) of its shape; residues and residuals in the JSON.\n\n"
      "Example: whirl modes frf.json --band-low-hz 5 --band-high-hz 400 --out modes.json\n"
      "         whirl modes hit_x.json hit_y.json --figure shapes.svg",
      [o, &session] { find_modes(o.get(), session); });
  sub->add_option("FILES", o->files,
                  "frequency responses; several files: one per point hit, made with `whirl frf --reference`")
      ->input()
      ->required();
  sub->add_option("--out", o->out,
                  "write the modes as JSON, or (.uff) shapes and geometry as datasets 55, 15, 82, 2412")
      ->output("whirl.modes|universal file");
  sub->add_option("--select", o->modes.select,
                  "frequencies in Hz of the modes to take from the stabilisation diagram, and no others")
      ->range(1e-9, 1e9);
  sub->add_option("--geometry", o->geometry, "places of the points: universal file or TOML, for --page and --out x.uff")
      ->input();
  sub->add_option("--page,--html", o->page,
                  "page (.html) to look at: stabilisation diagram whose poles are added and removed by a click, moving "
                  "shapes, MAC, complexity, every FRF with its residual")
      ->output();
  o->responses.add_to(sub);
  sub->add_option(
      "--window-end-percent", o->window_end_percent,
      "files that do not state it: value of the exponential window at the end of the record; 100 = none. Its "
      "decay is taken off");
  sub->add_option(
         "--window", o->window,
         "files that do not state it: hann for FRFs averaged from random force through Hann windows; auto takes "
         "one off where the lines show it, with a warning; none leaves the lines as they are")
      ->one_of({"auto", "hann", "none"})
      ->show_default();
  sub->add_option("--method", o->method,
                  "start of the poles: plscf, lsce, era, or rfp for one response and few modes; fdd for a record "
                  "without the force")
      ->one_of({"plscf", "lsce", "era", "rfp", "fdd"})
      ->show_default();
  sub->add_option("--compare", o->reference,
                  "modes.json of an earlier test over the same points: change of frequency and MAC")
      ->input();
  sub->add_flag("--no-refine", o->no_refine,
                "what the method alone gives: no Gauss-Newton, no search, no standard deviations");
  sub->add_option("--figure", o->figures,
                  "stabilisation diagram; a file whose name holds 'frf' shows the fit, one with 'shape' the mode "
                  "shapes (.svg .png .pdf .csv)")
      ->output("figure");
  sub->add_option("--band-low-hz", o->low, "lower end of the band; 0 = first line")->range(0, 1e9);
  sub->add_option("--band-high-hz", o->high, "upper end of the band; 0 = last line")->range(0, 1e9);
}

}  // namespace whirl::app
