#pragma once
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"

namespace whirl::identification::detail {

/// What the record check finds in the named channels, and the records without it: samples that carry no information are
/// NaN, lines of the mains are taken off.
struct DamagedRecords {
  std::vector<std::string> findings;  ///< one line each; empty: nothing was found
  bool cleaned = false;               ///< `records` differ from those given
  std::vector<Recording> records;
};
DamagedRecords look_for_damage(const std::vector<Recording>& records, const std::vector<std::string>& channels);

}  // namespace whirl::identification::detail
