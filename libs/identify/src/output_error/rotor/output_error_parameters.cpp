#include "output_error/rotor/output_error_parameters.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "output_error/rotor/reading_shift.hpp"

namespace whirl::identification::detail {
namespace {

std::string name(const std::string& base, int record) {
  return record <= 0 ? base : fmt::format("{}_{}", base, record + 1);
}
void add_lanes(std::vector<Parameter>& list, int record, std::initializer_list<std::pair<const char*, int>> lanes) {
  for (const auto& [n, lane] : lanes) list.push_back({name(n, record), Kind::lane, record, lane});
}
void add_complex(std::vector<Parameter>& list, const std::string& base, Kind kind, int record, int index) {
  list.push_back({name(base + "_re", record), kind, record, index, false});
  list.push_back({name(base + "_im", record), kind, record, index, true});
}

// Poles stay positive and stable; a step may shrink them by a third at most.
double bounded(double value, double change, double most) { return std::clamp(value + change, value / 1.5, most); }

/// A real number, or a part of a complex one.
struct Slot {
  double* real = nullptr;
  Complex* number = nullptr;
  bool imaginary = false;

  double value() const { return real != nullptr ? *real : imaginary ? number->imag() : number->real(); }
  void add(double d) const {
    if (real != nullptr) {
      *real += d;
    } else {
      *number += imaginary ? Complex(0, d) : Complex(d, 0);
    }
  }
};

Slot lane_slot(Point& p, const Parameter& q) {
  OutputErrorRecord* r = q.record >= 0 ? &p.records[static_cast<std::size_t>(q.record)] : nullptr;
  switch (q.index) {
    case kK1:
      return {r != nullptr ? &r->k1_change : &p.model.k1};
    case kK2:
      return {&p.model.k2};
    case kC:
      return {r != nullptr ? &r->c_change : &p.model.c};
    case kEpsRe:
    case kEpsIm:
      return {nullptr, &r->eps, q.index == kEpsIm};
    case kX0:
    case kY0:
      return {nullptr, &r->z0, q.index == kY0};
    case kVx0:
    case kVy0:
      return {nullptr, &r->dz0, q.index == kVy0};
    case kConjKRe:
    case kConjKIm:
      return {nullptr, &p.model.k1_conj, q.index == kConjKIm};
    case kConjCRe:
    case kConjCIm:
      return {nullptr, &p.model.c_conj, q.index == kConjCIm};
    default:
      if (q.record < 0) return {q.imaginary ? &p.clock_drift : &p.delay};
      return {&p.profile[static_cast<std::size_t>(q.record)][q.index - kProfile]};
  }
}

/// Where the number that a parameter stands for lies.
Slot slot(Point& p, const Parameter& q) {
  const auto k = static_cast<std::size_t>(q.index);
  OutputErrorRecord* r = q.record >= 0 ? &p.records[static_cast<std::size_t>(q.record)] : nullptr;
  switch (q.kind) {
    case Kind::lane:
      return lane_slot(p, q);
    case Kind::term:
      return {&p.terms[k].value};
    case Kind::reference:
      return {&p.terms[k].reference};
    case Kind::sensor:
      return {&(p.sensor.*q.sensor->sensor)};
    case Kind::charge:
      return {nullptr, q.index == 0 ? &r->charge : &r->charge_rate, q.imaginary};
    case Kind::offset:
      return {nullptr, &r->offset, q.imaginary};
    case Kind::participation:
      return {nullptr, &r->participation[k], q.imaginary};
    case Kind::decay:
      return {nullptr, &r->decay[k], q.imaginary};
    case Kind::runout:
      return {nullptr, &r->runout[k], q.imaginary};
    case Kind::pole_w:
      return {&p.model.modes[k].omega};
    case Kind::pole_zeta:
      return {&p.model.modes[k].zeta};
    case Kind::decay_w:
      return {&p.decays[k].omega};
    case Kind::decay_zeta:
      return {&p.decays[k].zeta};
  }
  return {};
}

}  // namespace

Lean lean(const SensorAxes& sensor) {
  return {(1 + sensor.gain) * std::sin(sensor.angle), (1 + sensor.gain) * std::cos(sensor.angle)};
}

HighPass high_pass_of(const SensorAxes& sensor, double dt) {
  return {sensor.high_pass * dt, sensor.high_pass_square * dt * dt};
}

Eigen::VectorXcd cubes(const Eigen::VectorXcd& motion) {
  return motion.unaryExpr(
      [](const Complex& z) { return Complex(z.real() * z.real() * z.real(), z.imag() * z.imag() * z.imag()); });
}

Eigen::ArrayXd drifted_gain(const SensorAxes& sensor, Eigen::Index samples, const Instants& at) {
  const double first = at.t0 - sensor.drift_start;
  return 1 + sensor.gain_drift *
                 Eigen::ArrayXd::LinSpaced(samples, first, first + at.dt * static_cast<double>(samples - 1));
}

Eigen::VectorXcd probe_signal(const SensorAxes& sensor, const Eigen::VectorXcd& motion, const Instants& at) {
  Eigen::VectorXcd out = motion;
  if (sensor.cubic != 0) out += sensor.cubic * cubes(motion);
  if (sensor.gain_drift != 0) out.array() *= drifted_gain(sensor, out.size(), at);
  return sensor.high_pass > 0 ? high_passed(out, high_pass_of(sensor, at.dt)) : out;
}

Eigen::VectorXcd read_by(const SensorAxes& sensor, const Eigen::VectorXcd& motion, const Instants& at) {
  Eigen::VectorXcd out = probe_signal(sensor, motion, at);
  if (sensor.gain == 0 && sensor.angle == 0 && sensor.skew == 0) return out;
  out.imag() = later(lean(sensor).y * out.imag() + lean(sensor).x * out.real(), sensor.skew / at.dt);
  return out;
}

Eigen::VectorXcd unread_by(const SensorAxes& sensor, const Eigen::VectorXcd& readings,
                           const Eigen::VectorXcd& simulated, const Instants& at) {
  Eigen::VectorXcd out = readings;
  if (sensor.gain != 0 || sensor.angle != 0 || sensor.skew != 0) {
    const Eigen::VectorXd y = later(readings.imag(), -sensor.skew / at.dt);
    out.imag() = (y - lean(sensor).x * readings.real()) / lean(sensor).y;
  }
  if (sensor.high_pass > 0 || sensor.cubic != 0 || sensor.gain_drift != 0)
    out += simulated - probe_signal(sensor, simulated, at);
  return out;
}

std::vector<Parameter> parameter_list(const std::vector<RotorRecord>& records, const OutputErrorOptions& options,
                                      std::size_t mode_count) {
  const int modes = static_cast<int>(mode_count);
  std::vector<Parameter> list;
  if (options.rotor) add_lanes(list, -1, {{"k1", kK1}, {"k2", kK2}, {"c", kC}});
  if (options.conj_stiffness) add_lanes(list, -1, {{"k1_conj_re", kConjKRe}, {"k1_conj_im", kConjKIm}});
  if (options.conj_damping) add_lanes(list, -1, {{"c_conj_re", kConjCRe}, {"c_conj_im", kConjCIm}});
  if (options.clock.delay) list.push_back({"delay", Kind::lane, -1, kProfile + options.clock.profile_degree});
  if (options.clock.drift)
    list.push_back(
        {"clock_drift", Kind::lane, -1, kProfile + options.clock.profile_degree + options.clock.delay, true});
  for (int k = 0; options.free_terms && k < static_cast<int>(options.terms.size()); ++k) {
    list.push_back({std::string(options.terms[static_cast<std::size_t>(k)].parameter()), Kind::term, -1, k});
  }
  for (int k = 0; options.free_terms && k < static_cast<int>(options.terms.size()); ++k) {
    const RotorTerm& term = options.terms[static_cast<std::size_t>(k)];
    if (term.entry->by_reference != nullptr && term.part == 0)
      list.push_back({std::string(term.entry->reference_name), Kind::reference, -1, k});
  }
  for (const TermEntry* entry : term_catalogue()) {
    if (options.estimates(*entry))
      list.push_back({std::string(entry->parameters[0].name), Kind::sensor, -1, 0, false, entry});
  }
  for (int k = 0; options.modes.poles && k < modes; ++k) {
    if (k == options.modes.given) continue;
    list.push_back({fmt::format("w_mode{}", k + 1), Kind::pole_w, -1, k});
    list.push_back({fmt::format("zeta_mode{}", k + 1), Kind::pole_zeta, -1, k});
  }
  const int n_decays = static_cast<int>(options.modes.decays.size());
  for (int k = 0; options.modes.poles && k < n_decays; ++k) {
    list.push_back({fmt::format("w_decay{}", k + 1), Kind::decay_w, -1, k});
    list.push_back({fmt::format("zeta_decay{}", k + 1), Kind::decay_zeta, -1, k});
  }
  for (int r = 0; r < static_cast<int>(records.size()); ++r) {
    // One axis reads amplitudes of e^{i beta} and e^{-i beta} alike: the forward one stands for both.
    const Axes axes = records[static_cast<std::size_t>(r)].axes;
    const int senses = axes == Axes::both ? 1 : 2;
    if (r > 0 && !options.changes.k1.empty()) add_lanes(list, r, {{"k1_change", kK1}});
    if (r > 0 && !options.changes.c.empty()) add_lanes(list, r, {{"c_change", kC}});
    if (options.unbalance) add_lanes(list, r, {{"eps_re", kEpsRe}, {"eps_im", kEpsIm}});
    add_lanes(list, r, {{"x0", kX0}, {"y0", kY0}, {"vx0", kVx0}, {"vy0", kVy0}});
    for (int k = 0; k < options.clock.profile_degree; ++k) {
      list.push_back({name(fmt::format("profile{}", k + 1), r), Kind::lane, r, kProfile + k});
    }
    for (const TermEntry* entry : term_catalogue()) {
      if (entry->charge.empty() || !(options.estimates(*entry) || options.probes.start.*entry->sensor > 0)) continue;
      const bool rate = entry->after != nullptr;
      const std::string charge(entry->charge);
      if (axes != Axes::y) list.push_back({name(charge + "_re", r), Kind::charge, r, rate, false});
      if (axes != Axes::x) list.push_back({name(charge + "_im", r), Kind::charge, r, rate, true});
    }
    if (options.offset && axes != Axes::y) list.push_back({name("offset_re", r), Kind::offset, r, 0, false});
    if (options.offset && axes != Axes::x) list.push_back({name("offset_im", r), Kind::offset, r, 0, true});
    for (int k = 0; options.modes.participation && k < modes; ++k) {
      add_complex(list, fmt::format("mode{}", k + 1), Kind::participation, r, k);
    }
    for (int k = 0; k < 2 * n_decays; k += senses) {
      add_complex(list, fmt::format("decay{}{}", k / 2 + 1, k % 2 == 0 ? "+" : "-"), Kind::decay, r, k);
    }
    for (int k = 0; k < 2 * options.probes.runout_harmonics; k += senses) {
      add_complex(list, fmt::format("runout{}{}", k / 2 + 1, k % 2 == 0 ? "+" : "-"), Kind::runout, r, k);
    }
  }
  return list;
}

void move(Point& p, const Parameter& q, double d) {
  const Slot at = slot(p, q);
  if (q.kind == Kind::sensor && q.sensor->not_negative) {
    *at.real = std::max(0.0, *at.real + d);
  } else if (q.kind == Kind::pole_w || q.kind == Kind::decay_w) {
    *at.real = bounded(*at.real, d, INFINITY);
  } else if (q.kind == Kind::pole_zeta || q.kind == Kind::decay_zeta) {
    *at.real = bounded(*at.real, d, 0.9);
  } else {
    at.add(d);
  }
  if (q.kind != Kind::reference) return;
  for (RotorTerm& t : p.terms)  // all parts of an entry have one
    if (t.is(*p.terms[static_cast<std::size_t>(q.index)].entry)) t.reference = *at.real;
}

double value(const Point& p, const Parameter& q) {
  return slot(const_cast<Point&>(p), q).value();  // one accessor for reading and moving
}

}  // namespace whirl::identification::detail
