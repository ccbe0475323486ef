#include "whirl/io/model_json.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "formats/json/parts.hpp"
#include "whirl/core/names.hpp"
#include "whirl/core/nan.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::io {
namespace {

std::vector<std::string> read_identifiers(const JsonReader& in) {
  std::vector<std::string> out;
  for (const JsonReader& i : in.items()) {
    if (std::find(out.begin(), out.end(), i.identifier()) != out.end())
      throw i.error(fmt::format("'{}' is there twice", i.text()));
    out.push_back(i.text());
  }
  return out;
}

std::string read_term(const JsonReader& in) {
  try {
    (void)expr::Expr::parse(in.label());
  } catch (const Error& e) {
    throw in.error(e.what());
  }
  return in.text();
}

Json rotor_json(const RotorModel& r) {
  Json modes = Json::array();
  for (const ForcedMode& m : r.modes) {
    modes.push(Json::object().set("omega", m.omega).set("zeta", m.zeta).set("participation", to_json(m.participation)));
  }
  Json out;
  out.set("k1", r.k1).set("k2", r.k2).set("c", r.c).set("k1_conj", to_json(r.k1_conj)).set("c_conj", to_json(r.c_conj));
  out.set("eps", to_json(r.eps)).set("offset", to_json(r.offset)).set("gain", r.gain).set("modes", std::move(modes));
  return out;
}

RotorModel read_rotor(const JsonReader& in) {
  RotorModel r;
  r.k1 = in.at("k1").number();
  r.k2 = in.at("k2").number();
  r.c = in.at("c").number();
  r.k1_conj = in.at("k1_conj").complex();
  r.c_conj = in.at("c_conj").complex();
  r.eps = in.at("eps").complex();
  r.offset = in.at("offset").complex();
  r.gain = in.at("gain").number();
  for (const JsonReader& m : in.at("modes").items()) {
    r.modes.push_back({m.at("omega").number(), m.at("zeta").number(), m.at("participation").complex()});
  }
  return r;
}

std::map<std::string, double> read_map(const JsonReader& in) {
  std::map<std::string, double> out;
  for (const auto& [key, value] : in.members()) {
    value.require_label(key);
    out[key] = value.number_or_nan();
  }
  return out;
}

Json map_json(const std::map<std::string, double>& values) {
  Json out = Json::object();
  for (const auto& [key, value] : values) out.set(key, value);
  return out;
}

constexpr std::array<std::string_view, 5> kRotorParameters{"k1", "k2", "c", "e", "e_phase"};

std::array<double, 5> rotor_values(const RotorModel& r) { return {r.k1, r.k2, r.c, std::abs(r.eps), std::arg(r.eps)}; }

}  // namespace

