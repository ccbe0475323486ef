#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "formats/csv/csv_header.hpp"

namespace whirl::io::detail {

/// A date, a time of day, or both, as loggers write them.
struct Stamp {
  std::optional<long> day;        ///< since 1970-01-01, UTC where a zone is written
  std::optional<double> seconds;  ///< of the day
  int decimals = 0;               ///< of the seconds
};

/// `2026-11-26T10:59:58.010Z`, `26.11.2026 10:59:58,010`, `11/26/2026 10:59 AM`, `2026-11-26`, `00:00:01.5`. Where both
/// readings of two numbers are possible the day comes first. Nothing for any other text.
std::optional<Stamp> read_stamp(std::string_view text);

/// Columns of dates and times of day in a table: a time, perhaps with the date in a column of its own.
class StampColumns {
 public:
  /// Finds them by the fields of the first line. The first time of day becomes the column "time" in seconds, unless a
  /// column of numbers is the time (`numbered`); the others are not read.
  void find(const std::vector<std::string>& fields, bool numbered, std::vector<Heading>& headings);

  bool has(std::size_t column) const { return column < is_.size() && is_[column]; }
  bool unread(std::size_t column) const { return has(column) && static_cast<int>(column) != time_; }
  int time_column() const { return time_; }
  int decimals() const { return line_.decimals; }
  /// One field of a line; false where it is no stamp.
  bool take(std::size_t column, std::string_view text);
  /// Time of the line that was taken, s from the midnight before the first; it ends the line. Times of day without a
  /// date go on behind midnight.
  double seconds();

 private:
  std::vector<bool> is_;
  int time_ = -1;
  std::optional<long> first_day_;
  double last_ = 0, wrapped_ = 0;
  Stamp line_;
};

}  // namespace whirl::io::detail
