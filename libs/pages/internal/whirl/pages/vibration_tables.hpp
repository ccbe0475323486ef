#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/diagnosis/standards.hpp"
#include "whirl/diagnosis/vibration.hpp"
#include "whirl/io/json.hpp"
#include "whirl/report/table.hpp"

namespace whirl::pages {

/// A channel of a run.
struct RunVibration {
  std::string run;
  diagnosis::ChannelVibration channel;
};

/// "A", or "A or worse" where a part of the band is missing.
std::string zone_text(const diagnosis::HousingZone& zone);

/// Mean, motion about it, largest line and 1X of every channel in its own quantity. Without the names of the runs where
/// these are empty.
report::Table vibration_table(const std::vector<RunVibration>& rows);

/// Velocity of the housing sensors with the zone of `machine`; without it, with the zones of all classes. Notes name
/// the band, the integration and what was left out. No rows where no channel has a level.
report::Table housing_table(const std::vector<RunVibration>& rows,
                            const std::optional<diagnosis::MachineClass>& machine = {});

/// "channel", "quantity", "mean", "largest", "rms", "line", "synchronous", "housing" (docs/formats.md).
io::Json to_json(const diagnosis::ChannelVibration& vibration);

}  // namespace whirl::pages
