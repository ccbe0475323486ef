#include "whirl/pages/steady_response.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "model_draws.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"
#include "whirl/report/format.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;

/// The model with the unbalance asked for, and its rotor where the unbalance forces one.
struct Forced {
  IdentifiedModel model;
  std::optional<RotorModel> rotor;
};

void add_further_forces(const IdentifiedModel& model, IdentifiedModel& equations) {
  for (const identification::RotorTerm& term : identification::terms_of(model)) {
    if (term.entry->drifts) continue;  // as at its reference: a steady response knows no time
    for (Equation& e : equations.equations) {
      for (const auto& [function, sign] : identification::term_text(term, e.lhs == "X2'"))
        e.terms.push_back({function, Estimate::from_sd(sign * term.value, 0), ""});
    }
  }
}

Forced forced_model(IdentifiedModel model, const SteadyOptions& o) {
  if (!(o.curve.from > 0) || !(o.curve.to > 0))
    throw Error("--from-rpm and --to-rpm are needed, both > 0, or --at-rpm");
  const bool turning = o.input.empty() && o.base.empty();
  if (!o.input.empty() && !o.base.empty()) throw Error("either an input or the support forces the model, not both");
  if (!turning && o.amplitude == 0) throw Error("--amplitude is needed: of the input or the support, in its unit");
  Forced f{std::move(model), {}};
  if (!f.model.rotor || !o.input.empty()) return f;
  f.rotor = *f.model.rotor;
  identification::scale_unbalance(*f.rotor, o.unbalance);
  IdentifiedModel equations = response::rotor_equations(*f.rotor);
  add_further_forces(f.model, equations);
  f.model.states = equations.states;
  f.model.inputs = equations.inputs;
  f.model.equations = equations.equations;
  return f;
}

/// A rotor's coordinates are X1 and X3; engineers say x and y.
std::string coordinate_name(const std::string& name, bool rotor) {
  if (rotor && name == "x") return "X1";
  return rotor && name == "y" ? "X3" : name;
}

response::Forcing forcing_of(const SteadyOptions& o, bool rotor) {
  return {o.input, o.amplitude, rotor ? 1 : o.unbalance, false, o.base};
}

/// The size of the forcing is then a parameter of the curve.
response::Forcing free_forcing(const SteadyOptions& o, bool turning) {
  return {o.input, o.amplitude, 1, turning, o.base};
}

void warn_of_hertz(const SteadyOptions& o, const RotorModel& rotor, Summary& summary) {
  if (std::string doubt = doubt_of_hertz("the range", o.curve.from, o.curve.to, rotor.natural_frequency());
      !doubt.empty())
    summary.warn(std::move(doubt));
}

}  // namespace

std::string doubt_of_hertz(const std::string& what, double low, double high, double critical) {
  if (std::max(low, high) >= critical / 12) return "";
  const auto range = [&](double factor) {
    const double a = factor * low / kRadPerSecPerRpm, b = factor * high / kRadPerSecPerRpm;
    return a == b ? fmt::format("{:g}", a) : fmt::format("{:g} to {:g}", a, b);
  };
  return fmt::format("{}, {} rpm, is far below the critical speed of {:.0f} rpm: is {} in Hz ({} rpm)?", what, range(1),
                     critical / kRadPerSecPerRpm, what, range(60));
}

