#include "evidence/rotor_ambiguity.hpp"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "problem/rotor_equations.hpp"
#include "rules/rules.hpp"
#include "terms/catalogue.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::identification::detail {
namespace {

using Vector5 = Eigen::Matrix<double, 5, 1>;
using Matrix5 = Eigen::Matrix<double, 5, 5>;

Vector5 five(const RotorModel& r) { return (Vector5() << r.k1, r.k2, r.c, r.eps.real(), r.eps.imag()).finished(); }

/// Variance to add so that 1.96 deviations from here reach 1.96 of `theirs` beyond a reading that lies `shift` away.
double reach(double shift, double theirs, double own) {
  const double sd = std::abs(shift) / rules::k95 + std::sqrt(std::max(theirs, 0.0));
  return std::max(0.0, sd * sd - std::max(own, 0.0));
}

/// `own` with one direction of k1, k2, c and the unbalance added, and for the unbalance one across it.
Matrix5 widened(const Matrix5& own, const Vector5& shift, const Matrix5& theirs) {
  Vector5 more = Vector5::Zero();
  for (Eigen::Index i = 0; i < 3; ++i)
    more[i] = std::copysign(std::sqrt(reach(shift[i], theirs(i, i), own(i, i))), shift[i]);
  Eigen::Vector2d along = shift.tail<2>();
  const double far = along.norm();
  along = far > 0 ? Eigen::Vector2d(along / far) : Eigen::Vector2d(1, 0);
  const Eigen::Vector2d across(-along[1], along[0]);
  const Eigen::Matrix2d a = own.bottomRightCorner<2, 2>(), b = theirs.bottomRightCorner<2, 2>();
  more.tail<2>() = std::sqrt(reach(far, along.dot(b * along), along.dot(a * along))) * along;
  Matrix5 sum = own + more * more.transpose();
  sum.bottomRightCorner<2, 2>() +=
      reach(0, across.dot(b * across), across.dot(a * across)) * across * across.transpose();
  return sum;
}

/// Intervals and covariance of `model` cover those of `other` too.
void widen(IdentifiedModel& model, const IdentifiedModel& other) {
  for (auto& [name, e] : model.parameters) {
    const Estimate* o = other.parameter(name);
    if (o == nullptr || !std::isfinite(e.sd) || !std::isfinite(o->sd)) continue;
    double shift = o->value - e.value;
    if (name.starts_with("e_phase")) shift = std::remainder(shift, 2 * std::numbers::pi);
    e.low = std::min(e.low, e.value + shift - rules::k95 * o->sd);
    e.high = std::max(e.high, e.value + shift + rules::k95 * o->sd);
    e.sd = std::max({e.sd, (e.value - e.low) / rules::k95, (e.high - e.value) / rules::k95});
  }
  if (model.rotor_covariance.size() != 25 || other.rotor_covariance.size() != 25) return;
  using Rows = Eigen::Matrix<double, 5, 5, Eigen::RowMajor>;
  Eigen::Map<Rows> own(model.rotor_covariance.data());
  const Eigen::Map<const Rows> theirs(other.rotor_covariance.data());
  own = widened(own, five(*other.rotor) - five(*model.rotor), theirs).eval();
}

/// "c 3.02 or 2.41 1/s" of the parameters that move by more than their deviation.
std::string difference(const IdentifiedModel& model, const IdentifiedModel& other) {
  constexpr std::array<std::pair<const char*, const char*>, 5> names{
      {{"k1", "1/s^2"}, {"k2", "1/(m^2 s^2)"}, {"c", "1/s"}, {"e", "m"}, {"e_phase", "rad"}}};
  std::string text;
  for (const auto& [name, unit] : names) {
    const Estimate &a = *model.parameter(name), &b = *other.parameter(name);
    if (std::abs(a.value - b.value) > std::max(a.sd, b.sd))
      text += fmt::format("{}{} {:.5g} or {:.5g} {}", text.empty() ? "" : ", ", name, a.value, b.value, unit);
  }
  return text.empty() ? "k1, k2, c and e are the same within their intervals" : text;
}

/// `other` as an alternative of `model`: the parameters that it has otherwise, those it lacks as 0.
Alternative alternative(std::string reading, double odds, const IdentifiedModel& model, const IdentifiedModel& other) {
  constexpr double kRounding = 1e-12;
  Alternative out{std::move(reading), odds};
  for (const auto& [name, e] : other.parameters) {
    const Estimate* own = model.parameter(name);
    if (own == nullptr || std::abs(own->value - e.value) > kRounding * std::abs(e.value))
      out.parameters.emplace_back(name, e);
  }
  for (const auto& [name, e] : model.parameters) {
    if (other.parameter(name) == nullptr) out.parameters.emplace_back(name, Estimate::from_sd(0, 0));
  }
  out.rotor_covariance = other.rotor_covariance;
  return out;
}

/// Odds of another fit of the same records by their likelihoods and numbers of parameters (Schwarz 1978).
double odds_of(const OutputErrorFit& own, const OutputErrorFit& other) {
  double readings = 0;
  for (const OutputErrorRecord& r : own.records) readings += 2 * static_cast<double>(r.main.size());
  const auto misfit = [&](const OutputErrorFit& f) {
    return f.summary.chi_square * (readings - static_cast<double>(f.names.size()));
  };
  const double noise = std::max(1.0, own.summary.chi_square);
  const double more = static_cast<double>(other.names.size()) - static_cast<double>(own.names.size());
  return std::exp(-0.5 * ((misfit(other) - misfit(own)) / noise + more * std::log(readings)));
}

void bow_beside_runout(bool better, RotorIdentification& result) {
  if (result.active.probes.runout_harmonics < 1) return;
  IdentifiedModel& model = result.model;
  const Estimate *re = model.parameter("runout1+_re"), *im = model.parameter("runout1+_im");
  const std::complex<double> runout(re->value, im->value);
  if (std::abs(runout) < rules::kVectorSeen * std::max(re->sd, im->sd)) return;
  // A bow b reads as runout b with eccentricity e + b (1 - i c / omega): docs/identification.md.
  const double speed = model.rotor->natural_frequency();
  IdentifiedModel bowed = model;
  bowed.rotor->eps = model.rotor->eps - runout * std::complex<double>(1, -model.rotor->c / speed);
  // The force i c omega b that tells them apart is not in the fit: it biases e by as much as it is.
  const double beyond = std::hypot(re->sd, im->sd, std::abs(runout) * model.rotor->c / speed);
  for (auto& [name, e] : bowed.parameters) {
    if (name != "e" && name != "e_phase") continue;
    const double value = name == "e" ? std::abs(bowed.rotor->eps) : std::arg(bowed.rotor->eps);
    const double size = std::max(std::abs(bowed.rotor->eps), 1e-12), per = name == "e" ? 1 : size;
    e = Estimate::from_sd(value, std::hypot(model.parameter("e")->sd, beyond) / per);
  }
  for (const std::size_t at : {18U, 24U}) bowed.rotor_covariance[at] += beyond * beyond;
  const double k1 = model.rotor->k1;
  Ambiguity open{
      fmt::format("runout of {:.3g} um on the probe's track, or a bow of the shaft of that size (at {:.1f} deg){}",
                  1e6 * std::abs(runout), std::arg(runout) * 180 / std::numbers::pi,
                  better ? "; the damping of the motion supports a bow" : ""),
      fmt::format("{}; a bow needs the balance mass of e + (k1 / speed^2) b = e + ({:.4g} / speed^2) b at its speed",
                  difference(model, bowed), k1),
      "a slow roll on a second probe plane, or on a surface of known runout"};
  Alternative bow = alternative("bow of the shaft", kNaN, model, bowed);
  const double sd = std::max(re->sd, im->sd);
  bow.parameters.emplace_back("bow", Estimate::from_sd(std::abs(runout), sd));
  bow.parameters.emplace_back("bow_phase", Estimate::from_sd(std::arg(runout), sd / std::abs(runout)));
  open.alternatives.push_back(std::move(bow));
  model.ambiguities.push_back(std::move(open));
  widen(model, bowed);
}

/// What the model is when the true motion is `scale` times the one it has, turned by `turn`.
IdentifiedModel seen_otherwise(IdentifiedModel model, double scale, double turn) {
  model.rotor->eps *= std::polar(scale, turn);
  model.rotor->k2 /= scale * scale;
  for (auto& [name, e] : model.parameters) {
    if (name.starts_with("e_phase")) {
      e = Estimate::from_sd(e.value + turn, e.sd);
    } else if (name == "k2" || name == "e" || name.starts_with("e_")) {
      const double by = name == "k2" ? 1 / (scale * scale) : scale;
      e = Estimate::from_sd(by * e.value, by * e.sd);
    }
  }
  return model;
}

/// Two probes that disagree: nothing in the record says which of them is right.
void either_probe(RotorIdentification& result) {
  const SensorAxes& sensor = result.fit.sensor;
  if (sensor.gain == 0 && sensor.angle == 0) return;
  const IdentifiedModel other = seen_otherwise(result.model, 1 + sensor.gain, sensor.angle);
  Ambiguity open{
      fmt::format("the x probe is right and y reads {:.3g} % too much and leans towards x by {:.3g} deg, or the y "
                  "probe is right and x is off by as much",
                  100 * sensor.gain, sensor.angle * 180 / std::numbers::pi),
      difference(result.model, other), "calibrate both probes and measure their directions"};
  open.alternatives.push_back(alternative("the y probe is right", 1, result.model, other));
  result.model.ambiguities.push_back(std::move(open));
  widen(result.model, other);
}

/// A pure delay, or a filter (first-order low-pass at the most) or averaging, which reads the motion smaller too.
void delay_of_filter(RotorIdentification& result) {
  if (!result.active.clock.delay) return;
  const double turn = result.model.rotor->natural_frequency() * result.fit.delay;
  const IdentifiedModel other = seen_otherwise(result.model, std::hypot(1, turn), 0);
  Ambiguity open{
      fmt::format("a pure delay of {:.3g} ms, or a low-pass filter or averaging over some samples, which reads the "
                  "motion up to {:.2g} % smaller",
                  1e3 * result.fit.delay, 100 * (std::hypot(1, turn) - 1)),
      difference(result.model, other), "the data sheet of the amplifier, or a record at another filter setting"};
  open.alternatives.push_back(alternative("a low-pass filter", kNaN, result.model, other));
  result.model.ambiguities.push_back(std::move(open));
  widen(result.model, other);
}

/// Two clocks that drift apart: nothing in the record says which of them is right. Rates of the model count time by
/// that of the displacement; by the other a second is longer by the drift.
void either_clock(RotorIdentification& result) {
  const double drift = result.fit.clock_drift;
  if (drift == 0) return;
  IdentifiedModel other = result.model;
  other.rotor->k1 *= 1 + 2 * drift, other.rotor->k2 *= 1 + 2 * drift, other.rotor->c *= 1 + drift;
  for (auto& [name, e] : other.parameters) {
    const double by = name == "k1" || name == "k2" ? 2 : name == "c" || name == "natural_frequency" ? 1 : 0;
    if (by > 0) e = Estimate::from_sd((1 + by * drift) * e.value, e.sd);
  }
  result.model.ambiguities.push_back(
      {fmt::format("the clock of the displacement is right, or that of the angle: they drift "
                   "apart by {:.3g} ppm",
                   1e6 * drift),
       difference(result.model, other), "displacement and angle by one recorder"});
  widen(result.model, other);
}

/// Dry friction holds small motion by a law that is assumed: at low speed an unbalance that changed stands in for
/// friction of another law.
void change_beside_friction(RotorIdentification& result) {
  std::complex<double> change = 0;
  bool dry = false;
  for (const RotorTerm& t : result.fit.terms) {
    dry = dry || t.entry->dry;
    if (t.is(terms::unbalance_step())) change += t.value * (t.part == 0 ? 1.0 : std::complex<double>(0, 1));
  }
  if (!dry || change == 0.0) return;
  IdentifiedModel& model = result.model;
  IdentifiedModel before = model;
  before.rotor->eps -= change;
  for (auto& [name, e] : before.parameters) {
    if (name == "e") e = Estimate::from_sd(std::abs(before.rotor->eps), e.sd);
    if (name == "e_phase") e = Estimate::from_sd(std::arg(before.rotor->eps), e.sd);
  }
  Ambiguity open{"an unbalance that changed at one instant, or dry friction that holds small motion in another way",
                 difference(model, before), std::string(to_string(Decider::second_run))};
  open.alternatives.push_back(alternative("the unbalance did not change", kNaN, model, before));
  model.summary.warn(fmt::format("{}; {}; to decide: {}", open.readings, open.consequence, open.experiment));
  model.ambiguities.push_back(std::move(open));
  widen(model, before);
}

void springs_along_axes(const GrownRotor& grown, RotorIdentification& result) {
  const ScoreCandidate* c = grown.test.find(terms::cubic_per_axis());
  const Estimate& k2 = *result.model.parameter("k2");
  if (c == nullptr || k2.covers(0) || std::abs(k2.value) * 4 / 3 > rules::kAxesToldApart * c->sd) return;
  Ambiguity open{"a radial cubic spring, or cubic springs along the axes: the orbits are nearly circular",
                 fmt::format("k2 {:.4g} 1/(m^2 s^2) radial, or {:.4g} along each axis", k2.value, k2.value * 4 / 3),
                 "a static stiffness test in two directions, or an impact: a motion along a line"};
  // On a circle of radius r both push with k2 r^3 in the mean over a turn.
  Alternative axes{"cubic springs along the axes", 1};
  axes.parameters = {{"k2", Estimate::from_sd(0, 0)},
                     {std::string(terms::cubic_per_axis().parameters.front().name),
                      Estimate::from_sd(k2.value * 4 / 3, k2.sd * 4 / 3)}};
  open.alternatives.push_back(std::move(axes));
  open.covered = false;
  result.model.ambiguities.push_back(std::move(open));
}

}  // namespace

