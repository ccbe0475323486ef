#include "ambient.hpp"

#include <cmath>
#include <filesystem>

#include "commands/machine/record_options.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/modal/checks.hpp"
#include "whirl/modal/oma.hpp"
#include "whirl/modal/order_modes.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

io::Json shape_json(const Eigen::VectorXcd& shape) {
  io::Json json = io::Json::object();
  json.set("re", io::Json(shape.real())).set("im", io::Json(shape.imag()));
  return json;
}

// Singular values of the spectral matrix over frequency, modes marked.
report::Figure singular_values(const modal::AmbientModes& found) {
  std::vector<report::SpectrumCurve> curves;
  for (Eigen::Index c = 0; c < std::min<Eigen::Index>(3, found.singular_values.cols()); ++c) {
    curves.push_back({fmt::format("singular value {}", c + 1), found.frequency.tail(found.frequency.size() - 1),
                      found.singular_values.col(c).tail(found.frequency.size() - 1).cwiseSqrt()});
  }
  std::vector<std::pair<std::string, double>> marks;
  for (const modal::AmbientMode& mode : found.modes)
    marks.emplace_back(fmt::format("{:.4g}", mode.frequency), mode.frequency);
  return report::spectrum(curves, AmplitudeKind::rms, Quantity::displacement, marks);
}

report::Figure shape_figure(const modal::OperationalModes& found) {
  Eigen::MatrixXcd shapes(static_cast<Eigen::Index>(found.channels.size()),
                          static_cast<Eigen::Index>(found.modes.size()));
  std::vector<Mode> modes;
  for (std::size_t i = 0; i < found.modes.size(); ++i) {
    shapes.col(static_cast<Eigen::Index>(i)) = found.modes[i].shape;
    Mode mode;
    mode.frequency = found.modes[i].frequency;
    mode.damping = found.modes[i].damping;
    modes.push_back(std::move(mode));
  }
  return report::mode_shapes(found.channels, shapes, modes);
}

io::Json to_document(const modal::OperationalModes& found) {
  io::Json json = io::start_document("whirl.operational_modes", 1);
  io::Json modes = io::Json::array(), tones = io::Json::array();
  for (const modal::OperationalMode& mode : found.modes) {
    io::Json entry = io::Json::object();
    entry.set("frequency", io::to_json(mode.frequency, "Hz")).set("damping", io::to_json(mode.damping, "1"));
    entry.set("mpc", modal::mode_complexity(mode.shape).mpc).set("orders", mode.orders);
    entry.set("shape", shape_json(mode.shape));
    modes.push(std::move(entry));
  }
  for (const modal::Tone& tone : found.tones) {
    io::Json entry = io::Json::object();
    entry.set("frequency_hz", tone.frequency).set("kurtosis", tone.kurtosis).set("evidence", tone.evidence);
    if (tone.amplitude.size() > 0) entry.set("amplitude_peak", io::Json(tone.amplitude));
    tones.push(std::move(entry));
  }
  json.set("channels", found.channels).set("modes", std::move(modes)).set("harmonics", std::move(tones));
  return json;
}

struct Options {
  std::vector<std::string> files, figures;
  std::string out, method = "ssi-data", merge;
  int orders = -1;  // not stated: none to subtract, the first one to use
  RecordOptions record;
  modal::OmaOptions oma;
};

modal::OperationalModes join_before(const Options& o, const modal::OmaOptions& options) {
  std::vector<Recording> records;
  for (const std::string& file : o.files) records.push_back(o.record.read(file));
  return modal::identify_joint(records, options);
}

void run_oma(const Options& o, Session& session) {
  require_json_name(o.out);
  if (o.merge == "pre" && o.method != "ssi-data" && o.method != "ssi-cov")
    throw Error::in_field("--merge", o.merge, "--method ssi-data or ssi-cov with it, or --merge post");
  if (o.method == "efdd") {
    if (o.files.size() > 1)
      throw Error::in_field("FILES", fmt::format("{} files", o.files.size()), "one record with --method efdd");
    show_fdd(o.record.read(o.files[0]), {.band_low = o.oma.band_low, .band_high = o.oma.band_high}, o.out, o.figures,
             session);
    return;
  }
  modal::OmaOptions options = o.oma;
  options.orders = std::max(0, o.orders);
  options.method = o.method == "ssi-data" ? modal::SubspaceMethod::data : modal::SubspaceMethod::covariance;
  const auto identify = [&](const Recording& record) {
    if (o.method != "orders") return modal::identify_operational(record, options);
    return modal::identify_orders(
        record, {.orders = o.orders < 0 ? 1 : o.orders, .band_low = options.band_low, .band_high = options.band_high});
  };
  const modal::OperationalModes found = [&] {
    if (o.merge == "pre") return join_before(o, options);
    std::vector<modal::OperationalModes> setups;
    for (const std::string& file : o.files) setups.push_back(identify(o.record.read(file)));
    return setups.size() == 1 ? setups.front() : modal::merge_setups(setups);
  }();
  report::Table table;
  table.caption = "Modes under operational excitation";
  table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"± sd", "Hz"}, {"damping", "%"}, {"± sd", "%"}, {"MPC", ""}};
  for (const modal::OperationalMode& mode : found.modes) {
    table.add({fmt::format("{}", table.rows.size() + 1), fmt::format("{:.4f}", mode.frequency.value),
               fmt::format("{:.2g}", mode.frequency.sd), fmt::format("{:.3f}", 100 * mode.damping.value),
               fmt::format("{:.2g}", 100 * mode.damping.sd),
               fmt::format("{:.3f}", modal::mode_complexity(mode.shape).mpc)});
  }
  for (const modal::Tone& tone : found.tones)
    table.add({"harmonic", fmt::format("{:.4f}", tone.frequency), "-", "-", "-", "-"});
  io::Json document = to_document(found);
  document.set("summary", io::to_json(found.summary));
  document.set("provenance", io::to_json(io::provenance({o.files.begin(), o.files.end()}, session.command_line)));
  session.write_together();
  if (!o.out.empty()) io::save_json(o.out, document);
  for (const std::string& file : o.figures) report::write_figure(shape_figure(found), file);
  session.say(report::to_text(table));
  session.result(document);
  session.finish(found.summary);
}

}  // namespace