std::string_view parameter_unit(std::string_view name) {
  constexpr std::pair<std::string_view, std::string_view> units[] = {{"k1", "1/s^2"},
                                                                     {"k2", "1/(m^2 s^2)"},
                                                                     {"c", "1/s"},
                                                                     {"e", "m"},
                                                                     {"e_phase", "rad"},
                                                                     {"k1_conj", "1/s^2"},
                                                                     {"c_conj", "1/s"},
                                                                     {"eps", "m"},
                                                                     {"offset", "m"},
                                                                     {"offset_velocity", "m/s"},
                                                                     {"offset_acceleration", "m/s^2"},
                                                                     {"gain", "1/kg"},
                                                                     {"omega", "rad/s"},
                                                                     {"f0", "Hz"},
                                                                     {"zeta", "1"},
                                                                     {"rmse", "m"},
                                                                     {"k3", "1/(m^4 s^2)"},
                                                                     {"k_cubic", "1/(m^2 s^2)"},
                                                                     {"k_quintic", "1/(m^4 s^2)"},
                                                                     {"c_quadratic", "1/m"},
                                                                     {"c2", "1/m"},
                                                                     {"friction", "m/s^2"},
                                                                     {"friction_speed", "m/s"},
                                                                     {"gyroscopic", "1"},
                                                                     {"k_cross", "1/s^2"},
                                                                     {"k1_speed", "1/(rad s)"},
                                                                     {"c_speed", "1/rad"},
                                                                     {"k1_drift", "1/s^3"},
                                                                     {"c_drift", "1/s^2"},
                                                                     {"drift_start", "s"},
                                                                     {"e2", "m"},
                                                                     {"sensor", "1"},
                                                                     {"sensor_angle", "rad"},
                                                                     {"sensor_skew", "s"},
                                                                     {"sensor_high_pass", "rad/s"},
                                                                     {"sensor_high_pass_square", "rad^2/s^2"},
                                                                     {"sensor_cubic", "1/m^2"},
                                                                     {"sensor_gain_drift", "1/s"},
                                                                     {"sensor_drift_start", "s"},
                                                                     {"natural_frequency", "rad/s"},
                                                                     {"damping_ratio", "1"},
                                                                     {"delay", "s"},
                                                                     {"clock_drift", "1"},
                                                                     {"k_radius", "1/(m s^2)"},
                                                                     {"k_hertz", "1/(m^0.5 s^2)"},
                                                                     {"kq", "1/(m s^2)"},
                                                                     {"c_film", "1/(m^2 s)"},
                                                                     {"loss_speed", "rad/s"},
                                                                     {"sag_turning", "m/s^2"},
                                                                     {"stiffness_step_time", "s"},
                                                                     {"unbalance_step_time", "s"},
                                                                     {"bow_growth", "m/s^3"},
                                                                     {"bow", "m"},
                                                                     {"bow_phase", "rad"},
                                                                     {"k_tilt", "1/s^2"},
                                                                     {"k_couple", "1/s^2"},
                                                                     {"polar_ratio", "1"},
                                                                     {"e_tilt_phase", "rad"},
                                                                     {"second_frequency", "rad/s"}};
  if (name.starts_with("runout")) return "m";  // runout1+_re
  while (true) {
    for (const auto& [key, unit] : units) {
      if (key == name) return unit;
    }
    const std::size_t underscore = name.rfind('_');
    if (underscore == std::string_view::npos) return {};
    name = name.substr(0, underscore);
  }
}

Json to_json(const StiffnessLaw& law) {
  Json out = start_document("whirl.stiffness", 1);
  out.set("k1", to_json(law.k1, "N/m")).set("k2", to_json(law.k2, "N/m^3")).set("offset", to_json(law.offset, "m"));
  out.set("cubic_p_value", law.cubic_p_value).set("hysteresis_N", law.hysteresis).set("points", law.points);
  finish(out, law.summary, law.provenance);
  return out;
}

template <>
StiffnessLaw from_json(const Json& document, std::string_view source) {
  const JsonReader in(document, std::string(source));
  in.require_schema("whirl.stiffness", 1);
  StiffnessLaw law;
  law.k1 = read_estimate(in.at("k1"));
  law.k2 = read_estimate(in.at("k2"));
  law.offset = read_estimate(in.at("offset"));
  law.cubic_p_value = in.at("cubic_p_value").number();
  law.hysteresis = in.at("hysteresis_N").number();
  law.points = in.at("points").integer();
  read_finish(in, law);
  return law;
}

