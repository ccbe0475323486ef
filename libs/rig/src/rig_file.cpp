#include "whirl/rig/rig_file.hpp"

#include <algorithm>
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

std::vector<RigMode> read_modes(const std::filesystem::path& path) {
  if (path.empty()) return {};
  const RigParameters rig = read_rig(path);
  const io::Settings settings = io::read_settings(path);
  std::vector<RigMode> out;
  for (const std::string& number : settings.keys("modes")) {
    const std::string table = "modes." + number;
    const std::vector<std::string> keys = settings.keys(table);
    const auto names = [&](std::string_view name) {
      return std::ranges::any_of(keys, [&](const std::string& key) { return key.starts_with(name); });
    };
    RigMode mode = rig.modes.at(std::stoul(number) - 1);
    if (!names("frequency")) throw settings.error(table, "a known mode needs its frequency_hz");
    if (!names("damping")) mode.damping_ratio = 0.01;
    if (!names("participation")) mode.participation = 0.02;
    if (!names("sensor_sign")) mode.sensor_sign = 0;
    if (!names("initial")) mode.initial = 0;
    if (!names("unbalance_share")) mode.unbalance_share = 0;
    if (mode.participation < 0)
      throw settings.error(table, "participation: must be 0 or more; the sign is sensor_sign");
    out.push_back(mode);
  }
  return out;
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