namespace {

/// The motion that the sensors see: that of the equations and that of the further modes, which are linear, forced by
/// the unbalance alone and not in the equations.
response::PeriodicSolution seen(response::PeriodicSolution s, const std::optional<RotorModel>& rotor) {
  if (!rotor || rotor->modes.empty()) return s;
  const std::complex<double> v = response::modes_vector(*rotor, s.omega);
  s.coefficients(1, 0) += v.real(), s.coefficients(2, 0) -= v.imag();
  s.coefficients(1, 1) += v.imag(), s.coefficients(2, 1) += v.real();
  return s;
}

void see(const std::optional<RotorModel>& rotor, response::ResponseCurve& curve) {
  for (response::CurvePoint& p : curve.points) p.solution = seen(std::move(p.solution), rotor);
  for (response::CurveEvent& e : curve.events) e.solution = seen(std::move(e.solution), rotor);
}

/// The points where the curves are highest.
void add_tops(const response::PeriodicSystem& system, const SteadyOptions& o, SteadyResponse& found) {
  const response::Amplitude amplitude = [&](const response::PeriodicSolution& s) {
    return found.amplitude(seen(s, found.turning ? found.rotor : std::nullopt));
  };
  const double range = std::abs(o.curve.to - o.curve.from);
  response::add_peaks(system, found.curve, range, amplitude);
  for (auto* others : {&found.branches, &found.isolas})
    for (response::ResponseCurve& other : *others) response::add_peaks(system, other, range, amplitude);
}

/// Steps of the band over speed: a quarter of the width of a rotor's resonance, within what draws cost.
int band_speeds(const SteadyOptions& o, const std::optional<RotorModel>& rotor) {
  constexpr double kFewest = 200, kMost = 1000;
  const double width = rotor ? std::abs(rotor->c) : 0, range = std::abs(o.curve.to - o.curve.from);
  return static_cast<int>(std::clamp(width > 0 ? 4 * range / width : kFewest, kFewest, kMost));
}

/// Of an isotropic rotor without further forces the synchronous response is algebraic: a thousand draws. That of any
/// other model from the curve itself.
void add_band(const IdentifiedModel& model, const Forced& forced, const response::PeriodicSystem& system, double force,
              const SteadyOptions& o, SteadyResponse& found) {
  const bool rotor = forced.rotor.has_value();
  const int speeds = band_speeds(o, forced.rotor);
  if (rotor && model.rotor_covariance.size() != 25) return;
  if (found.plain_rotor && forced.rotor->modes.empty() && forced.rotor->k1_conj == 0.0 && forced.rotor->c_conj == 0.0) {
    std::vector<double> covariance = model.rotor_covariance;
    for (std::size_t k = 0; k < 25; ++k) covariance[k] *= (k / 5 > 2 ? o.unbalance : 1) * (k % 5 > 2 ? o.unbalance : 1);
    const response::SynchronousBand plain = response::synchronous_band(
        *forced.rotor, covariance,
        Eigen::VectorXd::LinSpaced(speeds, std::min(o.curve.from, o.curve.to), std::max(o.curve.from, o.curve.to)));
    found.band = {plain.omega, plain.upper_low, plain.upper_high, plain.peak_low, plain.peak_high, 1000, 0};
    return;
  }
  ModelDraws draws(model, 1);
  if (!draws.any()) return;
  std::vector<response::ResponseCurve> curves{found.curve};
  curves.insert(curves.end(), found.branches.begin(), found.branches.end());
  std::optional<RotorModel> seen_by = forced.rotor;  // of the draw that is looked at
  const auto draw = [&]() -> std::optional<response::PeriodicSystem> {
    Forced drawn = forced_model(draws(), o);
    seen_by = drawn.rotor;
    return response::PeriodicSystem(drawn.model, forcing_of(o, rotor));
  };
  found.band = response::curve_band(
      system, curves, force, o.curve,
      [&](const response::PeriodicSolution& s) {
        return found.amplitude(seen(s, found.turning ? seen_by : std::nullopt));
      },
      draw, 400, speeds);
  if (found.band->lost > 0)
    found.summary.warn(fmt::format(
        "for {} of {} models drawn from the covariance no response was found: they are not in the 95 % interval",
        found.band->lost, found.band->lost + found.band->draws));
}

/// The band of another reading of the model's records, or its curve where that has no band.
response::CurveBand band_of(const SteadyResponse& other) {
  if (other.band) return *other.band;
  response::CurveBand out;
  std::vector<std::pair<double, double>> points;
  for (const response::CurvePoint& p : other.curve.points)
    if (p.stable) points.emplace_back(p.solution.omega, other.amplitude(p.solution));
  std::ranges::sort(points);
  out.omega.resize(static_cast<Index>(points.size()));
  out.low.resize(out.omega.size());
  for (std::size_t k = 0; k < points.size(); ++k)
    out.omega[static_cast<Index>(k)] = points[k].first, out.low[static_cast<Index>(k)] = points[k].second;
  out.high = out.low;
  if (out.low.size() > 0) out.peak_low = out.peak_high = out.low.maxCoeff();
  return out;
}

double at(const Eigen::VectorXd& omega, const Eigen::VectorXd& values, double w) {
  const Index n = omega.size();
  const Index next = std::lower_bound(omega.data(), omega.data() + n, w) - omega.data();
  if (next == 0 || next == n) return values[std::min(next, n - 1)];
  const double part = (w - omega[next - 1]) / (omega[next] - omega[next - 1]);
  return values[next - 1] + part * (values[next] - values[next - 1]);
}

/// The band covers what the other readings of the records answer.
void cover_readings(const IdentifiedModel& model, const SteadyOptions& o, SteadyResponse& found) {
  for (const identification::ModelReading& reading : identification::other_readings(model)) {
    SteadyOptions plain = o;
    plain.isolas = false;
    plain.peaks_to = 0;
    plain.known.reset();
    const SteadyResponse other = steady_response(reading.model, plain);
    if (other.curve.points.empty()) {
      found.summary.add({FindingCode::readings_differ, Consequence::warning, {}, reading.reading},
                        ": no steady response of it was found, and the interval does not cover it");
      continue;
    }
    const response::CurveBand theirs = band_of(other);
    if (!found.band) found.band = band_of(found);
    response::CurveBand& own = *found.band;
    for (Index k = 0; k < own.omega.size(); ++k) {
      own.low[k] = std::min(own.low[k], at(theirs.omega, theirs.low, own.omega[k]));
      own.high[k] = std::max(own.high[k], at(theirs.omega, theirs.high, own.omega[k]));
    }
    own.peak_low = std::min(own.peak_low, theirs.peak_low);
    own.peak_high = std::max(own.peak_high, theirs.peak_high);
    found.summary.add(
        {FindingCode::readings_differ,
         Consequence::note,
         {{"peak from", theirs.peak_low, other.radius ? "m" : ""}, {"to", theirs.peak_high, other.radius ? "m" : ""}},
         reading.reading});
  }
}

response::PeakCurve peaks_of(const IdentifiedModel& model, const SteadyOptions& o, const SteadyResponse& found) {
  const double unit = found.turning ? 1 : std::abs(o.amplitude);
  const response::PeriodicSystem system(model, free_forcing(o, found.turning));
  response::PeakCurve peaks =
      response::peak_over_force(system, unit * Eigen::VectorXd::LinSpaced(40, o.peaks_to / 40, o.peaks_to), o.curve,
                                [&](const response::PeriodicSolution& s) {
                                  // The further modes grow with the unbalance, as its multiple says.
                                  std::optional<RotorModel> rotor = found.rotor;
                                  if (rotor)
                                    for (ForcedMode& mode : rotor->modes) mode.participation *= s.force / unit;
                                  return found.amplitude(seen(s, found.turning ? rotor : std::nullopt));
                                });
  peaks.force /= unit;
  peaks.jump_from /= unit;
  return peaks;
}

/// Without a name the first of the model's own order: a hidden state comes last there.
void choose_coordinate(const std::string& name, const IdentifiedModel& model, const std::vector<std::string>& names,
                       SteadyResponse& found) {
  auto at = std::find(names.begin(), names.end(), name);
  if (name.empty()) {
    at = names.begin();
    for (auto s = model.states.rbegin(); s != model.states.rend(); ++s)
      if (const auto own = std::find(names.begin(), names.end(), *s); own != names.end()) at = own;
  }
  if (at == names.end()) throw Error::in_field("coordinate", name, fmt::format("one of: {}", fmt::join(names, ", ")));
  found.index = at - names.begin();
  found.coordinate = *at;
}

/// Every answer at the speeds asked for: where a curve crosses the speed, from there by Newton.
void add_answers(const response::PeriodicSystem& system, const SteadyOptions& o, SteadyResponse& found) {
  const auto look_in = [&](const response::ResponseCurve& curve, double omega) {
    for (std::size_t k = 1; k < curve.points.size(); ++k) {
      const response::CurvePoint &one = curve.points[k - 1], &next = curve.points[k];
      const double before = omega - one.solution.omega, step = next.solution.omega - one.solution.omega;
      // A crossing belongs to the point before it, the last point of a curve to the last step.
      const bool last = k + 1 == curve.points.size() && before == step;
      if (step == 0 || before / step < 0 || (before / step >= 1 && !last)) continue;
      const response::CurvePoint& near = before / step < 0.5 ? one : next;
      response::PeriodicSolution s = near.solution;
      s.omega = omega;
      if (!response::solve_periodic(system, s)) continue;
      found.answers.push_back({omega, found.amplitude(found.turning ? seen(s, found.rotor) : s), near.stable});
    }
  };
  const double low = std::min(o.curve.from, o.curve.to), high = std::max(o.curve.from, o.curve.to);
  for (const double omega : o.at) {
    require_range("--at-rpm", omega / kRadPerSecPerRpm, low / kRadPerSecPerRpm, high / kRadPerSecPerRpm, "rpm");
    const auto first = static_cast<std::ptrdiff_t>(found.answers.size());
    look_in(found.curve, omega);
    for (const auto* others : {&found.branches, &found.isolas})
      for (const response::ResponseCurve& other : *others) look_in(other, omega);
    // The motions that the machine can have first.
    std::stable_partition(found.answers.begin() + first, found.answers.end(),
                          [](const SteadyAnswer& a) { return a.stable; });
  }
}

void warn_of_extrapolation(SteadyResponse& found) {
  std::size_t beyond = 0;
  for (const response::CurvePoint& p : found.curve.points)
    beyond += !found.known.holds(found.amplitude(p.solution), p.solution.omega);
  if (beyond == 0) return;
  found.summary.warn(fmt::format(
      "{} of {} points lie beyond the record's amplitude ({}) or speed ({:.0f} to {:.0f} rpm): "
      "extrapolation",
      beyond, found.curve.points.size(), report::format_amplitude(found.known.amplitude, AmplitudeKind::peak),
      found.known.low / kRadPerSecPerRpm, found.known.high / kRadPerSecPerRpm));
}

}  // namespace