namespace {

Json timing_json(const std::vector<InputTiming>& timing) {
  Json list = Json::array();
  for (const InputTiming& t : timing) {
    Json one = Json::object().set("input", t.input).set("hold", std::string(to_string(t.hold)));
    list.push(std::move(one.set("dead_time", to_json(t.dead_time, "s"))));
  }
  return list;
}

std::vector<InputTiming> read_timing(const JsonReader& in) {
  std::vector<InputTiming> timing;
  for (const JsonReader& t : in.items()) {
    InputTiming one;
    one.input = t.at("input").identifier();
    const std::string hold = t.at("hold").text();
    if (hold != "zero" && hold != "first" && hold != "band-limited")
      throw t.at("hold").error("must be zero, first or band-limited");
    one.hold = hold_of(hold);
    one.dead_time = read_estimate(t.at("dead_time"));
    timing.push_back(std::move(one));
  }
  return timing;
}

Json estimates_json(const std::vector<std::pair<std::string, Estimate>>& estimates) {
  Json out = Json::object();
  for (const auto& [name, estimate] : estimates) out.set(name, to_json(estimate, parameter_unit(name)));
  return out;
}

std::vector<std::pair<std::string, Estimate>> read_estimates(const JsonReader& in) {
  std::vector<std::pair<std::string, Estimate>> out;
  for (const auto& [name, value] : in.members()) {
    value.require_label(name);
    out.emplace_back(name, read_estimate(value));
  }
  return out;
}

std::string noise_key(Quantity quantity) {
  return quantity == Quantity::velocity       ? "noise_sd_m_s"
         : quantity == Quantity::acceleration ? "noise_sd_m_s2"
                                              : "noise_sd_m";
}

Quantity read_motion_quantity(const JsonReader& in) {
  for (const Quantity q : {Quantity::displacement, Quantity::velocity, Quantity::acceleration})
    if (in.text() == to_string(q)) return q;
  throw in.error("must be displacement, velocity or acceleration");
}

std::vector<double> read_rotor_covariance(const JsonReader& in) {
  std::vector<double> out = in.numbers();
  if (!out.empty() && out.size() != 25) throw in.error(fmt::format("{} values, must be 25 or none", out.size()));
  return out;
}

Json ambiguities_json(const std::vector<Ambiguity>& ambiguities) {
  Json list = Json::array();
  for (const Ambiguity& a : ambiguities) {
    Json alternatives = Json::array();
    for (const Alternative& one : a.alternatives) {
      alternatives.push(Json::object()
                            .set("reading", one.reading)
                            .set("odds", one.odds)
                            .set("parameters", estimates_json(one.parameters))
                            .set("rotor_covariance", Json(one.rotor_covariance)));
    }
    list.push(Json::object()
                  .set("readings", a.readings)
                  .set("consequence", a.consequence)
                  .set("experiment", a.experiment)
                  .set("covered", a.covered)
                  .set("alternatives", std::move(alternatives)));
  }
  return list;
}

std::vector<Ambiguity> read_ambiguities(const JsonReader& in) {
  std::vector<Ambiguity> out;
  for (const JsonReader& a : in.items()) {
    Ambiguity one{one_line(a.at("readings").text()), one_line(a.at("consequence").text()),
                  one_line(a.at("experiment").text())};
    one.covered = a.at("covered").flag();
    for (const JsonReader& r : a.at("alternatives").items()) {
      Alternative reading;
      reading.reading = one_line(r.at("reading").text());
      reading.odds = r.at("odds").number_or_nan();
      if (reading.odds < 0) throw r.at("odds").error("must not be negative");
      reading.parameters = read_estimates(r.at("parameters"));
      reading.rotor_covariance = read_rotor_covariance(r.at("rotor_covariance"));
      one.alternatives.push_back(std::move(reading));
    }
    out.push_back(std::move(one));
  }
  return out;
}

}  // namespace

Json to_json(const IdentifiedModel& model) {
  Json parameters = estimates_json(model.parameters);
  if (model.rotor) {
    const std::array<double, 5> values = rotor_values(*model.rotor);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!parameters.find(kRotorParameters[i])) {
        parameters.set(std::string(kRotorParameters[i]),
                       to_json(Estimate{values[i], kNaN, kNaN, kNaN}, parameter_unit(kRotorParameters[i])));
      }
    }
  }
  const std::size_t n = model.parameters.size();
  const bool complete = model.parameter_covariance.size() == n * n && parameters.get<Json::Object>()->size() == n;
  Json equations = Json::array();
  for (const Equation& e : model.equations) {
    Json terms = Json::array();
    for (const EquationTerm& t : e.terms) {
      Json term = Json::object().set("function", t.function).set("coefficient", t.coefficient.value);
      term.set("sd", t.coefficient.sd).set("ci95", Json::array().push(t.coefficient.low).push(t.coefficient.high));
      terms.push(std::move(term.set("unit", t.unit)));
    }
    equations.push(Json::object().set("lhs", e.lhs).set("terms", std::move(terms)));
  }
  Json out = start_document("whirl.model", 1);
  out.set("method", model.method).set("parameters", std::move(parameters)).set("states", model.states);
  out.set("inputs", model.inputs).set("equations", std::move(equations));
  if (!model.timing.empty()) out.set("input_timing", timing_json(model.timing));
  if (!model.noise_correlation.empty()) {
    Json each = Json::object();
    for (const auto& [state, value] : model.noise_correlation) each.set(state, value);
    out.set("noise_correlation", std::move(each));
  }
  if (!model.ambiguities.empty()) out.set("ambiguities", ambiguities_json(model.ambiguities));
  out.set("rotor", model.rotor ? rotor_json(*model.rotor) : Json())
      .set("rotor_covariance", Json(model.rotor_covariance))
      .set("parameter_covariance",  // parameters added above have none
           Json(complete ? model.parameter_covariance : std::vector<double>{}));
  out.set("sample_time_s", model.sample_time);
  if (model.quantity == Quantity::displacement) {
    out.set("noise_sd_m", model.noise_sd);
  } else {
    out.set("quantity", std::string(to_string(model.quantity))).set(noise_key(model.quantity), model.noise_sd);
  }
  finish(out, model.summary, model.provenance);
  return out;
}