void read_as_runout(OutputErrorFit& fit) {
  for (std::size_t r = 0; r < fit.records.size(); ++r) {
    OutputErrorRecord& record = fit.records[r];
    record.eps -= std::complex<double>(0, fit.model.c / fit.model.natural_frequency()) * record.runout[0];
    const std::string suffix = r == 0 ? "" : fmt::format("_{}", r + 1);
    for (const auto& [name, part] : {std::pair("eps_re", record.eps.real()), std::pair("eps_im", record.eps.imag())}) {
      if (const Eigen::Index k = fit.index(name + suffix); k >= 0) fit.values[k] = part;
    }
  }
  fit.model.eps = fit.records[0].eps;
}

namespace {

/// Damping of the plain kind that takes as much energy as the forces beyond RotorModel give or take, 1/s.
double damping_of_terms(const std::vector<RotorRecord>& records, const OutputErrorFit& fit) {
  double sum = 0;
  for (const RotorTerm& term : fit.terms) {
    double power = 0, squares = 0;
    for (std::size_t r = 0; r < records.size(); ++r) {
      const OutputErrorRecord& own = fit.records[r];
      for (Eigen::Index i = 0; i < own.main.size(); ++i) {
        const std::complex<double> z = own.main[i], v = own.main_rate[i];
        const double time = records[r].t0 + records[r].dt * static_cast<double>(i);
        const TermForce f = term_force(term, {z.real(), z.imag(), v.real(), v.imag(), own.angle.omega[2 * i],
                                              own.angle.beta[2 * i], time, own.angle.alpha[2 * i]});
        power += term.value * (f.x * v.real() + f.y * v.imag());
        squares += std::norm(v);
      }
    }
    sum += std::abs(power) / squares;
  }
  return sum;
}

/// Deviation of the phase added to rotor_covariance: along the circle of radius e about zero.
void spread_phase(IdentifiedModel& model, double sd) {
  if (model.rotor_covariance.size() != 25) return;
  const std::complex<double> across = std::complex<double>(0, sd) * model.rotor->eps;
  const std::array<double, 2> part{across.real(), across.imag()};
  for (std::size_t i = 0; i < 2; ++i) {
    for (std::size_t j = 0; j < 2; ++j) model.rotor_covariance[5 * (3 + i) + 3 + j] += part[i] * part[j];
  }
}

}  // namespace