std::string SteadyResponse::amplitude_text(double amplitude) const {
  return radius || rotor ? report::format_amplitude(amplitude, AmplitudeKind::peak) : report::format_number(amplitude);
}

SteadyResponse steady_response(const IdentifiedModel& model, SteadyOptions o) {
  require_range("unbalance", o.unbalance, 0, 1e9);
  require_range("amplitude", o.amplitude, 0, 1e15);
  require_range("peaks_to", o.peaks_to, 0, 1e6);
  if (o.amplitude != 0 && o.input.empty() && o.base.empty())
    throw Error("the amplitude is of an input or of the support: which one? (--input or --base)");
  o.base = coordinate_name(o.base, model.rotor.has_value());
  o.coordinate = coordinate_name(o.coordinate.empty() ? o.base : o.coordinate, model.rotor.has_value());
  Summary parts;
  take_parts(identification::Consumer::response, model, parts);
  const Forced forced = forced_model(model, o);
  SteadyResponse found;
  found.rotor = forced.rotor;
  found.turning = o.input.empty() && o.base.empty();
  found.plain_rotor = found.turning && forced.rotor && identification::terms_of(model).empty();
  const double force = found.turning ? 0 : o.amplitude;
  const response::PeriodicSystem system(forced.model, forcing_of(o, forced.rotor.has_value()));
  found.curve = response::response_curve(system, response::Parameter::speed, force, o.curve);
  found.summary = found.curve.summary;
  for (const Finding& f : parts.findings) found.summary.add(f);
  if (forced.rotor) warn_of_hertz(o, *forced.rotor, found.summary);
  found.radius = o.coordinate.empty() && system.driven_by_angle() &&
                 (system.size() == 2 || identification::has_tilt(model));  // x and y come first
  choose_coordinate(o.coordinate, forced.model, system.names(), found);
  if (found.curve.points.empty()) return found;
  found.branches = response::other_branches(system, found.curve, force, o.curve);
  if (o.isolas) {
    const response::PeriodicSystem free(forced.model, free_forcing(o, found.turning));
    found.isolas = response::find_isolas(free, found.curve, found.turning ? 1 : o.amplitude, o.curve, found.branches);
  }
  add_tops(system, o, found);
  add_band(model, forced, system, force, o, found);
  add_answers(system, o, found);
  if (o.peaks_to > 0) found.peaks = peaks_of(forced.model, o, found);
  if (found.turning) {
    see(forced.rotor, found.curve);
    for (response::ResponseCurve& branch : found.branches) see(forced.rotor, branch);
    for (response::ResponseCurve& isola : found.isolas) see(forced.rotor, isola);
  }
  cover_readings(model, o, found);
  if (o.known) {
    found.known = *o.known;
    warn_of_extrapolation(found);
  } else {
    found.summary.trust = "the range of the data is not known: give the record (--data) to see what is extrapolation";
  }
  if (found.peaks) {
    for (const std::string& warning : found.peaks->summary.warnings) found.summary.warn(warning);
  }
  return found;
}

}  // namespace whirl::pages
