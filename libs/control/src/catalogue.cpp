#include "whirl/control/catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "estimators/all.hpp"
#include "laws/all.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/power.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {
namespace {

std::vector<ParameterInfo> make_common() {
  std::vector<ParameterInfo> p{
      {"sensor_delay", "s", "age of the displacement at the tick, part of the loop delay", 0, 0, 1, 0, 0},
      {"advance", "1", "1: disturbance taken at the time of effect; 0: at the tick, as printed", 1, 0, 1, 0, 0},
      {"predict", "1", "1: position and velocity predicted to the time of effect", 0, 0, 1, 0, 0},
      {"cancel", "1", "fraction of the linear stiffness that model-based laws cancel", 1, 0, 1, 0.4, 1},
      {"sensor_range", "m", "|x|, |y| at or above this is a saturated sensor", 12.4e-3, 1e-6, 1e3, 0, 0},
      {"jump_limit", "m", "largest plausible change of the displacement in one sample", 2e-3, 1e-9, 1e3, 0, 0},
      {"stale_limit", "1", "lost samples in a row after which the step faults", 100, 1, 1e9, 0, 0},
      {"slew_limit", "N/s", "fastest change of the force that the actuator follows; 0: not stated", 0, 0, 1e12, 0, 0},
      {"hysteresis", "N", "width of the actuator's hysteresis; 0: not stated", 0, 0, 1e6, 0, 0},
      {"supervise", "1", "1: the loop is watched while it runs and taken back in steps", 0, 0, 1, 0, 0},
      {"watch_level", "m", "rms of motion beside the synchronous one that supervision takes for growth", 100e-6, 1e-9,
       1, 0, 0},
      {"watch_bandwidth", "1/s", "poles of the observer of the unbalance that acts, for supervision", 100, 1, 1e4, 0,
       0},
      {"reidentify", "1", "1: a supervised loop says how stiffness, damping and gain differ; 2: and corrects the force",
       0, 0, 2, 0, 0},
      {"reidentify_stiffness", "1", "largest share of k1 by which the stiffness may differ", 0.2, 0.01, 0.5, 0, 0},
      {"reidentify_damping", "1", "largest share of c by which the damping may differ", 1, 0.01, 2, 0, 0},
      {"reidentify_gain", "1", "largest share by which the gain of the actuators may differ", 0.3, 0.01, 0.5, 0, 0},
  };
  for (int k = 1; k <= Structure::kModes; ++k) {
    const auto add = [&](const char* name, const char* unit, const char* meaning, double low, double high) {
      p.push_back({fmt::format("mode_{}_{}", k, name), unit, meaning, 0, low, high, 0, 0});
    };
    add("omega", "rad/s", "structural mode whose answer to the force is taken out of the readings; 0: none", 0, 1e6);
    add("damping", "1", "its damping ratio", 0, 0.9);
    add("share", "1", "its acceleration per newton at the sensor relative to the rotor's, signed", -100, 100);
  }
  for (const char* axis : {"x", "y"}) {
    for (const char* part : {"cos", "sin"}) {
      for (int k = 1; k <= Runout::kHarmonics; ++k) {
        p.push_back(
            {fmt::format("runout_{}_{}_{}", axis, part, k), "m", "sensor runout removed", 0, -1e-2, 1e-2, 0, 0});
      }
    }
  }
  return p;
}

template <class Entry, std::size_t N>
std::vector<Entry> entries(const std::array<Entry (*)(), N>& makers) {
  std::vector<Entry> out;
  for (const auto& make : makers) out.push_back(make());
  return out;
}

const std::vector<LawEntry>& law_entries() {
  static const std::vector<LawEntry> all = entries(kLaws);
  return all;
}
const std::vector<EstimatorEntry>& estimator_entries() {
  static const std::vector<EstimatorEntry> all = entries(kEstimators);
  return all;
}

template <class Entry>
std::vector<MethodInfo> infos(const std::vector<Entry>& all) {
  std::vector<MethodInfo> out;
  for (const Entry& entry : all) out.push_back(entry.info);
  return out;
}

template <class Entry>
const Entry& find(const std::vector<Entry>& all, std::string_view name, std::string_view field) {
  std::string known;
  for (const Entry& entry : all) {
    if (entry.info.name == name) return entry;
    known += (known.empty() ? "" : ", ") + entry.info.name;
  }
  throw Error::in_field(field, name, "one of " + known);
}

bool has(const std::map<std::string, double>& values, const char* name) { return values.count(name) > 0; }

int delay_samples(const ControllerDesign& design, const std::map<std::string, double>& values) {
  return values.at("predict") > 0 ? 0 : static_cast<int>(std::lround(design.delay / design.sample_time));
}

}  // namespace

