#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "runs/design_scenarios.hpp"
#include "whirl/identify/rotor_terms.hpp"

namespace whirl::tuning {

double Hardware::loop_delay() const {
  const double lag = actuator.bandwidth > 0 ? 1 / (2 * std::numbers::pi * actuator.bandwidth) : 0;
  return laser.delay() + actuator.delay_samples / timing.rate + lag;
}

Hardware data_sheet(const rig::RigParameters& rig) {
  Hardware h;
  h.laser.noise = rig.laser.noise;
  h.laser.range = rig.laser.range;
  h.laser.bits = rig.laser.bits;
  h.laser.rate = rig.laser.rate;
  h.laser.latency = rig.laser.latency;
  h.laser.bandwidth = rig.laser.bandwidth;
  h.laser.hysteresis = rig.laser.hysteresis;
  h.laser.runout_1x = 10e-6, h.laser.runout_2x = 5e-6, h.laser.runout_3x = 2.5e-6;
  h.laser.runout_phase_1x = h.laser.runout_phase_2x = h.laser.runout_phase_3x = 0;
  h.actuator.voltage_limit = rig.actuator.voltage_limit;
  h.actuator.bits = rig.actuator.bits;
  h.actuator.force_per_volt = rig.actuator.force_per_volt;
  h.actuator.bandwidth = rig.actuator.bandwidth;
  h.actuator.delay_samples = rig.actuator.delay_samples;
  h.actuator.current_limit = rig.actuator.current_limit;
  h.actuator.force_per_ampere = rig.actuator.force_per_ampere;
  h.actuator.slew = rig.actuator.slew;
  h.actuator.hysteresis = rig.actuator.hysteresis;
  h.actuator.turns_held_force = rig.actuator.turns_held_force;
  h.actuator.gain_error = h.actuator.axis_rotation = 0;
  h.encoder = rig.encoder;
  h.timing = rig.timing;
  h.profile = rig.profile.without_ripple();
  return h;
}

namespace {

/// Acceleration per newton of a mode in a channel: its inverse modal mass, signed, 1/kg.
double inverse_mass(const Mode& mode, Eigen::Index channel) {
  return -2 * mode.pole.imag() * mode.residues[channel].imag();
}

bool is_rotor(const Mode& mode, double rotor_omega) {
  return std::abs(2 * std::numbers::pi * mode.frequency.value / rotor_omega - 1) < 0.1;
}

}  // namespace

std::vector<rig::RigMode> structure_modes(const ModalModel& modal, double rotor_omega, double fallback) {
  Eigen::Index channels = modal.modes.empty() ? 0 : modal.modes.front().residues.size();
  for (const Mode& mode : modal.modes) channels = std::min(channels, mode.residues.size());
  // The rotor's own mode may be split by anisotropy: its parts together are the rotor.
  Eigen::Index channel = 0;
  double rotor = 0;
  for (Eigen::Index c = 0; c < channels; ++c) {
    double sum = 0;
    for (const Mode& mode : modal.modes) {
      if (is_rotor(mode, rotor_omega)) sum += inverse_mass(mode, c);
    }
    if (std::abs(sum) > std::abs(rotor)) rotor = sum, channel = c;
  }
  const auto at = static_cast<std::size_t>(channel);
  const bool named = at < modal.responses.size() && at < modal.references.size();
  const bool drive_point = named && modal.responses[at] == modal.references[at];
  std::vector<rig::RigMode> out;
  for (const Mode& mode : modal.modes) {
    // Poles beyond the band stand for what it does not show; they are no modes.
    const bool outside = modal.band_high > 0 && mode.frequency.value > modal.band_high;
    if (outside || is_rotor(mode, rotor_omega) || 2 * std::numbers::pi * mode.frequency.value < rotor_omega) continue;
    rig::RigMode m{mode.frequency.value, std::max(mode.damping.value, 1e-3), fallback, 0, 0};
    if (rotor != 0) {
      const double ratio = inverse_mass(mode, channel) / rotor;
      if (std::abs(ratio) < 5e-4) continue;
      m.participation = std::abs(ratio);
      m.sensor_sign = ratio < 0 ? -1 : drive_point ? 0 : 1;
    }
    out.push_back(m);
  }
  return out;
}

std::vector<rig::RigMode> known_modes(std::vector<rig::RigMode> modes, const std::vector<rig::RigMode>& data_sheet) {
  for (const rig::RigMode& known : data_sheet) {
    std::erase_if(modes, [&](const rig::RigMode& m) { return std::abs(m.frequency / known.frequency - 1) < 0.05; });
  }
  modes.insert(modes.end(), data_sheet.begin(), data_sheet.end());
  std::ranges::sort(modes, {}, &rig::RigMode::frequency);
  return modes;
}

std::vector<Hardware> Hardware::sign_cases() const {
  std::vector<std::size_t> open;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (modes[i].sensor_sign == 0) open.push_back(i);
  }
  const bool each = open.size() <= 3;
  const std::size_t cases = open.empty() ? 1 : each ? std::size_t{1} << open.size() : 2;
  std::vector<Hardware> out(cases, *this);
  for (std::size_t c = 0; c < cases; ++c) {
    for (std::size_t i = 0; i < open.size(); ++i) {
      out[c].modes[open[i]].sensor_sign = (each ? (c >> i) & 1 : c) != 0 ? -1 : 1;
    }
  }
  return out;
}

