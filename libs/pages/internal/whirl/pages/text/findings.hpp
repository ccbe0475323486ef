#pragma once
#include <string>
#include <vector>

#include "whirl/diagnosis/vibration_findings.hpp"
#include "whirl/io/json.hpp"

namespace whirl::pages {

/// One sentence without a full stop: channel, what, size with unit and kind, speed, chance under noise, what it may
/// mean.
std::string text(const diagnosis::VibrationFinding& finding);
/// A few words for a table, e.g. "2X 18.0 µm peak, 1.5 times 1X (channel x)".
std::string short_text(const diagnosis::VibrationFinding& finding);
/// What was not judged, and what would allow it.
std::string text(const diagnosis::Unjudged& unjudged);
/// What to do about a finding; empty where there is nothing to do.
std::string next_step(const diagnosis::VibrationFinding& finding);
/// A line for each finding and for what was not judged; channels with the same gap share one.
std::vector<std::string> lines_of(const diagnosis::VibrationFindings& findings);
/// The same as text, each line behind `before`.
std::string to_text(const diagnosis::VibrationFindings& findings, const std::string& before);

/// The object `vibration` of whirl.info/2 (docs/formats.md).
io::Json to_json(const diagnosis::VibrationFindings& findings);

}  // namespace whirl::pages
