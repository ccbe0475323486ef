#include "whirl/rig/rig_file.hpp"

#include <type_traits>
#include <utility>

#include "whirl/io/settings.hpp"
#include "whirl/rig/fields.hpp"

namespace whirl::rig {
namespace {

// "modes.1.frequency_hz" -> table "modes.1", key "frequency_hz".
std::pair<std::string, std::string> split_key(const std::string& key) {
  const std::size_t dot = key.rfind('.');
  return {key.substr(0, dot), key.substr(dot + 1)};
}

}  // namespace

RigParameters read_rig(const std::filesystem::path& path) {
  RigParameters parameters;
  if (path.empty()) return parameters;
  const io::Settings settings = io::read_settings(path);
  io::apply(settings, parameters);
  settings.finish();
  try {
    parameters.check();
  } catch (const Error& e) {
    throw Error::in_file(path.string(), 0, e.what());
  }
  return parameters;
}

std::string rig_toml(const RigParameters& parameters) {
  std::vector<io::TomlEntry> entries;
  RigParameters copy = parameters;
  visit_fields(copy, [&](const std::string& full_key, auto& field, double unit) {
    const auto [table, key] = split_key(full_key);
    io::TomlEntry entry{table, key, {}, ""};
    using Field = std::decay_t<decltype(field)>;
    if constexpr (std::is_same_v<Field, bool>) {
      entry.value = field;
    } else if constexpr (std::is_integral_v<Field>) {
      entry.value = static_cast<long>(field);
    } else {
      entry.value = field / unit;
    }
    entries.push_back(std::move(entry));
  });
  return io::to_toml(entries);
}

}  // namespace whirl::rig