const std::vector<MethodInfo>& laws() {
  static const std::vector<MethodInfo> all = infos(law_entries());
  return all;
}
const std::vector<MethodInfo>& estimators() {
  static const std::vector<MethodInfo> all = infos(estimator_entries());
  return all;
}
const std::vector<ParameterInfo>& common_parameters() {
  static const std::vector<ParameterInfo> all = make_common();
  return all;
}
const LawEntry& law_entry(std::string_view name) { return find(law_entries(), name, "law"); }
const EstimatorEntry& estimator_entry(std::string_view name) { return find(estimator_entries(), name, "estimator"); }
const MethodInfo& law_info(std::string_view name) { return law_entry(name).info; }
const MethodInfo& estimator_info(std::string_view name) { return estimator_entry(name).info; }

std::map<std::string, double> resolve_parameters(const ControllerDesign& design) {
  require_range("sample_time", design.sample_time, 1e-6, 1, "s");
  require_range("delay", design.delay, 0, Controller::kMaxDelay * design.sample_time, "s");
  std::vector<ParameterInfo> known = law_info(design.law).parameters;
  const auto& more = estimator_info(design.estimator).parameters;
  known.insert(known.end(), more.begin(), more.end());
  known.insert(known.end(), common_parameters().begin(), common_parameters().end());
  if (const LawEntry& law = law_entry(design.law); law.entries != nullptr) {
    const std::vector<ParameterInfo> entries = law.entries(design.parameters);
    known.insert(known.end(), entries.begin(), entries.end());
  }

  std::map<std::string, double> values;
  for (const auto& info : known) {
    const auto given = design.parameters.find(info.name);
    values[info.name] = given != design.parameters.end() ? given->second : info.fallback;
    if (given != design.parameters.end())
      require_range(info.name, given->second, info.low, info.high, info.unit == "1" ? "" : info.unit);
  }
  for (const auto& [name, value] : design.parameters) {
    if (!values.count(name)) {
      std::string allowed;
      for (const auto& info : known) {
        if (!info.name.starts_with("runout_") && !info.name.starts_with("mode_"))
          allowed += (allowed.empty() ? "" : ", ") + info.name;
      }
      throw Error(fmt::format("parameter {} is not known to law {} with estimator {}: known are {}", name, design.law,
                              design.estimator, allowed));
    }
  }

  const double h = design.sample_time;
  const int n = delay_samples(design, values);
  for (const auto& info : known) {
    if (info.derive != nullptr && std::isnan(values[info.name])) values[info.name] = info.derive(values, h, n);
  }
  for (const Condition& condition : law_entry(design.law).conditions) {
    if (!condition.holds(values)) {
      throw Error::in_field(condition.parameter, fmt::format("{:g}", values.at(condition.parameter)),
                            condition.allowed);
    }
  }
  if (values["sensor_delay"] > design.delay) {
    throw Error::in_field("sensor_delay", fmt::format("{:g} s", values["sensor_delay"]),
                          fmt::format("part of the loop delay {:g} s", design.delay));
  }
  return values;
}

std::vector<std::string> design_warnings(const ControllerDesign& design) {
  const auto values = resolve_parameters(design);
  const double h = design.sample_time;
  const int n = delay_samples(design, values);
  std::vector<std::string> out;
  if (const LawEntry& law = law_entry(design.law); law.remarks != nullptr) out = law.remarks(values);
  if (has(values, "boundary_layer") && has(values, "switching_gain")) {
    const double limit = boundary_layer_limit(h, values.at("switching_gain"), n);
    if (values.at("boundary_layer") < 0.999 * limit) {
      out.push_back(
          fmt::format("boundary_layer {:.3g} m/s is below {:.3g} m/s: the switching term oscillates with {} "
                      "samples of delay",
                      values.at("boundary_layer"), limit, n));
    }
  }
  if (has(values, "delta") && values.at("delta") > 0) {
    const double r = values.at("exponent");
    const double gain =
        h * values.at("surface_gain") * r * std::pow(values.at("delta") / values.at("length_scale"), r - 1);
    if (gain > 1.001 * smooth_gain_limit(n)) {
      out.push_back(
          fmt::format("the terminal surface has the sampled velocity gain {:.3g} near zero, above {:.3g} it "
                      "oscillates with {} samples of delay: lower surface_gain or raise delta",
                      gain, smooth_gain_limit(n), n));
    }
  } else if (has(values, "delta")) {
    out.push_back("delta = 0: the singular term as printed is unbounded when the displacement crosses zero");
  }
  if (has(values, "tau") && values.at("tau") < 0.999 * h / smooth_gain_limit(n)) {
    out.push_back(fmt::format("tau {:.3g} s is below {:.3g} s: the projection oscillates with {} samples of delay",
                              values.at("tau"), h / smooth_gain_limit(n), n));
  }
  return out;
}

}  // namespace whirl::control
