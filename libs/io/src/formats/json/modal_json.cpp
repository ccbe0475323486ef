#include <fmt/format.h>

#include <array>

#include "formats/json/parts.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::io {
namespace {

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

}  // namespace

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
  if (frf.leakage_free) out.set("leakage_free", true);
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
  frf.leakage_free = in.has("leakage_free") && in.at("leakage_free").flag();
  frf.frequency = in.at("frequency_hz").vector();
  const Eigen::Index lines = frf.frequency.size();
  for (const JsonReader& c : in.at("channels").items()) {
    FrfChannel channel;
    channel.response = c.at("response").label();
    channel.reference = c.at("reference").label();
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
      model.responses.push_back(channel.at("response").label());
      model.references.push_back(channel.at("reference").label());
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

}  // namespace whirl::io
