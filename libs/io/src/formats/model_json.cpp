#include "whirl/io/model_json.hpp"

#include <array>
#include <cmath>
#include <limits>

namespace whirl::io {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Json complex_parts(const Eigen::VectorXcd& v) {
  return Json::object().set("re", Json(Eigen::VectorXd(v.real()))).set("im", Json(Eigen::VectorXd(v.imag())));
}

Eigen::VectorXcd read_complex_parts(const JsonReader& in) {
  const Eigen::VectorXd re = in.at("re").vector();
  const Eigen::VectorXd im = in.at("im").vector();
  if (re.size() != im.size()) throw in.error(fmt::format("re has {} values, im {}", re.size(), im.size()));
  Eigen::VectorXcd v(re.size());
  v.real() = re;
  v.imag() = im;
  return v;
}

template <class Enum>
Enum read_enum(const JsonReader& in, std::initializer_list<Enum> values) {
  std::string allowed;
  for (const Enum v : values) {
    if (in.text() == to_string(v)) return v;
    allowed.append(allowed.empty() ? "" : ", ").append(to_string(v));
  }
  throw in.error(fmt::format("'{}' must be one of {}", in.text(), allowed));
}

FrfKind read_kind(const JsonReader& in) {
  return read_enum(in, {FrfKind::receptance, FrfKind::mobility, FrfKind::accelerance});
}

std::string_view frf_unit(FrfKind kind) {
  constexpr std::array<std::string_view, 3> units{"m/N", "m/(s N)", "m/(s^2 N)"};
  return units[static_cast<std::size_t>(kind)];
}

std::vector<std::string> read_texts(const JsonReader& in) {
  std::vector<std::string> out;
  for (const JsonReader& i : in.items()) out.push_back(i.text());
  return out;
}

void finish(Json& out, const Summary& summary, const Provenance& provenance) {
  out.set("summary", to_json(summary)).set("provenance", to_json(provenance));
}

template <class T>
void read_finish(const JsonReader& in, T& value) {
  value.summary = read_summary(in.at("summary"));
  value.provenance = read_provenance(in.at("provenance"));
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
  for (const auto& [key, value] : in.members()) out[key] = value.number_or_nan();
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
  constexpr std::array<std::pair<std::string_view, std::string_view>, 30> units{{{"k1", "1/s^2"},
                                                                                 {"k2", "1/(m^2 s^2)"},
                                                                                 {"c", "1/s"},
                                                                                 {"e", "m"},
                                                                                 {"e_phase", "rad"},
                                                                                 {"k1_conj", "1/s^2"},
                                                                                 {"c_conj", "1/s"},
                                                                                 {"eps", "m"},
                                                                                 {"offset", "m"},
                                                                                 {"gain", "1/kg"},
                                                                                 {"omega", "rad/s"},
                                                                                 {"f0", "Hz"},
                                                                                 {"zeta", "1"},
                                                                                 {"rmse", "m"},
                                                                                 {"k3", "1/(m^4 s^2)"},
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
                                                                                 {"sensor", "1"},
                                                                                 {"natural_frequency", "rad/s"},
                                                                                 {"damping_ratio", "1"},
                                                                                 {"delay", "s"},
                                                                                 {"bow", "m"}}};
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

Json to_json(const FrequencyResponse& frf) {
  Json channels = Json::array();
  for (const FrfChannel& c : frf.channels) {
    Json channel;
    channel.set("response", c.response).set("reference", c.reference).set("value", complex_parts(c.value));
    channel.set("coherence", Json(c.coherence)).set("variance", Json(c.variance));
    channels.push(std::move(channel));
  }
  Json out = start_document("whirl.frf", 1);
  out.set("kind", to_string(frf.kind)).set("unit", frf_unit(frf.kind)).set("estimator", to_string(frf.estimator));
  out.set("window_decay_1_s", frf.window_decay).set("averages", frf.averages);
  out.set("frequency_hz", Json(frf.frequency)).set("channels", std::move(channels));
  finish(out, frf.summary, frf.provenance);
  return out;
}

template <>
FrequencyResponse from_json(const Json& document, std::string_view source) {
  const JsonReader in(document, std::string(source));
  in.require_schema("whirl.frf", 1);
  FrequencyResponse frf;
  frf.kind = read_kind(in.at("kind"));
  frf.estimator = read_enum(in.at("estimator"), {FrfEstimator::h1, FrfEstimator::h2, FrfEstimator::hv});
  frf.window_decay = in.at("window_decay_1_s").number();
  frf.averages = in.at("averages").integer();
  frf.frequency = in.at("frequency_hz").vector();
  const Eigen::Index lines = frf.frequency.size();
  for (const JsonReader& c : in.at("channels").items()) {
    FrfChannel channel;
    channel.response = c.at("response").text();
    channel.reference = c.at("reference").text();
    channel.value = read_complex_parts(c.at("value"));
    channel.coherence = c.at("coherence").vector();
    channel.variance = c.at("variance").vector();
    const auto check = [&](std::string_view key, Eigen::Index size, bool may_be_empty) {
      if (size != lines && !(may_be_empty && size == 0)) {
        throw c.at(key).error(fmt::format("{} values for {} frequencies", size, lines));
      }
    };
    check("value", channel.value.size(), false);
    check("coherence", channel.coherence.size(), true);
    check("variance", channel.variance.size(), true);
    frf.channels.push_back(std::move(channel));
  }
  read_finish(in, frf);
  return frf;
}

Json to_json(const ModalModel& model) {
  Json modes = Json::array();
  for (const Mode& m : model.modes) {
    Json mode;
    mode.set("frequency", to_json(m.frequency, "Hz")).set("damping", to_json(m.damping, "1"));
    mode.set("pole_rad_s", to_json(m.pole)).set("residues", complex_parts(m.residues));
    if (m.offsets.size() > 0) {
      mode.set("pole_offsets_rad_s", complex_parts(m.offsets));
      mode.set("frequency_scatter", m.frequency_scatter).set("damping_scatter", m.damping_scatter);
    }
    if (m.amplitude_offset != 0.0) mode.set("amplitude_offset_rad_s", to_json(m.amplitude_offset));
    modes.push(std::move(mode));
  }
  Json out = start_document("whirl.modes", 1);
  out.set("modes", std::move(modes)).set("kind", to_string(model.kind));
  Json amplitude = Json::array();
  for (const AmplitudeTerm& term : model.amplitude) {
    Json item;
    item.set("mode", static_cast<double>(term.mode + 1)).set("decay", term.decay).set("turn", term.turn);
    item.set("pole_rad_s", to_json(term.pole)).set("residues", complex_parts(term.residues));
    amplitude.push(std::move(item));
  }
  out.set("amplitude", std::move(amplitude));
  Json channels = Json::array();
  for (std::size_t c = 0; c < model.responses.size(); ++c) {
    channels.push(Json::object().set("response", model.responses[c]).set("reference", model.references[c]));
  }
  out.set("channels", std::move(channels)).set("window_decay_1_s", model.window_decay);
  out.set("lower_residual", complex_parts(model.lower)).set("upper_residual", complex_parts(model.upper));
  out.set("upper_residual_slope", complex_parts(model.upper_slope));
  out.set("damping_model", to_string(model.damping_model));
  out.set("frequency_scatter", model.frequency_scatter).set("damping_scatter", model.damping_scatter);
  out.set("band_hz", Json::array().push(model.band_low).push(model.band_high));
  out.set("reconstruction_error", model.reconstruction_error).set("noise_floor", model.noise_floor);
  finish(out, model.summary, model.provenance);
  return out;
}

template <>
ModalModel from_json(const Json& document, std::string_view source) {
  const JsonReader in(document, std::string(source));
  in.require_schema("whirl.modes", 1);
  ModalModel model;
  for (const JsonReader& m : in.at("modes").items()) {
    model.modes.push_back({read_estimate(m.at("frequency")), read_estimate(m.at("damping")),
                           m.at("pole_rad_s").complex(), read_complex_parts(m.at("residues"))});
    if (m.has("amplitude_offset_rad_s")) model.modes.back().amplitude_offset = m.at("amplitude_offset_rad_s").complex();
    if (!m.has("pole_offsets_rad_s")) continue;
    model.modes.back().offsets = read_complex_parts(m.at("pole_offsets_rad_s"));
    model.modes.back().frequency_scatter = m.at("frequency_scatter").number();
    model.modes.back().damping_scatter = m.at("damping_scatter").number();
  }
  if (in.has("amplitude")) {  // older files: none was looked for
    for (const JsonReader& item : in.at("amplitude").items()) {
      const double mode = item.at("mode").number();
      if (!(mode >= 1 && mode <= static_cast<double>(model.modes.size())) || mode != std::floor(mode))
        throw item.at("mode").error(fmt::format("must be 1 to {}, a mode of this file", model.modes.size()));
      model.amplitude.push_back({static_cast<std::size_t>(mode) - 1, item.at("decay").number(),
                                 item.at("turn").number(), item.at("pole_rad_s").complex(),
                                 read_complex_parts(item.at("residues"))});
    }
  }
  model.kind = read_kind(in.at("kind"));
  model.lower = read_complex_parts(in.at("lower_residual"));
  model.upper = read_complex_parts(in.at("upper_residual"));
  if (in.has("channels")) {  // older files name none
    for (const JsonReader& channel : in.at("channels").items()) {
      model.responses.push_back(channel.at("response").text());
      model.references.push_back(channel.at("reference").text());
    }
    model.window_decay = in.at("window_decay_1_s").number();
    model.upper_slope = read_complex_parts(in.at("upper_residual_slope"));
  }
  if (in.has("damping_model")) {  // older files: viscous
    const std::string damping = in.at("damping_model").text();
    if (damping != "viscous" && damping != "hysteretic")
      throw in.at("damping_model").error("must be viscous or hysteretic");
    model.damping_model = damping == "viscous" ? DampingModel::viscous : DampingModel::hysteretic;
    model.frequency_scatter = in.at("frequency_scatter").number();
    model.damping_scatter = in.at("damping_scatter").number();
  }
  const std::vector<double> band = in.at("band_hz").numbers();
  if (band.size() != 2) throw in.at("band_hz").error("must be [low, high]");
  model.band_low = band[0];
  model.band_high = band[1];
  model.reconstruction_error = in.at("reconstruction_error").number_or_nan();
  model.noise_floor = in.at("noise_floor").number_or_nan();
  read_finish(in, model);
  return model;
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
    one.input = t.at("input").text();
    const std::string hold = t.at("hold").text();
    if (hold != "zero" && hold != "first" && hold != "band-limited")
      throw t.at("hold").error("must be zero, first or band-limited");
    one.hold = hold_of(hold);
    one.dead_time = read_estimate(t.at("dead_time"));
    timing.push_back(std::move(one));
  }
  return timing;
}

}  // namespace

