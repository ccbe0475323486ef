#pragma once
#include <string>
#include <vector>

#include "command_line.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/signal/tacho_pattern.hpp"

namespace whirl::app {

/// Flags of every subcommand that reads records.
struct RecordOptions {
  std::vector<std::string> columns;
  double rate = 0;
  long header_line = 0;
  std::string rows;
  std::vector<std::string> late;  ///< CHANNEL=SECONDS
  std::vector<std::string> required;
  std::string pulses;    ///< [CHANNEL][:N], or N: the tacho
  int missing = -1;      ///< of its places a turn
  std::string edge;      ///< of its pulses; empty: the leading one
  bool turning = false;  ///< an angle is told from a tacho where the record has none, beside its channels
  bool stream = false;   ///< read in parts
  bool gaps = false;     ///< gaps and uneven times are let through, each with a warning

  io::CsvOptions csv() const;
  /// Reads the record and keeps the rows A:B (0-based, B excluded) when asked.
  Recording read(const std::string& file) const;
  /// The rows that are asked for.
  io::PartRows part_rows() const;
  /// Is this file read in parts: by the flag or its size? Throws Error where flags need the whole.
  bool in_parts(const std::string& file) const;
  /// The record with the angle of the tacho that is stated.
  Recording with_angle(Recording record) const;
  /// Throws Error where a flag says nothing about a file of this format.
  void require_uses(const std::string& file) const;
  /// The flags; `part`: --rows and --late too.
  void add_to(CommandLine* sub, bool part = true);
  void add_rows_to(CommandLine* sub);
  void add_stream_to(CommandLine* sub);
  /// The flags of a tacho: --pulses, --missing, --edge.
  void add_tacho_to(CommandLine* sub);
  /// Any flag that says how to read the file.
  bool any_stated() const {
    return !columns.empty() || rate > 0 || header_line > 0 || !rows.empty() || stream || tacho_stated();
  }
  bool tacho_stated() const { return !pulses.empty() || missing >= 0 || !edge.empty(); }
};

}  // namespace whirl::app