void hold_other_kind(IdentifiedModel& model, const IdentifiedModel& other, std::string readings, Decider decider) {
  model.ambiguities.push_back({std::move(readings), difference(model, other), std::string(to_string(decider))});
  widen(model, other);
}

void forget_phase(RotorIdentification& result) {
  constexpr double kAny = std::numbers::pi;
  IdentifiedModel& model = result.model;
  for (auto& [name, e] : model.parameters) {
    if (name.starts_with("e_phase")) e = {e.value, kAny / std::sqrt(3.0), e.value - kAny, e.value + kAny};
  }
  spread_phase(model, kAny);
  result.assumptions.push_back(
      fmt::format("the angle is not measured: the speed is taken from the vibration as a polynomial of degree {} in "
                  "time, and the phase of e means nothing",
                  result.active.clock.profile_degree));
  model.summary.warn(
      "no angle is measured: it is taken from the vibration itself; the phase of e means nothing (no balancing angle), "
      "k1, k2, c and the size of e are found beside it. A once-per-turn pulse (--pulses) gives both");
  if (model.summary.chi_square > rules::kAngleUnknown) {
    model.summary.fail(fmt::format(
        "chi-square {:.3g}: the speed is not a polynomial in time, or this is no rotor on a cubic spring, and "
        "without an angle the two cannot be distinguished: measure a once-per-turn pulse",
        model.summary.chi_square));
    model.summary.trust = "Do not use this model.";
  }
}

