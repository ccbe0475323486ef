#include "response.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "whirl/core/angles.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/pages/steady_response.hpp"
#include "whirl/report/write_figure.hpp"

namespace whirl::app {
namespace {

struct ResponseFlags {
  std::string model, out, figure, data, peak_figure;
  double from_rpm = 0, to_rpm = 0;
  std::vector<double> at_rpm;
  pages::SteadyOptions steady;
};

void say_branches(const pages::SteadyResponse& found, const ResponseFlags& o, Session& session) {
  for (const response::ResponseCurve& other : found.branches)
    session.say(
        fmt::format("second branch      {} at {:.0f} rpm, where a run-down begins: it joins the curve beyond the range",
                    found.amplitude_text(found.amplitude(other.points.front().solution)), o.to_rpm));
  for (const response::ResponseCurve& isola : found.isolas) {
    double low = INFINITY, high = 0, most = 0;
    for (const response::CurvePoint& p : isola.points) {
      low = std::min(low, p.solution.omega);
      high = std::max(high, p.solution.omega);
      most = std::max(most, found.amplitude(p.solution));
    }
    session.say(
        fmt::format("isola              {:.2f} to {:.2f} rpm, up to {}: apart from the curve, reached by an impact",
                    low / kRadPerSecPerRpm, high / kRadPerSecPerRpm, found.amplitude_text(most)));
  }
  if (o.steady.isolas && found.isolas.empty()) session.say("isolas             none found");
}

/// What was asked for first: every response at the speeds stated.
void say_answers(const pages::SteadyResponse& found, Session& session) {
  for (const pages::SteadyAnswer& a : found.answers) {
    const bool beyond = !found.known.holds(a.amplitude, a.omega);
    session.say(fmt::format("at {:<15} {} ({}{})", fmt::format("{:g} rpm", a.omega / kRadPerSecPerRpm),
                            found.amplitude_text(a.amplitude), a.stable ? "stable" : "unstable",
                            beyond ? "; beyond the records, not to be trusted" : ""));
  }
}

/// Peak, band, folds and branch points of all curves.
void say_curve(const pages::SteadyResponse& found, Session& session) {
  std::vector<const response::ResponseCurve*> curves{&found.curve};
  for (const auto* others : {&found.branches, &found.isolas})
    for (const response::ResponseCurve& other : *others) curves.push_back(&other);
  const response::CurvePoint *peak = nullptr, *stable = nullptr;
  std::size_t points = 0, unstable = 0;
  const auto size = [&](const response::CurvePoint* p) { return p == nullptr ? -1 : found.amplitude(p->solution); };
  for (const response::ResponseCurve* curve : curves) {
    for (const response::CurvePoint& p : curve->points) {
      if (size(&p) > size(peak)) peak = &p;
      if (p.stable && size(&p) > size(stable)) stable = &p;
      ++points;
      unstable += !p.stable;
    }
  }
  const auto say_largest = [&](const char* what, const response::CurvePoint& p, const char* note) {
    session.say(fmt::format("{:<18} {} at {:.0f} rpm{}", what, found.amplitude_text(found.amplitude(p.solution)),
                            p.solution.omega / kRadPerSecPerRpm, note));
  };
  say_largest("largest response", *peak, peak->stable ? "" : " (unstable there)");
  if (stable != nullptr && stable != peak) say_largest("largest stable one", *stable, "");
  if (found.band)
    session.say(fmt::format("95 % interval      {} to {} (over the model's covariance)",
                            found.amplitude_text(found.band->peak_low), found.amplitude_text(found.band->peak_high)));
  for (const response::ResponseCurve* curve : curves)
    for (const response::CurveEvent& e : curve->events)
      session.say(fmt::format("{:<18} {:.2f} rpm, {}", to_string(e.kind), e.solution.omega / kRadPerSecPerRpm,
                              found.amplitude_text(found.amplitude(e.solution))));
  session.say(fmt::format("points             {}, {} of them unstable", points, unstable));
}

void run(ResponseFlags o, Session& session) {
  // One speed needs no range: its answers are on the curve from far below to a little above.
  if (!o.at_rpm.empty() && o.from_rpm == 0) o.from_rpm = std::ranges::min(o.at_rpm) / 4;
  if (!o.at_rpm.empty() && o.to_rpm == 0) o.to_rpm = 1.25 * std::ranges::max(o.at_rpm);
  for (const double rpm : o.at_rpm) o.steady.at.push_back(rpm * kRadPerSecPerRpm);
  o.steady.curve.from = o.from_rpm * kRadPerSecPerRpm;
  o.steady.curve.to = o.to_rpm * kRadPerSecPerRpm;
  const IdentifiedModel model = io::load<IdentifiedModel>(o.model);
  Summary refused;
  take_parts(identification::Consumer::response, model, refused, o.model);  // here the error names the file
  if (!o.data.empty()) {
    o.steady.known = identification::data_range({io::read_recording(o.data)});
  } else if (o.steady.input.empty()) {
    o.steady.known = identification::load_data_range(o.model);
  }
  const pages::SteadyResponse found = pages::steady_response(model, o.steady);
  if (found.curve.points.empty()) {
    session.finish(found.summary);
    return;
  }
  if (found.peaks)
    session.say(std::isnan(found.peaks->jump_from)
                    ? fmt::format("slow sweeps        no jump up to {:g} times this forcing", o.steady.peaks_to)
                    : fmt::format("slow sweeps        jump from {:.3g} times this forcing on", found.peaks->jump_from));
  say_answers(found, session);
  say_branches(found, o, session);
  say_curve(found, session);
  const io::Json json = to_json(found);
  session.result(json);
  session.write_together();
  if (o.out.ends_with(".csv")) {
    io::write_text(o.out, pages::steady_csv(found));
  } else if (!o.out.empty()) {
    io::save_json(o.out, json);
  }
  if (!o.peak_figure.empty()) report::write_figure(pages::steady_peak_figure(found), o.peak_figure);
  if (!o.figure.empty()) report::write_figure(pages::steady_figure(found), o.figure);
  session.finish(found.summary);
}

}  // namespace

void add_response(CommandLine& app, Session& session) {
  auto o = std::make_shared<ResponseFlags>();
  CommandLine* sub = add_command(
      app, session, "response", "Steady response of a model over speed, without simulation",
      "Input: model.json of `whirl identify`. Harmonic balance with arclength continuation: every response, stable or "
      "not,\n"
      "folds and branch points. Without --input the rotor turns and its unbalance is the forcing; with --input the "
      "named\n"
      "input is amplitude * cos(Omega t), with --base the support moves so and the rotor stands still. Dotted: beyond "
      "the\n"
      "amplitude and speed of the records of the model, or of --data.\n\n"
      "Example: whirl response model.json --from-rpm 300 --to-rpm 2000 --data rundown.csv --figure response.svg\n"
      "Example: whirl response model.json --at-rpm 1800",
      [o, &session] { run(*o, session); });
  sub->add_option("MODEL", o->model, "model.json")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "where the curve starts (60 rpm is 1 Hz)")->range(1e-6, 1e9);
  sub->add_option("--to-rpm", o->to_rpm, "where it ends")->range(1e-6, 1e9);
  sub->add_option("--at-rpm", o->at_rpm, "every response at these speeds, as 1500,1800; with or without a range")
      ->range(1e-6, 1e9)
      ->delimiter(',');
  sub->add_option("--input", o->steady.input, "name of the input that forces the model; default: the unbalance");
  sub->add_option("--base", o->steady.base,
                  "coordinate (x, y of a rotor) along which the support moves; amplitudes are read against the support")
      ->excludes("--input");
  sub->add_option("--amplitude", o->steady.amplitude, "of the input or the support, 0 to peak, in its unit (m)")
      ->range(0, 1e15)
      ->needs("--input", "--base");
  sub->add_option("--coordinate", o->steady.coordinate,
                  "whose amplitude is stated; default: the radius of a rotor, --base, or the first");
  sub->add_option("--unbalance", o->steady.unbalance, "times the identified eccentricity")
      ->range(0, 1e9)
      ->show_default();
  sub->add_option("--harmonics", o->steady.curve.harmonics, "to start with; more where the spectrum requires it")
      ->range(1, 50)
      ->show_default();
  sub->add_option("--data", o->data, "record with x, y, beta that the model was found from")->input();
  sub->add_flag("--isolas", o->steady.isolas,
                "look for closed curves apart from this one (over the forcing at 25 speeds)");
  sub->add_option("--peaks-to", o->steady.peaks_to,
                  "peak of slow sweeps for forcings up to this many times the stated one")
      ->range(0, 1e6);
  sub->add_option("--peak-figure", o->peak_figure, "the peaks over the forcing (.svg, .png, .pdf, .csv)")
      ->output()
      ->needs("--peaks-to");
  sub->add_option("--out", o->out, "write the curve as JSON, or with the ending .csv as a table (rpm, amp, phase_deg)")
      ->output("whirl.response|table");
  sub->add_option("--figure", o->figure, "amplitude and phase over speed (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
