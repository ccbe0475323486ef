#include "frf_channels.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "whirl/core/error.hpp"

namespace whirl::modal {

FrfKind kind_of(const Channel& channel) {
  switch (channel.quantity) {
    case Quantity::displacement:
      return FrfKind::receptance;
    case Quantity::velocity:
      return FrfKind::mobility;
    case Quantity::acceleration:
      return FrfKind::accelerance;
    default:
      break;
  }
  throw Error(fmt::format("response channel '{}' is a {}: must be displacement, velocity or acceleration{}",
                          channel.name, to_string(channel.quantity),
                          channel.quantity == Quantity::voltage ? "; calibrate it first" : ""));
}

const Channel& force_named(const Recording& record, const std::string& name) {
  const Channel& named = record.at(name);
  if (named.quantity == Quantity::displacement || named.quantity == Quantity::velocity ||
      named.quantity == Quantity::acceleration)
    throw Error(
        fmt::format("{}: channel '{}' is a {}: must be a force", record.source, name, to_string(named.quantity)));
  return named;
}

void name_channels(const Recording& record, const std::vector<std::string>& forces,
                   const std::vector<std::string>& references, FrequencyResponse& result) {
  for (const std::string& reference : references) {
    for (const Channel& channel : record.channels) {
      if (std::find(forces.begin(), forces.end(), channel.name) != forces.end() ||
          channel.quantity == Quantity::force || channel.quantity == Quantity::time)
        continue;
      const FrfKind kind = kind_of(channel);
      if (result.channels.empty()) result.kind = kind;
      if (kind != result.kind) {
        throw Error(fmt::format("response channel '{}' gives {}, the others {}: must be one kind", channel.name,
                                to_string(kind), to_string(result.kind)));
      }
      result.channels.push_back({channel.name, reference, {}, {}, {}});
    }
  }
  if (result.channels.empty()) throw Error("no response channel beside the force");
}

}  // namespace whirl::modal