void require_json_name(const std::string& file) {
  if (file.empty()) return;
  std::filesystem::path path(file);
  if (path.extension() == ".gz") path.replace_extension();
  if (!path.extension().empty() && path.extension() != ".json")
    throw Error::in_field("--out", file, "a name that ends in .json or .json.gz: the modes are written as JSON");
}

void show_fdd(const Recording& record, const modal::FddOptions& options, const std::string& out,
              const std::vector<std::string>& figures, Session& session) {
  const modal::AmbientModes found = modal::decompose_ambient(record, options);
  report::Table table;
  table.caption = "Modes under ambient excitation";
  table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"damping", "%"}, {"MPC", ""}};
  io::Json json = io::start_document("whirl.ambient_modes", 1);
  io::Json::Array modes;
  for (const modal::AmbientMode& mode : found.modes) {
    table.add({fmt::format("{}", table.rows.size() + 1), fmt::format("{:.4f}", mode.frequency),
               std::isnan(mode.damping) ? "-" : fmt::format("{:.3f}", 100 * mode.damping),
               fmt::format("{:.3f}", modal::mode_complexity(mode.shape).mpc)});
    io::Json entry = io::Json::object();
    entry.set("frequency", mode.frequency).set("damping", mode.damping).set("shape", shape_json(mode.shape));
    modes.push_back(std::move(entry));
  }
  json.set("channels", found.channels).set("modes", std::move(modes));
  session.write_together();
  if (!out.empty()) io::save_json(out, json);
  for (const std::string& file : figures) report::write_figure(singular_values(found), file);
  session.say(report::to_text(table));
  session.result(json);
  session.finish(found.summary);
}

void add_oma(CommandLine& app, Session& session) {
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "oma", "Modes from records under operation: the force is not measured",
      "Input: a record of responses of one quantity (accelerations, velocities or displacements) under broad-band\n"
      "excitation; several records are set-ups that share channel names (reference sensors): --merge pre makes one\n"
      "model of them, --merge post joins the modes of each.\n"
      "Output: frequencies (Hz) and damping ratios (%) with standard deviations, shapes in the JSON; tones of the\n"
      "running speed are told from modes, subtracted and listed apart.\n\n"
      "Example: whirl oma ambient.csv --out modes.json --figure shapes.svg\n"
      "         whirl oma run_up.csv --method orders --orders 2",
      [o, &session] { run_oma(*o, session); });
  sub->add_option("FILES", o->files, "records of responses; several: set-ups to merge")->input()->required();
  sub->add_option("--out", o->out, "write the modes as JSON")->output("whirl.operational_modes");
  sub->add_option("--figure", o->figures, "mode shapes, or with efdd the singular values (.svg .png .pdf .csv)")
      ->output();
  sub->add_option("--method", o->method,
                  "ssi-data, ssi-cov, efdd, or orders: the 1X, 2X, ... of a run-up or run-down by the rotor's angle "
                  "(beta_rad), of "
                  "which --orders says how many")
      ->one_of({"ssi-data", "ssi-cov", "efdd", "orders"})
      ->show_default();
  sub->add_option(
         "--merge", o->merge,
         "several set-ups: post (default), modes of each set-up joined by their shared channels, or pre, one "
         "model of all records (PreGER): sharper where modes lie close, but the structure must not have changed")
      ->one_of({"post", "pre"});
  sub->add_option("--band-low-hz", o->oma.band_low, "lower end of the band")->range(0, 1e9);
  sub->add_option("--band-high-hz", o->oma.band_high, "upper end of the band")->range(0, 1e9);
  sub->add_option("--order", o->oma.max_order, "largest model order (states); 0 = by the channels")->range(0, 1000);
  sub->add_option("--orders", o->orders,
                  "multiples of the running speed to subtract (with --method orders: to use), by the rotor's angle in "
                  "the record (beta_rad), however "
                  "the speed wanders")
      ->range(0.0, 20.0);
  sub->add_option("--harmonic-hz", o->oma.tones, "known tones to subtract, e.g. the running speed and its multiples")
      ->range(1e-6, 1e9);
  o->record.add_to(sub);
}

}  // namespace whirl::app
