#include "response.hpp"

#include <array>
#include <cmath>
#include <numbers>

#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/response/continuation.hpp"
#include "whirl/response/sweep_peaks.hpp"
#include "whirl/response/synchronous.hpp"

namespace whirl::app {
namespace {

using Eigen::Index;
constexpr double kRpm = std::numbers::pi / 30;

struct Options {
  std::string model, input, out, figure, data, peak_figure;
  bool isolas = false;
  double peaks_to = 0;
  double from_rpm = 0, to_rpm = 0, amplitude = 0, unbalance = 1;
  int harmonics = 5;
};

/// What the curve is drawn as: the radius of a rotor, the first coordinate otherwise.
struct Drawn {
  bool rotor = false;
  std::string coordinate;
  double amplitude(const response::PeriodicSolution& s) const {
    return rotor ? response::ResponseCurve::radius(s) : response::ResponseCurve::peak(s, 0);
  }
};

/// Range of a record that the model was found from: beyond it the curve is extrapolation.
struct Known {
  double amplitude = INFINITY, low = 0, high = INFINITY;
  bool holds(double a, double omega) const { return a <= amplitude && omega >= low && omega <= high; }
};

Known known_range(const std::string& file) {
  Known k;
  if (file.empty()) return k;
  const Recording record = io::read_csv(file);
  const Eigen::VectorXd &x = record["x"], &y = record["y"], &beta = record["beta"];
  k.amplitude = ((x.array() - x.mean()).square() + (y.array() - y.mean()).square()).sqrt().maxCoeff();
  // Mean speed over fiftieths of the record: an encoder's steps do not count.
  const Index block = std::max<Index>(1, beta.size() / 50);
  k.low = INFINITY;
  k.high = 0;
  for (Index i = 0; i + block < beta.size(); i += block) {
    const double speed = std::abs(beta[i + block] - beta[i]) / (static_cast<double>(block) * record.dt);
    k.low = std::min(k.low, speed);
    k.high = std::max(k.high, speed);
  }
  return k;
}

/// Runs of one kind (stable or not, known or extrapolated), joined at their ends, as lines of the panel.
void add_lines(report::Panel& panel, const std::vector<double>& x, const std::vector<double>& y,
               const std::vector<int>& kind, std::array<bool, 4>& named) {
  static const char* const names[] = {"stable", "unstable", "stable, beyond the data", "unstable, beyond the data"};
  for (std::size_t i = 0; i + 1 < x.size();) {
    std::size_t j = i + 1;
    while (j + 1 < x.size() && kind[j] == kind[i]) ++j;
    const auto n = static_cast<Index>(j - i + 1);
    const auto k = static_cast<std::size_t>(kind[i]);
    panel.line(named[k] ? "" : names[k], Eigen::Map<const Eigen::VectorXd>(x.data() + i, n),
               Eigen::Map<const Eigen::VectorXd>(y.data() + i, n),
               {.color = k % 2 == 0 ? 0 : 1,
                .width = 1.6,
                .dash = k >= 2   ? report::Dash::dotted
                        : k == 1 ? report::Dash::dashed
                                 : report::Dash::solid});
    named[k] = true;
    i = j;
  }
}

report::Figure figure_of(const response::ResponseCurve& curve, const std::vector<response::ResponseCurve>& isolas,
                         const Drawn& drawn, const Known& known, const std::optional<RotorModel>& rotor,
                         const std::optional<response::SynchronousBand>& band) {
  report::Figure figure;
  figure.title = "Steady response";
  figure.description = "Amplitude and phase of the steady response over speed, with stability and folds.";
  figure.shared_x = true;
  std::vector<double> x, y, phase;
  std::vector<int> kind;
  double largest = 0;
  for (const response::CurvePoint& p : curve.points) {
    x.push_back(p.solution.omega);
    y.push_back(drawn.amplitude(p.solution));
    phase.push_back(std::arg(p.solution.harmonic(0, 1)));
    if (phase.size() > 1)
      while (phase.back() - phase[phase.size() - 2] > std::numbers::pi) phase.back() -= 2 * std::numbers::pi;
    if (phase.size() > 1)
      while (phase.back() - phase[phase.size() - 2] < -std::numbers::pi) phase.back() += 2 * std::numbers::pi;
    kind.push_back((p.stable ? 0 : 1) + (known.holds(y.back(), x.back()) ? 0 : 2));
    largest = std::max(largest, y.back());
  }
  const report::Axis speed{"speed", {"rpm", kRpm}};
  const report::Unit unit = drawn.rotor ? report::engineering_unit(Quantity::displacement, largest) : report::Unit{};
  report::Panel& top = figure.panel("", speed, {drawn.rotor ? "radius, peak" : drawn.coordinate + ", peak", unit});
  top.height = 280;
  if (band) top.band("95 % band, largest response", band->omega, band->upper_low, band->upper_high, {.color = 5});
  std::array<bool, 4> named{};
  add_lines(top, x, y, kind, named);
  for (const response::ResponseCurve& isola : isolas) {
    std::vector<double> w, a;
    std::vector<int> how;
    for (const response::CurvePoint& p : isola.points) {
      w.push_back(p.solution.omega);
      a.push_back(drawn.amplitude(p.solution));
      how.push_back((p.stable ? 0 : 1) + (known.holds(a.back(), w.back()) ? 0 : 2));
    }
    add_lines(top, w, a, how, named);
  }
  if (rotor) {
    Eigen::VectorXd a = Eigen::VectorXd::LinSpaced(60, 0, largest * 1.05), w(60);
    for (Index k = 0; k < 60; ++k) {
      w[k] = response::backbone(*rotor, a[k]);
      if (!(w[k] >= *std::min_element(x.begin(), x.end()) && w[k] <= *std::max_element(x.begin(), x.end()))) w[k] = NAN;
    }
    if (w.array().isFinite().any()) top.line("backbone", w, a, {.color = 7, .dash = report::Dash::dashed});
  }
  std::vector<response::CurveEvent> marks = curve.events;
  for (const response::ResponseCurve& isola : isolas)
    marks.insert(marks.end(), isola.events.begin(), isola.events.end());
  for (const response::CurveEvent& e : marks)
    top.scatter(e.kind == response::EventKind::fold ? "" : to_string(e.kind),
                Eigen::VectorXd::Constant(1, e.solution.omega),
                Eigen::VectorXd::Constant(1, drawn.amplitude(e.solution)),
                {.color = 6, .mark = e.kind == response::EventKind::fold ? report::Mark::circle : report::Mark::cross});
  report::Panel& low = figure.panel("", speed, {"phase of " + drawn.coordinate, {"deg", std::numbers::pi / 180}});
  low.height = 160;
  std::array<bool, 4> named_low{};
  add_lines(low, x, phase, kind, named_low);
  return figure;
}

io::Json json_of(const response::ResponseCurve& curve, const Drawn& drawn, const Known& known,
                 const std::optional<response::SynchronousBand>& band) {
  io::Json out = io::start_document("whirl.response", 1);
  io::Json points = io::Json::array(), events = io::Json::array();
  for (const response::CurvePoint& p : curve.points) {
    const double a = drawn.amplitude(p.solution);
    points.push(io::Json::object()
                    .set("omega", p.solution.omega)
                    .set("amplitude", a)
                    .set("phase", std::arg(p.solution.harmonic(0, 1)))
                    .set("stable", p.stable)
                    .set("multiplier", p.multiplier)
                    .set("harmonics", p.solution.harmonics())
                    .set("extrapolated", !known.holds(a, p.solution.omega)));
  }
  for (const response::CurveEvent& e : curve.events)
    events.push(io::Json::object()
                    .set("kind", to_string(e.kind))
                    .set("omega", e.solution.omega)
                    .set("amplitude", drawn.amplitude(e.solution)));
  out.set("coordinate", drawn.rotor ? "radius" : drawn.coordinate).set("events", std::move(events));
  out.set("points", std::move(points)).set("closed", curve.closed);
  if (band)
    out.set("peak_interval", io::Json::array().push(band->peak_low).push(band->peak_high))
        .set("band", io::Json::object()
                         .set("omega", io::Json(band->omega))
                         .set("low", io::Json(band->upper_low))
                         .set("high", io::Json(band->upper_high)));
  return out.set("summary", whirl::to_json(curve.summary));
}

/// Answers apart from the curve; their points as the curve's own.
io::Json isola_json(const std::vector<response::ResponseCurve>& isolas, const Drawn& drawn, const Known& known) {
  io::Json list = io::Json::array();
  for (const response::ResponseCurve& isola : isolas) list.push(json_of(isola, drawn, known, {}));
  return list;
}

io::Json peak_json(const response::PeakCurve& peaks) {
  return io::Json::object()
      .set("factor", io::Json(peaks.force))
      .set("up", io::Json(peaks.up))
      .set("down", io::Json(peaks.down))
      .set("largest", io::Json(peaks.largest))
      .set("jump_from", peaks.jump_from);
}

report::Figure peak_figure(const response::PeakCurve& peaks, const Drawn& drawn, bool turning) {
  report::Figure figure;
  figure.title = "Peak of slow sweeps";
  figure.description = "Largest amplitude met by a slow run-up and run-down over the size of the forcing.";
  const double most = peaks.largest.array().isFinite().select(peaks.largest.array(), 0).maxCoeff();
  const report::Unit unit = drawn.rotor ? report::engineering_unit(Quantity::displacement, most) : report::Unit{};
  report::Panel& panel =
      figure.panel("", {turning ? "times the identified unbalance" : "times the amplitude of the input", {}},
                   {drawn.rotor ? "radius, peak" : drawn.coordinate + ", peak", unit});
  panel.height = 280;
  panel.line("speed rising", peaks.force, peaks.up, {.color = 0, .width = 1.6});
  panel.line("speed falling", peaks.force, peaks.down, {.color = 1, .width = 1.6, .dash = report::Dash::dashed});
  return figure;
}

/// Peaks of slow sweeps for 40 sizes of the forcing up to o.peaks_to times that of the curve.
std::optional<response::PeakCurve> peaks_of(const IdentifiedModel& model, const Options& o, const Drawn& drawn,
                                            const response::CurveOptions& options, Session& session) {
  if (!(o.peaks_to > 0)) {
    if (!o.peak_figure.empty()) throw Error("--peak-figure needs --peaks-to");
    return {};
  }
  const bool turning = o.input.empty();
  const double unit = turning ? 1 : std::abs(o.amplitude);
  const response::PeriodicSystem system(model, {o.input, o.amplitude, 1, turning});
  response::PeakCurve peaks =
      response::peak_over_force(system, unit * Eigen::VectorXd::LinSpaced(40, o.peaks_to / 40, o.peaks_to), options,
                                [&](const response::PeriodicSolution& s) { return drawn.amplitude(s); });
  peaks.force /= unit;
  peaks.jump_from /= unit;
  session.say(std::isnan(peaks.jump_from)
                  ? fmt::format("slow sweeps        no jump up to {:g} times this forcing", o.peaks_to)
                  : fmt::format("slow sweeps        jump from {:.3g} times this forcing on", peaks.jump_from));
  return peaks;
}

/// The model with the unbalance asked for, and its rotor where the unbalance forces one.
struct Forced {
  IdentifiedModel model;
  std::optional<RotorModel> rotor;
};

Forced forced_model(const Options& o) {
  Forced f{io::load<IdentifiedModel>(o.model), {}};
  if (!(o.from_rpm > 0) || !(o.to_rpm > 0)) throw Error("--from-rpm and --to-rpm are needed, both > 0");
  const bool turning = o.input.empty();
  if (!turning && o.amplitude == 0) throw Error("--amplitude is needed: the input's amplitude, in its unit");
  if (!f.model.rotor || !turning) return f;
  f.rotor = *f.model.rotor;
  f.rotor->eps *= o.unbalance;
  const IdentifiedModel equations = response::rotor_equations(*f.rotor);
  f.model.states = equations.states;
  f.model.inputs = equations.inputs;
  f.model.equations = equations.equations;
  return f;
}

/// An amplitude with its unit, where it has one.
std::string amplitude_text(const Drawn& drawn, double amplitude) {
  return drawn.rotor ? report::format_amplitude(amplitude, AmplitudeKind::peak) : report::format_number(amplitude);
}

void warn_of_hertz(const Options& o, const RotorModel& rotor, Summary& summary) {
  const double critical = rotor.natural_frequency();
  if (std::max(o.from_rpm, o.to_rpm) * kRpm >= critical / 12) return;
  summary.warn(fmt::format(
      "{:g} to {:g} rpm is far below the critical speed of {:.0f} rpm: is the range in Hz ({:.0f} to {:.0f} rpm)?",
      o.from_rpm, o.to_rpm, critical / kRpm, 60 * o.from_rpm, 60 * o.to_rpm));
}

/// Branches that do not hang together with the curve in this range: where a run-down begins, and closed ones if asked
/// for.
std::vector<response::ResponseCurve> other_curves(const Options& o, const IdentifiedModel& model,
                                                  const response::PeriodicSystem& system,
                                                  const response::ResponseCurve& curve,
                                                  const response::CurveOptions& options, const Drawn& drawn,
                                                  Session& session) {
  const bool turning = o.input.empty();
  std::vector<response::ResponseCurve> others =
      response::other_branches(system, curve, turning ? 0 : o.amplitude, options);
  for (const response::ResponseCurve& other : others)
    session.say(
        fmt::format("second branch      {} at {:.0f} rpm, where a run-down begins: it joins the curve beyond the range",
                    amplitude_text(drawn, drawn.amplitude(other.points.front().solution)), o.to_rpm));
  if (!o.isolas) return others;
  const response::PeriodicSystem forced(model, {o.input, o.amplitude, 1, turning});
  const std::vector<response::ResponseCurve> found =
      response::find_isolas(forced, curve, turning ? 1 : o.amplitude, options, others);
  for (const response::ResponseCurve& isola : found) {
    double low = INFINITY, high = 0, most = 0;
    for (const response::CurvePoint& p : isola.points) {
      low = std::min(low, p.solution.omega);
      high = std::max(high, p.solution.omega);
      most = std::max(most, drawn.amplitude(p.solution));
    }
    session.say(
        fmt::format("isola              {:.2f} to {:.2f} rpm, up to {}: apart from the curve, reached by a blow",
                    low / kRpm, high / kRpm, amplitude_text(drawn, most)));
  }
  if (found.empty()) session.say("isolas             none found");
  others.insert(others.end(), found.begin(), found.end());
  return others;
}

/// Over the covariance of an isotropic rotor, whose synchronous response is algebraic.
std::optional<response::SynchronousBand> band_of(const Forced& forced, const response::CurveOptions& options) {
  const bool isotropic = forced.rotor && forced.rotor->k1_conj == 0.0 && forced.rotor->c_conj == 0.0;
  if (!isotropic || forced.model.rotor_covariance.size() != 25) return {};
  return response::synchronous_band(
      *forced.rotor, forced.model.rotor_covariance,
      Eigen::VectorXd::LinSpaced(200, std::min(options.from, options.to), std::max(options.from, options.to)));
}

/// Says peak, band, folds and branch points; warns of what the record does not cover.
void tell(const Options& o, response::ResponseCurve& curve, const Drawn& drawn, const Known& known,
          const std::optional<response::SynchronousBand>& band, Session& session) {
  const response::CurvePoint* peak = &curve.points.front();
  std::size_t unstable = 0, beyond = 0;
  for (const response::CurvePoint& p : curve.points) {
    if (drawn.amplitude(p.solution) > drawn.amplitude(peak->solution)) peak = &p;
    unstable += !p.stable;
    beyond += !known.holds(drawn.amplitude(p.solution), p.solution.omega);
  }
  session.say(fmt::format("largest response   {} at {:.0f} rpm{}",
                          amplitude_text(drawn, drawn.amplitude(peak->solution)), peak->solution.omega / kRpm,
                          peak->stable ? "" : " (unstable there)"));
  if (band)
    session.say(fmt::format("95 % interval      {} to {} (over the model's covariance)",
                            report::format_amplitude(band->peak_low, AmplitudeKind::peak),
                            report::format_amplitude(band->peak_high, AmplitudeKind::peak)));
  for (const response::CurveEvent& e : curve.events)
    session.say(fmt::format("{:<18} {:.2f} rpm, {}", to_string(e.kind), e.solution.omega / kRpm,
                            amplitude_text(drawn, drawn.amplitude(e.solution))));
  session.say(fmt::format("points             {}, {} of them unstable", curve.points.size(), unstable));
  if (o.data.empty())
    curve.summary.trust = "the range of the data is not known: give --data RECORD to see what is extrapolation";
  else if (beyond > 0)
    curve.summary.warn(
        fmt::format("{} of {} points lie beyond the record's amplitude ({}) or speed ({:.0f} to {:.0f} rpm): "
                    "extrapolation",
                    beyond, curve.points.size(), report::format_amplitude(known.amplitude, AmplitudeKind::peak),
                    known.low / kRpm, known.high / kRpm));
}

void run(const Options& o, Session& session) {
  const Forced forced = forced_model(o);
  const bool turning = o.input.empty();
  const response::PeriodicSystem system(forced.model, {o.input, o.amplitude, forced.rotor ? 1 : o.unbalance});
  response::CurveOptions options;
  options.from = o.from_rpm * kRpm;
  options.to = o.to_rpm * kRpm;
  options.harmonics = o.harmonics;
  response::ResponseCurve curve =
      response::response_curve(system, response::Parameter::speed, turning ? 0 : o.amplitude, options);
  if (forced.rotor) warn_of_hertz(o, *forced.rotor, curve.summary);
  if (curve.points.empty()) {
    session.finish(curve.summary);
    return;
  }
  const Drawn drawn{system.driven_by_angle() && system.size() == 2, system.names().front()};
  const Known known = known_range(o.data);
  const std::optional<response::PeakCurve> peaks = peaks_of(forced.model, o, drawn, options, session);
  const std::vector<response::ResponseCurve> others =
      other_curves(o, forced.model, system, curve, options, drawn, session);
  const std::optional<response::SynchronousBand> band = band_of(forced, options);
  tell(o, curve, drawn, known, band, session);
  io::Json json = json_of(curve, drawn, known, band);
  json.set("branches", isola_json(others, drawn, known));
  if (peaks) {
    json.set("peaks", peak_json(*peaks));
    for (const std::string& warning : peaks->summary.warnings) curve.summary.warn(warning);
    if (!o.peak_figure.empty()) report::write_figure(peak_figure(*peaks, drawn, turning), o.peak_figure);
  }
  session.result(json);
  if (!o.out.empty()) io::save_json(o.out, json);
  if (!o.figure.empty()) report::write_figure(figure_of(curve, others, drawn, known, forced.rotor, band), o.figure);
  session.finish(curve.summary);
}

}  // namespace

void add_response(CommandLine& app, Session& session) {
  auto o = std::make_shared<Options>();
  CommandLine* sub = add_command(
      app, session, "response", "Steady response of a model over speed, without simulation",
      "Input: model.json of `whirl identify`. Harmonic balance with arclength continuation: every response, stable or "
      "not,\n"
      "folds and branch points. Without --input the rotor turns and its unbalance is the forcing; with --input the "
      "named\n"
      "input is amplitude * cos(Omega t). Dotted: beyond the amplitude and speed of the record given by --data.\n\n"
      "Example: whirl response model.json --from-rpm 300 --to-rpm 2000 --data rundown.csv --figure response.svg",
      [o, &session] { run(*o, session); });
  sub->add_option("MODEL", o->model, "model.json")->input()->required();
  sub->add_option("--from-rpm", o->from_rpm, "where the curve starts (60 rpm is 1 Hz)")->required();
  sub->add_option("--to-rpm", o->to_rpm, "where it ends")->required();
  sub->add_option("--input", o->input, "name of the input that forces the model; default: the unbalance");
  sub->add_option("--amplitude", o->amplitude, "amplitude of the input, in its unit");
  sub->add_option("--unbalance", o->unbalance, "times the identified eccentricity")->show_default();
  sub->add_option("--harmonics", o->harmonics, "to start with; more where the spectrum asks")
      ->range(1, 50)
      ->show_default();
  sub->add_option("--data", o->data, "record with x, y, beta that the model was found from")->input();
  sub->add_flag("--isolas", o->isolas, "look for closed curves apart from this one (over the forcing at 25 speeds)");
  sub->add_option("--peaks-to", o->peaks_to, "peak of slow sweeps for forcings up to this many times the stated one")
      ->range(0, 1e6);
  sub->add_option("--peak-figure", o->peak_figure, "the peaks over the forcing (.svg, .png, .pdf, .csv)")->output();
  sub->add_option("--out", o->out, "write the curve as JSON")->output("whirl.response");
  sub->add_option("--figure", o->figure, "amplitude and phase over speed (.svg, .png, .pdf, .csv)")->output();
}

}  // namespace whirl::app
