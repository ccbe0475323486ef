#include "nonlinear_mode.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <exception>

#include "commands/machine/record_options.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/outputs.hpp"
#include "whirl/io/units.hpp"
#include "whirl/pages/bode_table.hpp"
#include "whirl/pages/nonlinear_mode.hpp"
#include "whirl/records/channel_damage.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

struct NonlinearModeOptions {
  RecordOptions record;
  std::string input, channel, force_channel, out, json, figure, phase;
  std::vector<std::string> inputs;
  response::SweptSineOptions sweep;
  response::DecayOptions decay;
};

/// Units of the mode's terms, by the unit u of the motion: cubic stiffness is in 1/(u^2 s^2).
std::string term_unit(std::string_view term, Quantity q) {
  const std::string u{si_unit(q)}, base = u.find_first_of(" /^") == std::string::npos ? u : "(" + u + ")";
  if (term == "k3") return fmt::format("1/({}^2 s^2)", base);
  if (term == "k5") return fmt::format("1/({}^4 s^2)", base);
  if (term == "q") return "1/" + base;
  return base + "/s^2";  // f
}

void say_mode(Session& session, const response::NonlinearMode& m, Quantity q) {
  const auto at = [&](double a) {
    return fmt::format("{:.5g} Hz, damping {:.3g} %", m.frequency(a) / kTwoPi, 100 * m.rate(a) / m.frequency(a));
  };
  const auto peak = [&](double a) { return report::format_amplitude(a, AmplitudeKind::peak, q); };
  session.say(fmt::format("at the smallest    {} ({})", at(m.lowest), peak(m.lowest)));
  session.say(fmt::format("at the largest     {} ({})", at(m.highest), peak(m.highest)));
  for (const auto& [name, e, text] : {std::tuple{"k1", &m.k1, std::string("stiffness / mass, 1/s^2")},
                                      {"k3", &m.k3, "cubic stiffness / mass, " + term_unit("k3", q)},
                                      {"k5", &m.k5, "quintic stiffness / mass, " + term_unit("k5", q)},
                                      {"c", &m.c, "linear damping / mass, 1/s"},
                                      {"q", &m.q, "quadratic damping / mass, " + term_unit("q", q)},
                                      {"f", &m.f, "dry friction / mass, " + term_unit("f", q)}})
    if (e->value != 0)
      session.say(
          fmt::format("{:<18} {:.5g} ± {:.2g}  [{:.5g}, {:.5g}]  {}", name, e->value, e->sd, e->low, e->high, text));
}

void finish(const NonlinearModeOptions& o, Session& session, const response::NonlinearMode& mode,
            const response::DecayCurve& curve, const Estimate& gain, const report::Figure& figure, Quantity quantity) {
  say_mode(session, mode, quantity);
  const io::Json json = pages::to_json(mode, curve, gain);
  session.result(json);
  session.write_together();
  if (!o.json.empty()) io::save_json(o.json, json);
  if (!o.out.empty()) io::save(o.out, mode.model());
  if (!o.figure.empty()) report::write_figure(figure, o.figure);
  Summary summary = mode.summary;
  if (!summary.trust.empty())
    summary.trust = fmt::format("one mode at amplitudes from {} to {}; beyond is extrapolation",
                                report::format_amplitude(mode.lowest, AmplitudeKind::peak, quantity),
                                report::format_amplitude(mode.highest, AmplitudeKind::peak, quantity));
  session.finish(summary);
}

void run_decay(const NonlinearModeOptions& o, Session& session) {
  const Recording record = o.record.read(o.input);
  const Channel* channel = o.channel.empty() ? &record.channels.front() : record.find(o.channel);
  if (channel == nullptr) throw Error::in_field("--channel", o.channel, "a channel of the record");
  records::ChannelDamage damage = records::channel_damage(record, channel->name);
  response::DecayOptions options = o.decay;
  options.usable = std::move(damage.usable);
  const response::DecayCurve curve = response::decay_curve(channel->samples, record.dt, options);
  response::NonlinearMode mode = response::fit_decay(curve);
  for (std::string& warning : damage.warnings(record, curve.from, curve.to)) mode.summary.warn(std::move(warning));
  session.say(fmt::format("decay              {} from {:.4g} to {:.4g} s, {}, {} left over", channel->name, curve.from,
                          curve.to, counted(curve.points.size(), "window"),
                          report::format_amplitude(curve.noise, AmplitudeKind::rms, channel->quantity)));
  const bool length = channel->quantity == Quantity::displacement;
  finish(o, session, mode, curve, {},
         pages::decay_figure(curve, mode,
                             length ? report::engineering_unit(Quantity::displacement, mode.highest) : report::Unit{}),
         channel->quantity);
}

