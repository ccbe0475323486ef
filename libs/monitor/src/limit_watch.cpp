#include "whirl/monitor/limit_watch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/io/units.hpp"
#include "whirl/report/format.hpp"

namespace whirl::monitor {
namespace {

constexpr double kBackBelow = 1;  // s without an excess that end it

}  // namespace

LimitWatch::LimitWatch(const StreamInfo& info, const std::map<std::string, double>& limits) : info_(info) {
  for (const auto& [channel, limit] : limits) set(channel, limit);
}

void LimitWatch::set(const std::string& channel, double limit) {
  const auto found = std::find_if(info_.channels.begin(), info_.channels.end(),
                                  [&](const ChannelInfo& c) { return c.name == channel; });
  if (found == info_.channels.end()) {
    std::string names;
    for (const ChannelInfo& c : info_.channels) names += (names.empty() ? "" : ", ") + c.name;
    throw Error::in_field("limit", channel, "a channel of the stream: " + names);
  }
  if (!(limit > 0 && std::isfinite(limit)))
    throw Error::in_field("limit of " + channel, fmt::format("{:g}", limit), "positive");
  const State fresh{.channel = found - info_.channels.begin(), .limit = limit};
  const auto same =
      std::find_if(states_.begin(), states_.end(), [&](const State& s) { return s.channel == fresh.channel; });
  if (same == states_.end()) {
    states_.push_back(fresh);
  } else {
    *same = fresh;
  }
}

void LimitWatch::reset() {
  for (State& s : states_) s.largest = 0, s.crossings = 0;
}

std::vector<std::string> LimitWatch::look(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows,
                                          const std::string& where) {
  std::vector<std::string> lines;
  for (State& s : states_) {
    const ChannelInfo& channel = info_.channels[static_cast<std::size_t>(s.channel)];
    const auto text = [&](double value) {
      return report::format_amplitude(value, AmplitudeKind::peak, channel.quantity);
    };
    for (Eigen::Index i = 0; i < rows.rows(); ++i) {
      const double size = std::abs(rows(i, s.channel)), t = t_first + static_cast<double>(i) / info_.rate;
      if (size > s.largest) s.largest = size;
      if (size > s.limit) {
        if (!s.over) {
          ++s.crossings;
          s.largest = size;
          lines.push_back(
              fmt::format("{} above its limit of {} since {:.3f} s{}", channel.name, text(s.limit), t, where));
        }
        s.over = true;
        s.last_over = t;
      } else if (s.over && t - s.last_over > kBackBelow) {
        s.over = false;
        lines.push_back(fmt::format("{} below its limit again since {:.3f} s{}, largest {}", channel.name, s.last_over,
                                    where, text(s.largest)));
      }
    }
  }
  return lines;
}

std::pair<std::string, double> read_limit(const std::string& text) {
  const std::size_t equals = text.find('=');
  const io::NameWithUnit name = io::split_unit(text.substr(0, equals));
  double value = 0;
  const char* begin = text.data() + (equals == std::string::npos ? text.size() : equals + 1);
  const char* end = text.data() + text.size();
  if (name.unit == nullptr || begin == end || std::from_chars(begin, end, value) != std::from_chars_result{end, {}}) {
    throw Error::in_field("--limit", text, "a channel with its unit and a number, e.g. x_mm=0.5");
  }
  return {name.name, name.unit->to_si(value)};
}

}  // namespace whirl::monitor
