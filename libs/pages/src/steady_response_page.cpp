#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/pages/steady_response.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;

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

/// What is drawn of one curve.
struct Drawn {
  std::vector<double> x, y, phase;  ///< rad/s, amplitude, rad
  std::vector<int> kind;            ///< as `add_lines` names them
};

/// The phase goes on without jumps; that of another curve starts in the turn of `beside` at the nearest speed.
Drawn drawn(const response::ResponseCurve& curve, const SteadyResponse& f, const Drawn* beside = nullptr) {
  constexpr double turn = 2 * std::numbers::pi;
  Drawn d;
  for (const response::CurvePoint& p : curve.points) {
    d.x.push_back(p.solution.omega);
    d.y.push_back(f.amplitude(p.solution));
    double phase = std::arg(p.solution.harmonic(f.index, 1)), before = phase;
    if (!d.phase.empty())
      before = d.phase.back();
    else if (beside != nullptr) {
      const auto far = [&](double x) { return std::abs(x - d.x[0]); };
      const auto near =
          std::min_element(beside->x.begin(), beside->x.end(), [&](double a, double b) { return far(a) < far(b); });
      before = beside->phase[static_cast<std::size_t>(near - beside->x.begin())];
    }
    phase += turn * std::round((before - phase) / turn);
    d.phase.push_back(phase);
    d.kind.push_back((p.stable ? 0 : 1) + (f.known.holds(d.y.back(), d.x.back()) ? 0 : 2));
  }
  return d;
}

/// Points and events of one curve, into `out`.
void add_curve(io::Json& out, const response::ResponseCurve& curve, const SteadyResponse& f) {
  io::Json points = io::Json::array(), events = io::Json::array();
  for (const response::CurvePoint& p : curve.points) {
    const double a = f.amplitude(p.solution);
    points.push(io::Json::object()
                    .set("omega", p.solution.omega)
                    .set("amplitude", a)
                    .set("phase", std::arg(p.solution.harmonic(f.index, 1)))
                    .set("stable", p.stable)
                    .set("multiplier", p.multiplier)
                    .set("harmonics", p.solution.harmonics())
                    .set("extrapolated", !f.known.holds(a, p.solution.omega)));
  }
  for (const response::CurveEvent& e : curve.events)
    events.push(io::Json::object()
                    .set("kind", to_string(e.kind))
                    .set("omega", e.solution.omega)
                    .set("amplitude", f.amplitude(e.solution)));
  out.set("coordinate", f.radius ? "radius" : f.coordinate).set("events", std::move(events));
  out.set("points", std::move(points)).set("closed", curve.closed);
}

io::Json peak_json(const response::PeakCurve& peaks) {
  return io::Json::object()
      .set("factor", io::Json(peaks.force))
      .set("up", io::Json(peaks.up))
      .set("down", io::Json(peaks.down))
      .set("largest", io::Json(peaks.largest))
      .set("jump_from", peaks.jump_from);
}

}  // namespace

report::Figure steady_figure(const SteadyResponse& f) {
  std::vector<response::ResponseCurve> others = f.branches;
  others.insert(others.end(), f.isolas.begin(), f.isolas.end());
  const Drawn curve = drawn(f.curve, f);
  std::vector<Drawn> others_drawn;
  for (const response::ResponseCurve& other : others) others_drawn.push_back(drawn(other, f, &curve));
  report::Figure figure;
  figure.title = "Steady response";
  figure.description = "Amplitude and phase of the steady response over speed, with stability and folds.";
  figure.shared_x = true;
  const std::vector<double>&x = curve.x, &y = curve.y;
  const double largest = *std::max_element(y.begin(), y.end());
  const report::Axis speed{"speed", report::kRpm};
  const report::Unit unit =
      f.radius || f.rotor ? report::engineering_unit(Quantity::displacement, largest) : report::Unit{};
  report::Panel& top = figure.panel("", speed, {f.radius ? "radius, peak" : f.coordinate + ", peak", unit});
  top.height = 280;
  if (f.band) top.band("95 % band, largest stable response", f.band->omega, f.band->low, f.band->high, {.color = 5});
  std::array<bool, 4> named{};
  add_lines(top, x, y, curve.kind, named);
  for (const Drawn& other : others_drawn) add_lines(top, other.x, other.y, other.kind, named);
  if (f.plain_rotor) {
    Eigen::VectorXd a = Eigen::VectorXd::LinSpaced(60, 0, largest * 1.05), w(60);
    for (Index k = 0; k < 60; ++k) {
      w[k] = response::backbone(*f.rotor, a[k]);
      if (!(w[k] >= *std::min_element(x.begin(), x.end()) && w[k] <= *std::max_element(x.begin(), x.end()))) w[k] = NAN;
    }
    if (w.array().isFinite().any()) top.line("backbone", w, a, {.color = 7, .dash = report::Dash::dashed});
  }
  std::vector<response::CurveEvent> marks = f.curve.events;
  for (const response::ResponseCurve& isola : others)
    marks.insert(marks.end(), isola.events.begin(), isola.events.end());
  for (const response::CurveEvent& e : marks)
    top.scatter(e.kind == response::EventKind::fold ? "" : to_string(e.kind),
                Eigen::VectorXd::Constant(1, e.solution.omega), Eigen::VectorXd::Constant(1, f.amplitude(e.solution)),
                {.color = 6, .mark = e.kind == response::EventKind::fold ? report::Mark::circle : report::Mark::cross});
  report::Panel& low = figure.panel("", speed, {"phase of " + f.coordinate, report::kDegree});
  low.height = 160;
  std::array<bool, 4> named_low{};
  add_lines(low, x, curve.phase, curve.kind, named_low);
  for (const Drawn& other : others_drawn) add_lines(low, other.x, other.phase, other.kind, named_low);
  return figure;
}