void state_angle_step(const std::vector<RotorRecord>& records, RotorIdentification& result) {
  constexpr double kCoarse = 0.01;  // rad
  constexpr double kFit = 1.02;     // a smooth angle through such steps is itself some per cent of one off
  double step = 0;
  for (const RotorRecord& r : records) step = std::max(step, r.angle_step);
  if (step == 0) return;
  const double half = kFit * 0.5 * step;
  for (auto& [name, e] : result.model.parameters) {
    if (name.starts_with("e_phase")) e = Estimate::from_sd(e.value, e.sd + half / rules::k95);
  }
  spread_phase(result.model, half / rules::k95);
  if (half < kCoarse) return;
  result.model.summary.warn(fmt::format(
      "the angle comes in steps of {:.3g} deg and nothing says how it is rounded: the phase of e is known to "
      "{:.2g} deg; a once-per-turn pulse (--pulses) or a finer encoder tells more",
      step / kRadPerDegree, half / kRadPerDegree));
}

void state_modes_above(RotorIdentification& result) {
  if (result.active.modes.given < 0) return;
  const auto place = static_cast<std::size_t>(result.active.modes.given);
  const double w = result.fit.model.modes[place].omega;
  double most = 0, highest = 0;
  for (const OutputErrorRecord& r : result.fit.records) {
    const double top = r.angle.omega.cwiseAbs().maxCoeff();
    most = std::max(most, std::abs(r.participation[place]) * top * top / (w * w - top * top));
    highest = std::max(highest, top);
  }
  result.assumptions.push_back(fmt::format(
      "modes above the speeds move the readings by up to {:.2g} um (peak) and act as one of {:.3g} Hz. k1, k2, c and e "
      "are those of the first mode; no prediction above {:.3g} Hz",
      1e6 * most, w / (2 * std::numbers::pi), highest / (2 * std::numbers::pi)));
}

