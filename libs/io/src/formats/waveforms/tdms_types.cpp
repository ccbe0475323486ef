#include "formats/waveforms/tdms_types.hpp"

#include <vector>

namespace whirl::io {

std::optional<TdmsType> tdms_type(std::uint32_t code) {
  switch (code) {
    case 1:
      return TdmsType{NumberType::int8};
    case 2:
      return TdmsType{NumberType::int16};
    case 3:
      return TdmsType{NumberType::int32};
    case 4:
      return TdmsType{NumberType::int64};
    case 5:
    case kTdmsBoolean:
      return TdmsType{NumberType::uint8};
    case 6:
      return TdmsType{NumberType::uint16};
    case 7:
      return TdmsType{NumberType::uint32};
    case 8:
      return TdmsType{NumberType::uint64};
    case 9:
    case 0x19:
      return TdmsType{NumberType::float32};
    case 10:
    case 0x1A:
      return TdmsType{NumberType::float64};
    case 0x08000C:
      return TdmsType{NumberType::float32, true};
    case 0x10000D:
      return TdmsType{NumberType::float64, true};
    default:
      return {};
  }
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
