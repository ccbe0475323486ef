#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "whirl/core/control_types.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/core/modal_model.hpp"
#include "whirl/core/stiffness_law.hpp"
#include "whirl/io/json.hpp"

/// Results as versioned JSON files. The keys and their units are listed in docs/formats.md.
///
///   save("model.json", model);
///   auto model = load<IdentifiedModel>("model.json");
///
/// Loading refuses a wrong schema, a newer version, a missing key, a wrong type and damaged text with one
/// Error that names file, JSON path and reason. Keys not known are ignored.
namespace whirl::io {

Json to_json(const StiffnessLaw& law);       // whirl.stiffness/1
Json to_json(const FrequencyResponse& frf);  // whirl.frf/1
Json to_json(const ModalModel& modes);       // whirl.modes/1
/// whirl.model/1. For a model with `rotor`, `parameters` always holds k1, k2, c, e and e_phase: those that
/// the model does not list are taken from the rotor, without interval.
Json to_json(const IdentifiedModel& model);
Json to_json(const ControllerDesign& design);  // whirl.controller/1
}  // namespace whirl::io

namespace whirl {
using io::to_json;  // of the values of core: found by their namespace
}

namespace whirl::io {

/// T: one of the five types above.
template <class T>
T from_json(const Json& document, std::string_view source);
template <>
StiffnessLaw from_json(const Json& document, std::string_view source);
template <>
FrequencyResponse from_json(const Json& document, std::string_view source);
template <>
ModalModel from_json(const Json& document, std::string_view source);
template <>
IdentifiedModel from_json(const Json& document, std::string_view source);
template <>
ControllerDesign from_json(const Json& document, std::string_view source);

template <class T>
void save(const std::filesystem::path& path, const T& value) {
  save_json(path, to_json(value));
}
template <class T>
T load(const std::filesystem::path& path) {
  return from_json<T>(load_json(path), path.string());
}

/// SI unit of a rotor parameter by its name in `IdentifiedModel::parameters`, with or without a suffix for
/// the axis: "k1", "k1_x" -> "1/s^2"; empty when not known.
std::string_view parameter_unit(std::string_view name);

}  // namespace whirl::io