template <>
IdentifiedModel from_json(const Json& document, std::string_view source) {
  const JsonReader in(document, std::string(source));
  in.require_schema("whirl.model", 1);
  IdentifiedModel model;
  model.method = in.at("method").label();
  const JsonReader parameters = in.at("parameters");
  model.parameters = read_estimates(parameters);
  if (in.has("rotor")) {
    model.rotor = read_rotor(in.at("rotor"));
    for (const std::string_view name : kRotorParameters) (void)parameters.at(name);
  }
  model.states = read_identifiers(in.at("states"));
  model.inputs = read_identifiers(in.at("inputs"));
  for (const JsonReader& e : in.at("equations").items()) {
    Equation equation;
    equation.lhs = e.at("lhs").left_side();
    for (const JsonReader& t : e.at("terms").items()) {
      EquationTerm term;
      term.function = read_term(t.at("function"));
      term.coefficient.value = t.at("coefficient").number();
      term.coefficient.sd = t.at("sd").number_or_nan();
      const std::vector<JsonReader> ends = t.at("ci95").items();
      if (ends.size() != 2) throw t.at("ci95").error("must be [low, high]");
      term.coefficient.low = ends[0].number_or_nan();
      term.coefficient.high = ends[1].number_or_nan();
      term.unit = t.at("unit").unit();
      equation.terms.push_back(std::move(term));
    }
    model.equations.push_back(std::move(equation));
  }
  if (in.has("input_timing")) model.timing = read_timing(in.at("input_timing"));
  if (in.has("noise_correlation")) {
    for (const auto& [state, value] : in.at("noise_correlation").members()) {
      value.require_label(state);
      if (!(std::abs(value.number()) < 1)) throw value.error("must lie between -1 and 1");
      model.noise_correlation.emplace_back(state, value.number());
    }
  }
  if (in.has("ambiguities")) model.ambiguities = read_ambiguities(in.at("ambiguities"));
  model.rotor_covariance = read_rotor_covariance(in.at("rotor_covariance"));
  if (in.has("parameter_covariance")) model.parameter_covariance = in.at("parameter_covariance").numbers();
  const std::size_t n = model.parameters.size();
  if (!model.parameter_covariance.empty() && model.parameter_covariance.size() != n * n) {
    throw in.at("parameter_covariance")
        .error(fmt::format("{} values, must be {} or none", model.parameter_covariance.size(), n * n));
  }
  model.sample_time = in.at("sample_time_s").number();
  if (in.has("quantity")) model.quantity = read_motion_quantity(in.at("quantity"));
  model.noise_sd = in.at(noise_key(model.quantity)).number_or_nan();
  read_finish(in, model);
  return model;
}

Json to_json(const ControllerDesign& design) {
  Json out = start_document("whirl.controller", 1);
  out.set("law", design.law).set("estimator", design.estimator).set("parameters", map_json(design.parameters));
  out.set("model", rotor_json(design.model)).set("sample_time_s", design.sample_time).set("delay_s", design.delay);
  out.set("force_limit_N", design.force_limit).set("feedforward", design.feedforward);
  out.set("margins", map_json(design.margins));
  finish(out, design.summary, design.provenance);
  return out;
}

template <>
ControllerDesign from_json(const Json& document, std::string_view source) {
  const JsonReader in(document, std::string(source));
  in.require_schema("whirl.controller", 1);
  ControllerDesign design;
  design.law = in.at("law").label();
  design.estimator = in.at("estimator").label();
  for (const auto& [key, value] : in.at("parameters").members()) {
    value.require_label(key);
    design.parameters[key] = value.number();
  }
  design.model = read_rotor(in.at("model"));
  design.sample_time = in.at("sample_time_s").number();
  if (!(design.sample_time > 0)) throw in.at("sample_time_s").error("must be above 0");
  design.delay = in.at("delay_s").number();
  design.force_limit = in.at("force_limit_N").number();
  design.feedforward = in.at("feedforward").flag();
  design.margins = read_map(in.at("margins"));
  read_finish(in, design);
  return design;
}

}  // namespace whirl::io
