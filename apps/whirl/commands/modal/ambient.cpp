#include "ambient.hpp"

#include <fmt/format.h>

#include <filesystem>

#include "commands/machine/record_options.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/provenance.hpp"
#include "whirl/modal/order_modes.hpp"
#include "whirl/pages/text/modes.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

struct AmbientOptions {
  std::vector<std::string> files, figures;
  std::string out, method = "ssi-data", merge;
  int orders = -1;  // not stated: none to subtract, the first one to use
  RecordOptions record;
  modal::OmaOptions oma;
};

modal::SetupsOptions setups_of(const AmbientOptions& o) {
  modal::SetupsOptions options{.method = o.method, .joint = o.merge == "pre", .orders = {}, .oma = o.oma};
  if (o.orders >= 0) options.orders = o.orders;
  return options;
}

/// Of a record at changing speed, whose motion is that of a sweep.
std::string changing_speed(const Recording& record) {
  // A speed that wanders with a deviation of 1 % stays within a tenth for hours; its orders are subtracted.
  constexpr double kWanders = 1.2;
  const std::optional<diagnosis::Rotation> turning = [&]() -> std::optional<diagnosis::Rotation> {
    try {
      return diagnosis::rotation_of(record);
    } catch (const Error&) {
      return std::nullopt;
    }
  }();
  if (!turning || turning->speed.maxCoeff() < kWanders * turning->speed.minCoeff()) return "";
  return fmt::format(
      "{0}: the speed changes from {1:.0f} to {2:.0f} rpm, which excites no mode broadly: these modes may be none; "
      "`whirl transient {0}` takes modes from the 1X of a run",
      record.source, turning->speed[0] / kRadPerSecPerRpm,
      turning->speed[turning->speed.size() - 1] / kRadPerSecPerRpm);
}

void run_oma(const AmbientOptions& o, Session& session) {
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
  std::vector<Recording> records;
  for (const std::string& file : o.files) records.push_back(o.record.read(file));
  modal::OperationalModes found = modal::identify_setups(records, setups_of(o));
  if (o.method != "orders")
    for (const Recording& record : records)
      if (const std::string said = changing_speed(record); !said.empty()) found.summary.warn(said);
  io::Json document = pages::to_json(found);
  document.set("provenance", io::to_json(io::provenance({o.files.begin(), o.files.end()}, session.command_line)));
  session.write_together();
  if (!o.out.empty()) io::save_json(o.out, document);
  for (const std::string& file : o.figures) report::write_figure(pages::shapes_figure(found), file);
  session.say(report::to_text(pages::modes_table(found)));
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
  const io::Json json = pages::to_json(found);
  session.write_together();
  if (!out.empty()) io::save_json(out, json);
  for (const std::string& file : figures) report::write_figure(pages::singular_values_figure(found), file);
  session.say(report::to_text(pages::modes_table(found)));
  session.result(json);
  session.finish(found.summary);
}

void add_oma(CommandLine& app, Session& session) {
  auto o = std::make_shared<AmbientOptions>();
  CommandLine* sub = add_command(
      app, session, "oma", "Modes from records under operation: the force is not measured",
      "Input: a record of responses of one quantity (accelerations, velocities or displacements) under broad-band\n"
      "excitation; several records are set-ups that share channel names (reference sensors): --merge pre makes one\n"
      "model of them, --merge post joins the modes of each.\n"
      "Output: frequencies (Hz) and damping ratios (%) with standard deviations, shapes in the JSON. Tones and orders "
      "are\n"
      "told from modes, subtracted and listed apart, also where the speed wanders by up to 1 % and no tacho was "
      "measured.\n\n"
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
                  "the record (beta_rad); without it, those that the record shows")
      ->range(0.0, 20.0);
  sub->add_option("--harmonic-hz", o->oma.tones, "known tones to subtract, e.g. the running speed and its multiples")
      ->range(1e-6, 1e9);
  o->record.add_to(sub);
}

}  // namespace whirl::app
