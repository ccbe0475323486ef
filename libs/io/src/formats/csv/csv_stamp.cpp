#include "formats/csv/csv_stamp.hpp"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cmath>

namespace whirl::io::detail {
namespace {

/// Reads a text from its begin on.
class StampText {
 public:
  explicit StampText(std::string_view text) : rest_(text) {}
  bool empty() const { return rest_.empty(); }
  char front() const { return rest_.empty() ? '\0' : rest_.front(); }
  bool take(char c) {
    if (front() != c) return false;
    rest_.remove_prefix(1);
    return true;
  }
  void blanks() {
    while (take(' ') || take('\t')) {
    }
  }
  /// Whole number; `digits`: how many it has.
  std::optional<long> number(int& digits) {
    long value = 0;
    if (front() < '0' || front() > '9') return {};
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc()) return {};
    digits = static_cast<int>(end - rest_.data());
    rest_.remove_prefix(static_cast<std::size_t>(digits));
    return value;
  }
  bool word(std::string_view upper) {
    if (rest_.size() < upper.size()) return false;
    for (std::size_t i = 0; i < upper.size(); ++i)
      if ((rest_[i] & ~0x20) != upper[i]) return false;
    rest_.remove_prefix(upper.size());
    return true;
  }

 private:
  std::string_view rest_;
};

std::optional<long> day_of(long a, long b, long c, bool year_first) {
  long year = year_first ? a : c, month = b, day = year_first ? c : a;
  if (!year_first && month > 12) std::swap(month, day);
  if (year < 100) year += 2000;
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(year)),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  if (year > 9999 || month > 12 || day > 31 || !date.ok()) return {};
  return std::chrono::sys_days(date).time_since_epoch().count();
}

bool read_date(StampText& text, Stamp& stamp) {
  int first = 0, digits = 0;
  const auto a = text.number(first);
  const char sign = text.front();
  if (!a || (sign != '-' && sign != '/' && sign != '.') || !text.take(sign)) return false;
  const auto b = text.number(digits);
  if (!b || digits > 2 || !text.take(sign)) return false;
  const auto c = text.number(digits);
  if (!c || (first != 4 && (first > 2 || digits == 3))) return false;
  stamp.day = day_of(*a, *b, *c, first == 4);
  return stamp.day.has_value();
}

/// HH:MM, HH:MM:SS, fractions of seconds, also MM:SS.f.
bool read_time(StampText& text, Stamp& stamp) {
  int digits = 0;
  const auto a = text.number(digits);
  if (!a || digits > 2 || !text.take(':')) return false;
  const auto b = text.number(digits);
  if (!b || digits != 2) return false;
  double hours = static_cast<double>(*a), minutes = static_cast<double>(*b), seconds = 0;
  const bool three = text.take(':');
  if (three) {
    const auto c = text.number(digits);
    if (!c || digits != 2) return false;
    seconds = static_cast<double>(*c);
  }
  double part = 0;
  if (text.take('.') || text.take(',') || text.take(':')) {
    const auto fraction = text.number(stamp.decimals);
    if (!fraction || stamp.decimals > 12) return false;
    part = static_cast<double>(*fraction) / std::pow(10.0, stamp.decimals);
    if (!three) seconds = minutes, minutes = hours, hours = 0;
  }
  text.blanks();
  if (text.word("AM")) hours = std::fmod(hours, 12);
  if (text.word("PM")) hours = std::fmod(hours, 12) + 12;
  if (hours > 24 || minutes > 59 || seconds > 60) return false;
  stamp.seconds = hours * 3600 + minutes * 60 + seconds + part;
  return true;
}

bool read_zone(StampText& text, Stamp& stamp) {
  text.blanks();
  if (text.take('Z') || text.word("UTC")) return text.empty();
  if (text.front() != '+' && text.front() != '-') return text.empty();
  const double sign = text.take('-') ? -1 : (text.take('+'), 1);
  int digits = 0;
  const auto a = text.number(digits);
  if (!a || (digits != 2 && digits != 4)) return false;
  long minutes = digits == 4 ? *a / 100 * 60 + *a % 100 : 60 * *a;
  if (digits == 2 && text.take(':')) {
    const auto b = text.number(digits);
    if (!b) return false;
    minutes += *b;
  }
  *stamp.seconds -= sign * 60.0 * static_cast<double>(minutes);
  return text.empty();
}

}  // namespace

std::optional<Stamp> read_stamp(std::string_view whole) {
  while (whole.ends_with(' ')) whole.remove_suffix(1);
  while (whole.starts_with(' ')) whole.remove_prefix(1);
  if (whole.find(':') == std::string_view::npos && whole.size() < 8) return {};
  Stamp stamp;
  StampText text(whole), try_date(whole);
  if (read_date(try_date, stamp)) {
    text = try_date;
    if (text.empty()) return stamp;
    if (!text.take('T')) text.blanks();
    text.take(',');
    text.blanks();
  }
  if (!read_time(text, stamp) || !read_zone(text, stamp)) return {};
  return stamp;
}

void StampColumns::find(const std::vector<std::string>& fields, bool numbered, std::vector<Heading>& headings) {
  if (fields.size() != headings.size()) return;
  bool any = false;
  for (std::size_t i = 0; i < fields.size(); ++i) {
    const auto stamp = read_stamp(fields[i]);
    if (!stamp) continue;
    is_.resize(fields.size(), false);
    is_[i] = any = true;
    headings[i].unit = find_unit("s");
    if (stamp->day && !first_day_) first_day_ = stamp->day;
    if (numbered || time_ >= 0 || !stamp->seconds) continue;
    time_ = static_cast<int>(i);
    headings[i].name = "time";
  }
  if (any && time_ < 0 && !numbered) is_.clear();  // dates alone are no time
}

bool StampColumns::take(std::size_t column, std::string_view text) {
  const auto stamp = read_stamp(text);
  if (!stamp) return false;
  if (stamp->day) line_.day = stamp->day;
  if (static_cast<int>(column) == time_) {
    if (!stamp->seconds) return false;
    line_.seconds = stamp->seconds;
    line_.decimals = std::max(line_.decimals, stamp->decimals);
  }
  return true;
}

double StampColumns::seconds() {
  double value = line_.seconds.value_or(0) + wrapped_;
  if (line_.day) {
    value += 86400.0 * static_cast<double>(*line_.day - first_day_.value_or(*line_.day));
  } else if (value < last_ - 43200) {
    value += 86400, wrapped_ += 86400;
  }
  line_.day.reset();
  last_ = value;
  return value;
}

}  // namespace whirl::io::detail