Json to_json(const IdentifiedModel& model) {
  Json parameters = Json::object();
  for (const auto& [name, estimate] : model.parameters) parameters.set(name, to_json(estimate, parameter_unit(name)));
  if (model.rotor) {
    const std::array<double, 5> values = rotor_values(*model.rotor);
    for (std::size_t i = 0; i < values.size(); ++i) {
      if (!parameters.find(kRotorParameters[i])) {
        parameters.set(std::string(kRotorParameters[i]),
                       to_json(Estimate{values[i], kNan, kNan, kNan}, parameter_unit(kRotorParameters[i])));
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
  out.set("rotor", model.rotor ? rotor_json(*model.rotor) : Json())
      .set("rotor_covariance", Json(model.rotor_covariance))
      .set("parameter_covariance",  // parameters added above have none
           Json(complete ? model.parameter_covariance : std::vector<double>{}));
  out.set("sample_time_s", model.sample_time).set("noise_sd_m", model.noise_sd);
  finish(out, model.summary, model.provenance);
  return out;
}

template <>
IdentifiedModel from_json(const Json& document, std::string_view source) {
  const JsonReader in(document, std::string(source));
  in.require_schema("whirl.model", 1);
  IdentifiedModel model;
  model.method = in.at("method").text();
  const JsonReader parameters = in.at("parameters");
  for (const auto& [name, value] : parameters.members()) model.parameters.emplace_back(name, read_estimate(value));
  if (in.has("rotor")) {
    model.rotor = read_rotor(in.at("rotor"));
    for (const std::string_view name : kRotorParameters) (void)parameters.at(name);
  }
  model.states = read_texts(in.at("states"));
  model.inputs = read_texts(in.at("inputs"));
  for (const JsonReader& e : in.at("equations").items()) {
    Equation equation;
    equation.lhs = e.at("lhs").text();
    for (const JsonReader& t : e.at("terms").items()) {
      EquationTerm term;
      term.function = t.at("function").text();
      term.coefficient.value = t.at("coefficient").number();
      term.coefficient.sd = t.at("sd").number_or_nan();
      const std::vector<JsonReader> ends = t.at("ci95").items();
      if (ends.size() != 2) throw t.at("ci95").error("must be [low, high]");
      term.coefficient.low = ends[0].number_or_nan();
      term.coefficient.high = ends[1].number_or_nan();
      term.unit = t.at("unit").text();
      equation.terms.push_back(std::move(term));
    }
    model.equations.push_back(std::move(equation));
  }
  if (in.has("input_timing")) model.timing = read_timing(in.at("input_timing"));
  model.rotor_covariance = in.at("rotor_covariance").numbers();
  if (!model.rotor_covariance.empty() && model.rotor_covariance.size() != 25) {
    throw in.at("rotor_covariance").error(fmt::format("{} values, must be 25 or none", model.rotor_covariance.size()));
  }
  if (in.has("parameter_covariance")) model.parameter_covariance = in.at("parameter_covariance").numbers();
  const std::size_t n = model.parameters.size();
  if (!model.parameter_covariance.empty() && model.parameter_covariance.size() != n * n) {
    throw in.at("parameter_covariance")
        .error(fmt::format("{} values, must be {} or none", model.parameter_covariance.size(), n * n));
  }
  model.sample_time = in.at("sample_time_s").number();
  model.noise_sd = in.at("noise_sd_m").number_or_nan();
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
  design.law = in.at("law").text();
  design.estimator = in.at("estimator").text();
  for (const auto& [key, value] : in.at("parameters").members()) design.parameters[key] = value.number();
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