std::string Hardware::signs_of(const Hardware& chosen) const {
  std::string out;
  for (std::size_t i = 0; i < modes.size(); ++i) {
    if (modes[i].sensor_sign != 0) continue;
    out += fmt::format("{}mode {} ({:.1f} Hz) {}", out.empty() ? "" : ", ", i + 1, modes[i].frequency,
                       chosen.modes[i].sensor_sign < 0 ? '-' : '+');
  }
  return out;
}

namespace {

constexpr int kMostSubsteps = 256;
/// Of friction at rest, per Runge-Kutta step: a third of what the rig accepts, so that rotors drawn about this one run.
constexpr double kFrictionPerStep = 0.5;

/// Steps per tick for friction that at rest is a damper of `rate`, 1/s; 0: more than there may be.
int substeps_for(double rate, const rig::RigTiming& timing) {
  for (int n = timing.substeps; n <= kMostSubsteps; n *= 2) {
    if (rate <= kFrictionPerStep * timing.rate * n) return n;
  }
  return 0;
}

/// 1/s; 0 without friction, infinite for friction that pushes.
double friction_rate(const identification::RotorTerm& term) {
  if (!term.entry->dry) return 0;
  return term.value >= 0 && term.reference > 0 ? term.value / term.reference : std::numeric_limits<double>::infinity();
}

void add_force(rotor::FurtherForces<double>& f, const identification::RotorTerm& term) {
  if (term.entry->plant[term.part] == nullptr) return;  // the plants have none: forces_left_out
  f.*term.entry->plant[term.part] = term.value;
  if (term.entry->plant_reference != nullptr) f.*term.entry->plant_reference = term.reference;
}

}  // namespace

namespace {

/// Size of the error of the first harmonic, that 5 % exceed (Rayleigh), m; 0 where none was identified.
double runout_error(const IdentifiedModel& model) {
  constexpr double kRayleigh = 1.7308;  // sqrt(-ln 0.05), of the root mean square
  double square = 0;
  for (const char* name : {"runout1+_re", "runout1+_im", "runout1-_re", "runout1-_im"}) {
    if (const Estimate* e = model.parameter(name); e != nullptr && std::isfinite(e->sd)) square += e->sd * e->sd;
  }
  return kRayleigh * std::sqrt(square);
}

}  // namespace

rotor::FurtherForces<double> further_forces(const std::vector<identification::RotorTerm>& terms) {
  rotor::FurtherForces<double> out;
  for (const identification::RotorTerm& term : terms) add_force(out, term);
  return out;
}

Hardware with_forces(Hardware hardware, const IdentifiedModel& model) {
  std::vector<identification::RotorTerm> terms = identification::terms_of(model);
  std::erase_if(terms, [&](const auto& t) { return substeps_for(friction_rate(t), hardware.timing) == 0; });
  for (const auto& term : terms) hardware.timing.substeps = substeps_for(friction_rate(term), hardware.timing);
  hardware.forces = further_forces(terms);
  hardware.runout_error = runout_error(model);
  return hardware;
}

std::vector<identification::RotorTerm> forces_left_out(const IdentifiedModel& model, const Hardware& hardware) {
  std::vector<identification::RotorTerm> left = identification::terms_of(model);
  std::erase_if(left, [&](const auto& t) {
    return t.entry->plant[t.part] != nullptr && substeps_for(friction_rate(t), hardware.timing) != 0;
  });
  return left;
}

rig::RigParameters tuning_plant(const RotorModel& model, const Hardware& hardware) {
  rig::RigParameters p;
  const double mass = 1 / model.gain;
  p.rotor.mass = mass;
  p.rotor.stiffness = model.k1 * mass;
  p.rotor.cubic = model.k2 * mass;
  p.rotor.damping = model.c * mass;
  p.rotor.stiffness_split = model.k1_conj.real() / model.k1;
  p.rotor.cross_stiffness = model.k1_conj.imag() * mass;
  p.rotor.damping_split = model.c != 0 ? model.c_conj.real() / model.c : 0;
  p.rotor.residual_eccentricity = std::abs(model.eps);
  p.rotor.residual_phase = std::arg(model.eps);
  p.rotor.added_mass = 0;
  p.forces = rig::RigForces::of(hardware.forces, mass);
  p.profile = hardware.profile;
  p.modes = hardware.sign_cases().front().modes;
  p.laser = hardware.laser;
  p.actuator = hardware.actuator;
  p.encoder = hardware.encoder;
  p.timing = hardware.timing;
  return p;
}

}  // namespace whirl::tuning
