#pragma once
#include <functional>
#include <string>
#include <vector>

#include "whirl/diagnosis/vibration.hpp"
#include "whirl/diagnosis/vibration_findings.hpp"
#include "whirl/io/info.hpp"
#include "whirl/io/json.hpp"
#include "whirl/records/check.hpp"

namespace whirl::pages {

/// What a file of any format holds, with the record check of its tables.
struct FileReport {
  io::FileInfo info;
  std::vector<records::RecordReport> records;                       ///< one per table of `info`
  std::vector<diagnosis::VibrationFindings> findings;               ///< likewise
  std::vector<std::vector<diagnosis::ChannelVibration>> vibration;  ///< of each table; empty where it has no motion
};

/// Tables of uniformly sampled time signals with known units go through `records::check`; what it says with time and
/// consequence is left out of the findings of `describe`. `with_angle`: gives such a table the rotor angle of a tacho
/// that the user stated.
FileReport report_file(const io::SignalFile& file, const std::function<Recording(const Recording&)>& with_angle = {});

/// Of a file that was read in parts: nothing but its description.
FileReport report_of(io::FileInfo info);

std::string to_text(const FileReport& report);
/// whirl.info/2 (docs/formats.md).
io::Json to_json(const FileReport& report);

}  // namespace whirl::pages