/// The table of a sine test, and its column of phases: phase, or phase_lag or phase_lead.
std::pair<io::Table, std::string> steady_table(const NonlinearModeOptions& o, const std::string& file) {
  io::CsvOptions options = o.record.csv();
  options.required = {"frequency_Hz", "force_N", "amplitude_mm", "phase_deg"};
  std::exception_ptr missing;  // of the usual name
  for (const char* column : {"phase", "phase_lag", "phase_lead"}) {
    options.required.back() = std::string(column) + "_deg";
    try {
      return {io::read_table(file, options), column};
    } catch (const MissingColumn& e) {
      if (e.column() != column) throw;
      if (!missing) missing = std::current_exception();
    }
  }
  std::rethrow_exception(missing);
}

/// Points of a table of steady-state responses, or windows of a record with a swept sine.
void add_points(const NonlinearModeOptions& o, const std::string& file, std::vector<response::SteadyPoint>& points,
                std::vector<std::string>& warnings, Session& session) {
  if (io::file_kind(file) == "table") {
    const auto [table, phase] = steady_table(o, file);
    const double sign = pages::phase_sign(phase, o.phase);
    for (Eigen::Index k = 0; k < table.rows(); ++k)
      points.push_back(
          {kTwoPi * table["frequency"][k], table["force"][k], table["amplitude"][k], sign * table[phase][k]});
    return;
  }
  if (!o.phase.empty()) throw Error::in_field("--phase", o.phase, "left out: " + file + " is a record");
  const Recording record = o.record.read(file);
  const auto channel = [&](const std::string& flag, const std::string& name) -> const Channel& {
    const Channel* found = record.find(name);
    if (found == nullptr) throw Error::in_field(flag, name, "a channel of " + file);
    return *found;
  };
  const Channel& force = channel("--force-channel", o.force_channel.empty() ? "force" : o.force_channel);
  const Channel* answer = o.channel.empty() ? nullptr : &channel("--channel", o.channel);
  for (const Channel& c : record.channels)
    if (answer == nullptr && &c != &force) answer = &c;
  if (answer == nullptr) throw Error(file + ": a channel with the answer is needed beside the force");
  for (const auto& [c, wanted] : {std::pair{&force, Quantity::force}, {answer, Quantity::displacement}})
    if (c->quantity != wanted) throw Error(file + ": " + io::quantity_problem(c->name, c->quantity, wanted));
  response::SweptSineOptions options = o.sweep;
  records::ChannelDamage of_force = records::channel_damage(record, force.name),
                         of_answer = records::channel_damage(record, answer->name);
  options.force_usable = std::move(of_force.usable);
  options.usable = std::move(of_answer.usable);
  for (const records::ChannelDamage* damage : {&of_force, &of_answer}) {
    const auto told = damage->warnings(record, 0, record.dt * static_cast<double>(record.size()));
    warnings.insert(warnings.end(), told.begin(), told.end());
  }
  const std::vector<response::SteadyPoint> swept =
      response::swept_sine_points(force.samples, answer->samples, record.dt, options);
  const auto [low, high] =
      std::minmax_element(swept.begin(), swept.end(), [](const auto& a, const auto& b) { return a.omega < b.omega; });
  session.say(fmt::format("swept sine         {}: {} windows of {} over {}, {:.4g} to {:.4g} Hz, force {:.4g} N peak",
                          file, swept.size(), answer->name, force.name, low->omega / kTwoPi, high->omega / kTwoPi,
                          swept.front().level));
  points.insert(points.end(), swept.begin(), swept.end());
}

