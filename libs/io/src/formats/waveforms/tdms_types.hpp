#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "formats/arrays/bytes.hpp"

namespace whirl::io {

enum : std::uint32_t { kTdmsString = 0x20, kTdmsBoolean = 0x21, kTdmsTimestamp = 0x44 };

struct TdmsType {
  NumberType type;
  bool complex = false;
};

/// The type of number of a code of TDMS; nothing for text, time stamps and what is not known.
std::optional<TdmsType> tdms_type(std::uint32_t code);

/// Group and channel of an object's path "/'group'/'channel'"; empty where it has none.
std::pair<std::string, std::string> tdms_names(const std::string& path);

}  // namespace whirl::io