void state_one_axis(const std::vector<RotorRecord>& records, RotorIdentification& result) {
  if (!std::ranges::all_of(records, &RotorRecord::one_axis)) return;
  const char axis = records.front().axes == Axes::x ? 'x' : 'y', other = axis == 'x' ? 'y' : 'x';
  result.assumptions.push_back(fmt::format(
      "isotropic rotor: {} is not measured and taken to move as {} does, a quarter turn apart", other, axis));
  result.assumptions.emplace_back("forward whirl: one axis does not show which way the motion turns");
  result.model.ambiguities.push_back(
      {fmt::format("axes that are alike, or a stiffness or damping of {0} that differs from that of {1}, a coupling of "
                   "the axes, or backward whirl: {0} is not measured",
                   other, axis),
       fmt::format("k1, c and e are those along {}; k2 and c also rest on {} moving alike, a quarter turn apart; "
                   "nothing is known of the critical speed of {}",
                   axis, other, other),
       "a second probe at right angles to the first"});
  if (result.model.summary.chi_square > rules::kNoTrust) {
    result.model.summary.fail(fmt::format(
        "chi-square {:.3g}: the motion along {} is not that of a rotor whose axes are alike; with unequal or "
        "coupled axes one direction does not tell k1, c and e: a second probe does",
        result.model.summary.chi_square, axis));
    result.model.summary.trust = "Do not use this model.";
  }
  // Along one axis another kind of damping and a coupling of the axes look alike.
  const double more = damping_of_terms(records, result.fit);
  for (auto& [name, e] : result.model.parameters) {
    if (name == "c" && more > 0) e = Estimate::from_sd(e.value, std::hypot(e.sd, more));
  }
  if (result.model.rotor_covariance.size() == 25) result.model.rotor_covariance[12] += more * more;
}

void carry_ambiguities(const GrownRotor& grown, double scale, RotorIdentification& result) {
  IdentifiedModel& model = result.model;
  const IdentifiedModel found = model;
  bow_beside_runout(grown.bow, result);
  springs_along_axes(grown, result);
  either_probe(result);
  delay_of_filter(result);
  either_clock(result);
  change_beside_friction(result);
  for (const OtherReading& reading : grown.others) {
    IdentifiedModel other;
    describe_rotor(ParameterView(reading.fit, scale), reading.fit, other);
    Ambiguity a;
    a.readings = reading.taken.empty()
                     ? fmt::format("without or with {}: there is a weak sign of it", reading.other)
                     : fmt::format("{} or {}: the records cannot tell them apart", reading.taken, reading.other);
    a.consequence = difference(found, other);
    a.experiment = to_string(reading.decider);
    a.alternatives.push_back(alternative(reading.taken.empty() ? "with " + reading.other : reading.other,
                                         odds_of(result.fit, reading.fit), found, other));
    model.summary.warn(fmt::format("{}; {}; to decide: {}", a.readings, a.consequence, a.experiment));
    model.ambiguities.push_back(std::move(a));
    widen(model, other);
  }
}

}  // namespace whirl::identification::detail