void run_sine(const NonlinearModeOptions& o, Session& session) {
  std::vector<response::SteadyPoint> points;
  std::vector<std::string> warnings;
  for (const std::string& file : o.inputs) add_points(o, file, points, warnings, session);
  Estimate gain;
  response::NonlinearMode mode = response::fit_steady(points, gain);
  for (std::string& warning : warnings) mode.summary.warn(std::move(warning));
  session.say(fmt::format("sine test          {} points; gain {:.4g} ± {:.2g} m/s^2 per newton: modal mass {:.4g} kg",
                          points.size(), gain.value, gain.sd, 1 / gain.value));
  finish(o, session, mode, {}, gain, pages::steady_figure(points, mode, gain.value), Quantity::displacement);
}

void add_outputs(CommandLine* sub, const std::shared_ptr<NonlinearModeOptions>& o) {
  sub->add_option("--out", o->out, "write the mode as a model")->output("whirl.model");
  sub->add_option("--points", o->json, "write points and parameters as JSON")->output("whirl.decay");
  sub->add_option("--figure", o->figure, "measured and fitted (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace

void add_nonlinear_mode(CommandLine& app, Session& session) {
  auto decay = std::make_shared<NonlinearModeOptions>();
  CommandLine* sub = add_command(
      app, session, "decay", "Backbone and damping over amplitude from a free decay",
      "Input: a record of one mode that dies out after an impact or after a drive is switched off. Windows of a few "
      "periods\n"
      "give frequency and rate of decay with their scatter; the mode found from them is linear unless the windows ask\n"
      "for cubic or quintic stiffness, quadratic damping or dry friction. Its model has the force per unit mass as "
      "input.\n\n"
      "Example: whirl decay ringdown.csv --channel x --out mode.json --figure backbone.svg",
      [decay, &session] { run_decay(*decay, session); });
  sub->add_option("RECORD", decay->input, "CSV, MAT, HDF5, UFF, WAV, LVM, ...")->input()->required();
  sub->add_option("--channel", decay->channel, "which; default: the first");
  sub->add_option("--from", decay->decay.from, "s; default: where the amplitude begins to fall")->range(0, 1e9);
  sub->add_option("--to", decay->decay.to, "s; default: where it is lost in the noise")->range(0, 1e9);
  sub->add_option("--periods", decay->decay.periods, "in a window")->range(3, 1000)->show_default();
  decay->record.add_to(sub);
  add_outputs(sub, decay);

  auto sine = std::make_shared<NonlinearModeOptions>();
  CommandLine* steady = add_command(
      app, session, "sine", "One nonlinear mode from stepped or swept sine at several force levels",
      "Input: a table frequency_Hz, force_N, amplitude_mm, phase_deg, one row a steady point: amplitudes peak, phase "
      "of the\n"
      "displacement against the force (lead > 0; about -90 deg at resonance; phase_lag_deg or --phase lag for a lag). "
      "Or records with the channels force and\n"
      "displacement while the sine is swept, up or down: windows of a few periods, the sweep accounted for. Two or "
      "more\n"
      "force levels tell the nonlinearity and the modal mass.\n\n"
      "Example: whirl sine stepped.csv --out mode.json --figure sine.svg\n"
      "Example: whirl sine up_5N.csv up_20N.csv down_20N.csv --force-channel force --channel x --out mode.json",
      [sine, &session] { run_sine(*sine, session); });
  steady->add_option("INPUT", sine->inputs, "tables or records")->input()->required();
  steady->add_option("--force-channel", sine->force_channel, "records: channel of the force; default: force");
  steady->add_option("--channel", sine->channel, "records: channel of the displacement; default: the first other one");
  steady->add_option("--phase", sine->phase, "of a table headed phase_deg: phases are lag or lead [lead]")
      ->one_of({"lag", "lead"});
  steady->add_option("--periods", sine->sweep.periods, "records: in a window")->range(3, 1000)->show_default();
  sine->record.add_to(steady);
  add_outputs(steady, sine);
}

}  // namespace whirl::app
