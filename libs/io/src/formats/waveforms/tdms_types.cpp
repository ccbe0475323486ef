#include "formats/waveforms/tdms_types.hpp"

#include <vector>

namespace whirl::io {

std::optional<TdmsType> tdms_type(std::uint32_t code) {
  using enum NumberType;
  constexpr std::pair<std::uint32_t, TdmsType> kTypes[] = {{1, {int8}},
                                                           {2, {int16}},
                                                           {3, {int32}},
                                                           {4, {int64}},
                                                           {5, {uint8}},
                                                           {kTdmsBoolean, {uint8}},
                                                           {6, {uint16}},
                                                           {7, {uint32}},
                                                           {8, {uint64}},
                                                           {9, {float32}},
                                                           {0x19, {float32}},
                                                           {10, {float64}},
                                                           {0x1A, {float64}},
                                                           {0x08000C, {float32, true}},
                                                           {0x10000D, {float64, true}}};
  for (const auto& [known, type] : kTypes)
    if (known == code) return type;
  return {};
}

std::pair<std::string, std::string> tdms_names(const std::string& path) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < path.size(); ++i) {
    if (path[i] != '\'') continue;
    std::string part;
    for (++i; i < path.size(); ++i) {
      if (path[i] == '\'' && (i + 1 >= path.size() || path[i + 1] != '\'')) break;
      if (path[i] == '\'') ++i;
      part += path[i];
    }
    parts.push_back(part);
  }
  parts.resize(2);
  return {parts[0], parts[1]};
}

}  // namespace whirl::io