report::Figure steady_peak_figure(const SteadyResponse& f) {
  if (!f.peaks) throw Error("--peak-figure needs --peaks-to");
  const response::PeakCurve& peaks = *f.peaks;
  report::Figure figure;
  figure.title = "Peak of slow sweeps";
  figure.description = "Largest amplitude met by a slow run-up and run-down over the size of the forcing.";
  const double most = peaks.largest.array().isFinite().select(peaks.largest.array(), 0).maxCoeff();
  const report::Unit unit =
      f.radius || f.rotor ? report::engineering_unit(Quantity::displacement, most) : report::Unit{};
  report::Panel& panel =
      figure.panel("", {f.turning ? "times the identified unbalance" : "times the stated amplitude", {}},
                   {f.radius ? "radius, peak" : f.coordinate + ", peak", unit});
  panel.height = 280;
  panel.line("speed rising", peaks.force, peaks.up, {.color = 0, .width = 1.6});
  panel.line("speed falling", peaks.force, peaks.down, {.color = 1, .width = 1.6, .dash = report::Dash::dashed});
  return figure;
}

std::string steady_csv(const SteadyResponse& f) {
  const bool length = f.radius || f.rotor;
  const double unit = length ? 1e-6 : 1;
  std::string out = fmt::format("rpm,amp_{},phase_deg,curve_1,stable_1,extrapolated_1\n", length ? "um" : "1");
  int number = 0;
  const auto add = [&](const response::ResponseCurve& curve) {
    for (const response::CurvePoint& p : curve.points) {
      const double a = f.amplitude(p.solution);
      out += fmt::format("{:.9g},{:.9g},{:.9g},{},{:d},{:d}\n", p.solution.omega / kRadPerSecPerRpm, a / unit,
                         std::arg(p.solution.harmonic(f.index, 1)) / kRadPerDegree, number, p.stable,
                         !f.known.holds(a, p.solution.omega));
    }
    ++number;
  };
  add(f.curve);
  for (const auto* others : {&f.branches, &f.isolas})
    for (const response::ResponseCurve& other : *others) add(other);
  return out;
}

io::Json to_json(const SteadyResponse& f) {
  io::Json out = io::start_document("whirl.response", 1);
  add_curve(out, f.curve, f);
  if (f.band)
    out.set("peak_interval", io::Json::array().push(f.band->peak_low).push(f.band->peak_high))
        .set("band", io::Json::object()
                         .set("omega", io::Json(f.band->omega))
                         .set("low", io::Json(f.band->low))
                         .set("high", io::Json(f.band->high)));
  io::Json list = io::Json::array();
  for (const auto* others : {&f.branches, &f.isolas})
    for (const response::ResponseCurve& other : *others) {
      io::Json branch = io::Json::object();
      add_curve(branch, other, f);
      list.push(branch.set("summary", whirl::to_json(other.summary)));
    }
  out.set("branches", std::move(list));
  if (!f.answers.empty()) {
    io::Json answers = io::Json::array();
    for (const SteadyAnswer& a : f.answers)
      answers.push(io::Json::object().set("speed", a.omega).set("amplitude", a.amplitude).set("stable", a.stable));
    out.set("answers", std::move(answers));
  }
  if (f.peaks) out.set("peaks", peak_json(*f.peaks));
  return out.set("summary", whirl::to_json(f.summary));
}

}  // namespace whirl::pages
