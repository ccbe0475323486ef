#pragma once
#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "whirl/core/identified_model.hpp"
#include "whirl/identify/parts/model_parts.hpp"
#include "whirl/testing/control/identified_machine.hpp"

/// Models with one part each (identification::ModelPart), as `whirl identify` would write them, every number exact.
namespace whirl::testing {

inline constexpr double kPartMass = 1.5;  ///< kg, of the disc

/// A linear machine of 12 Hz, 60 % of whose peak width its damping makes.
inline Machine plain_machine() {
  Machine m = machine();
  m.cubic = 0;
  return m;
}

inline void put(IdentifiedModel& model, const std::string& name, double value, double sd = 0) {
  for (auto& [own, e] : model.parameters) {
    if (own != name) continue;
    e = Estimate::from_sd(value, sd);
    return;
  }
  model.parameters.emplace_back(name, Estimate::from_sd(value, sd));
}

/// Its five numbers among the parameters too, as identify lists them.
inline IdentifiedModel rotor_with(const Machine& m) {
  IdentifiedModel model = identified(m, kPartMass);
  model.sample_time = 1e-3;
  put(model, "k1", m.k);
  put(model, "k2", m.cubic);
  put(model, "c", m.c);
  put(model, "e", m.e);
  put(model, "e_phase", m.e_phase);
  return model;
}

inline void add_terms(IdentifiedModel& model, const char* lhs,
                      std::initializer_list<std::pair<const char*, double>> terms) {
  Equation e{lhs, {}};
  for (const auto& [function, value] : terms) e.terms.push_back({function, Estimate::from_sd(value, 0), ""});
  model.equations.push_back(std::move(e));
}

/// The disc tilts (Machine::tilts).
inline Machine tilting_machine() {
  Machine m = plain_machine();
  m.tilts = true;
  m.k_tilt = 3.6 * m.k, m.k_couple = 0.4 * m.k, m.polar = 0.3, m.tilt_unbalance = 0.5 * m.e;
  return m;
}
inline IdentifiedModel tilting_model(const Machine& m) {
  IdentifiedModel model;
  model.method = "weak";
  model.sample_time = 1e-3;
  model.states = {"X1", "X2", "X3", "X4", "tilt_x", "tilt_vx", "tilt_y", "tilt_vy"};
  model.inputs = {"X5", "X6", "X7"};
  const char *fx = "X6^2*cos(X5) + X7*sin(X5)", *fy = "X6^2*sin(X5) - X7*cos(X5)";
  const double er = m.e * std::cos(m.e_phase), ei = m.e * std::sin(m.e_phase);
  add_terms(model, "X1'", {{"X2", 1}});
  add_terms(model, "X2'",
            {{"X1", -m.k}, {"X1*(X1^2 + X3^2)", -m.cubic}, {"X2", -m.c}, {"tilt_x", -m.k_couple}, {fx, er}, {fy, -ei}});
  add_terms(model, "X3'", {{"X4", 1}});
  add_terms(model, "X4'",
            {{"X3", -m.k}, {"X3*(X1^2 + X3^2)", -m.cubic}, {"X4", -m.c}, {"tilt_y", -m.k_couple}, {fy, er}, {fx, ei}});
  add_terms(model, "tilt_x'", {{"tilt_vx", 1}});
  const double tr = m.tilt_unbalance * std::cos(m.e_phase), ti = m.tilt_unbalance * std::sin(m.e_phase);
  add_terms(
      model, "tilt_vx'",
      {{"tilt_x", -m.k_tilt}, {"X1", -m.k_couple}, {"tilt_vx", -m.c}, {"X6*tilt_vy", -m.polar}, {fx, tr}, {fy, -ti}});
  add_terms(model, "tilt_y'", {{"tilt_vy", 1}});
  add_terms(
      model, "tilt_vy'",
      {{"tilt_y", -m.k_tilt}, {"X3", -m.k_couple}, {"tilt_vy", -m.c}, {"X6*tilt_vx", m.polar}, {fy, tr}, {fx, ti}});
  const std::pair<const char*, double> numbers[] = {{"k1", m.k},
                                                    {"k2", m.cubic},
                                                    {"c", m.c},
                                                    {"e", m.e},
                                                    {"e_phase", m.e_phase},
                                                    {"k_tilt", m.k_tilt},
                                                    {"k_couple", m.k_couple},
                                                    {"c_tilt", m.c},
                                                    {"polar_ratio", m.polar},
                                                    {"e_tilt", m.tilt_unbalance},
                                                    {"e_tilt_phase", m.e_phase},
                                                    {"offset_x", 0},
                                                    {"offset_y", 0}};
  for (const auto& [name, value] : numbers) put(model, name, value);
  // Undamped, at standstill: both roots of the two by two problem.
  const double mean = 0.5 * (m.k + m.k_tilt), half = std::hypot(0.5 * (m.k - m.k_tilt), m.k_couple);
  put(model, "natural_frequency", std::sqrt(mean - half));
  put(model, "second_frequency", std::sqrt(mean + half));
  return model;
}

/// x'' = -400 x - 4 x' + 100 h with h' = u - 10 h, or with u in the place of 100 h.
inline IdentifiedModel oscillator_model(bool hidden) {
  IdentifiedModel model;
  model.method = "sindy";
  model.sample_time = 1e-2;
  model.states = {"x", "v"};
  model.inputs = {"u"};
  add_terms(model, "x'", {{"v", 1}});
  add_terms(model, "v'", {{"x", -400}, {"v", -4}, {hidden ? "h1" : "u", hidden ? 100 : 1}});
  if (hidden) {
    model.states.push_back("h1");
    add_terms(model, "h1'", {{"h1", -10}, {"u", 1}});
  }
  return model;
}
/// Its amplitude of x for u = cos(w t).
inline double oscillator_gain(bool hidden, double w) {
  const std::complex<double> i(0, 1);
  const std::complex<double> spring = 400.0 - w * w + 4.0 * i * w;
  return std::abs(hidden ? 100.0 / (10.0 + i * w) / spring : 1.0 / spring);
}

/// A mode of 60 Hz beside the rotor.
inline ForcedMode further_mode() { return {2 * std::numbers::pi * 60, 0.02, std::polar(4e-5, 2.0)}; }

/// Puts a part into the rotor of rotor_with(plain_machine()), where it is one of a rotor.
inline void add_part(IdentifiedModel& model, identification::ModelPart part) {
  using identification::ModelPart;
  RotorModel& r = *model.rotor;
  switch (part) {
    case ModelPart::cubic_spring:
      r.k2 = 1.5e8;
      put(model, "k2", r.k2);
      break;
    case ModelPart::unequal_axes:
      r.k1_conj = 114;
      put(model, "k1_conj_re", 114);
      put(model, "k1_conj_im", 0);
      break;
    case ModelPart::coupled_damping:
      r.c_conj = {0, 1.5};
      put(model, "c_conj_re", 0);
      put(model, "c_conj_im", 1.5);
      break;
    case ModelPart::further_modes: {
      r.modes = {further_mode()};
      put(model, "mode1_omega", r.modes[0].omega);
      put(model, "mode1_zeta", r.modes[0].zeta);
      put(model, "mode1_re", r.modes[0].participation.real());
      put(model, "mode1_im", r.modes[0].participation.imag());
      break;
    }
    case ModelPart::further_forces:
      put(model, "c2", 20);
      break;
    case ModelPart::drifts:
      put(model, "k1_drift", -30);
      break;
    case ModelPart::other_quantity:
      model.quantity = Quantity::acceleration;
      break;
    case ModelPart::twice_speed:
      put(model, "e2_forward_re", 1e-4);
      break;
    case ModelPart::other_unbalances:
      put(model, "e_2", 2e-4);
      put(model, "e_phase_2", 1);
      break;
    case ModelPart::changed_machine:
      put(model, "k1_change_2", 60);
      break;
    case ModelPart::ringing:
      put(model, "decay1_omega", 100);
      put(model, "decay1_zeta", 0.01);
      break;
    case ModelPart::runout:
      put(model, "runout1+_re", 2e-5);
      put(model, "runout1+_im", -1e-5);
      put(model, "runout1-_re", 1e-5);
      put(model, "runout1-_im", 0);
      break;
    case ModelPart::sensor_delay:
      put(model, "delay", 1e-3);
      break;
    case ModelPart::sensor_errors:
      put(model, "sensor_gain", 0.03);
      break;
    case ModelPart::covered_readings:
      model.ambiguities.push_back({"soft or hard", "k1 differs", "a pull test", {{"hard", 1, {}, {}}}, true});
      model.ambiguities.back().alternatives[0].parameters = {{"k1", Estimate::from_sd(r.k1 + 50, 1)}};
      break;
    case ModelPart::other_readings:
      r.k2 = 1.5e8;
      put(model, "k2", r.k2);
      model.ambiguities.push_back(
          {"radial or per axis", "k2 differs", "a pull test", {{"per axis", 1, {}, {}}}, false});
      model.ambiguities.back().alternatives[0].parameters = {{"k2", Estimate::from_sd(0, 0)},
                                                             {"k2_axis", Estimate::from_sd(2.6e8, 0)}};
      break;
    case ModelPart::covariance: {
      // Deviations of 0.3 %, 1 %, 3 % and 2 %.
      const double sd[] = {0.003 * r.k1, 0.01 * r.k2, 0.03 * r.c, 0.02 * std::abs(r.eps), 0.02 * std::abs(r.eps)};
      model.rotor_covariance.assign(25, 0);
      for (std::size_t k = 0; k < 5; ++k) model.rotor_covariance[6 * k] = sd[k] * sd[k];
      put(model, "k1", r.k1, sd[0]);
      put(model, "c", r.c, sd[2]);
      put(model, "e", std::abs(r.eps), sd[3]);
      put(model, "e_phase", std::arg(r.eps), 0.02);
      break;
    }
    case ModelPart::noise:
      model.noise_sd = 1e-6;
      break;
    case ModelPart::input_timing:
      model.timing.push_back({"u", Hold::zero, Estimate::from_sd(0.03, 0)});
      break;
    case ModelPart::drive:
      add_terms(model, "X6'", {{"X6", -0.1}});
      break;
    case ModelPart::tilting_disc:
    case ModelPart::equations:
    case ModelPart::map:
    case ModelPart::hidden_states:
      break;  // models of their own
  }
}

/// x[k+1] = x/2 + u.
inline IdentifiedModel map_model() {
  IdentifiedModel model;
  model.method = "sindy";
  model.sample_time = 1e-2;
  model.states = {"x"};
  model.inputs = {"u"};
  add_terms(model, "x[k+1]", {{"x", 0.5}, {"u", 1}});
  return model;
}

/// A model that has the part, and of a rotor's parts nothing else.
inline IdentifiedModel model_with(identification::ModelPart part) {
  using identification::ModelPart;
  switch (part) {
    case ModelPart::tilting_disc:
      return tilting_model(tilting_machine());
    case ModelPart::equations:
      return oscillator_model(false);
    case ModelPart::hidden_states:
      return oscillator_model(true);
    case ModelPart::map:
      return map_model();
    case ModelPart::input_timing: {
      IdentifiedModel model = oscillator_model(false);
      model.timing.push_back({"u", Hold::zero, Estimate::from_sd(0.03, 0)});
      return model;
    }
    default: {
      IdentifiedModel model = rotor_with(plain_machine());
      add_part(model, part);
      return model;
    }
  }
}

}  // namespace whirl::testing
