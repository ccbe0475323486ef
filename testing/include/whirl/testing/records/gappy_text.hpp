#pragma once
#include <fmt/format.h>

#include <array>
#include <random>
#include <string>

#include "whirl/core/recording.hpp"

/// Text as loggers write it when values or lines are missing or the clock is uneven.
namespace whirl::testing {

enum class Gaps {
  none,
  empty_cells,   ///< the second column (the first after the time) is empty for a while
  nan_words,     ///< NaN, nan and NA in two columns, at two times
  empty_lines,   ///< all values of some lines are missing, the times stand
  lost_lines,    ///< a stretch of lines is missing
  single_lines,  ///< 3 % of the lines are missing, one by one
  single_cells,  ///< 2 % of the cells are empty, one by one
  uneven_clock,  ///< instants up to 0.3 of a step early or late
  random_clock,  ///< instants at random, the time between two of exponential distribution (not among kGaps)
};
inline constexpr std::array kGaps = {Gaps::none,       Gaps::empty_cells,  Gaps::nan_words,    Gaps::empty_lines,
                                     Gaps::lost_lines, Gaps::single_lines, Gaps::single_cells, Gaps::uneven_clock};
inline const char* to_string(Gaps g) {
  constexpr std::array names = {"none",         "empty cells",  "NaN words",    "empty lines", "lost lines",
                                "single lines", "single cells", "uneven clock", "random clock"};
  return names[static_cast<std::size_t>(g)];
}

/// CSV of every `every`-th sample of a clean, `every` times finer record; `noise` (rms) is added to the first `noisy`
/// channels. Headers: `headers`, beginning with that of the time. Long gaps last 2 % of the record.
inline std::string gappy_text(const Recording& fine, int every, const std::vector<std::string>& headers,
                              std::size_t noisy, double noise, Gaps gaps, unsigned seed) {
  std::mt19937_64 random(seed * 6364136223846793005ULL + 99);
  std::normal_distribution<double> gauss(0, noise);
  std::uniform_real_distribution<double> chance(0, 1);
  std::uniform_int_distribution<int> late(-3 * every / 10, 3 * every / 10);
  std::exponential_distribution<double> until_next(1.0 / every);
  Eigen::Index clock = 0;
  std::string text;
  for (std::size_t k = 0; k < headers.size(); ++k) text += (k ? "," : "") + headers[k];
  text += "\n";
  const Eigen::Index rows = (fine.size() - 1) / every;
  const Eigen::Index first = rows * 3 / 10, second = rows * 6 / 10, length = rows / 50;
  for (Eigen::Index i = 0; i < rows; ++i) {
    Eigen::Index at = i * every;
    if (gaps == Gaps::uneven_clock && i > 0) at += late(random);
    if (gaps == Gaps::random_clock) {
      at = clock;
      clock += 1 + static_cast<Eigen::Index>(until_next(random));
      if (at >= fine.size()) break;
    }
    const bool in_first = i >= first && i < first + length, in_second = i >= second && i < second + length;
    std::string line = fmt::format("{:.7f}", fine.t0 + fine.dt * static_cast<double>(at));
    const bool lost =
        (gaps == Gaps::lost_lines && in_first) || (gaps == Gaps::single_lines && i > 0 && chance(random) < 0.03);
    for (std::size_t c = 0; c < fine.channels.size(); ++c) {
      std::string cell = fmt::format("{:.9g}", fine.channels[c].samples[at] + (c < noisy ? gauss(random) : 0));
      if (gaps == Gaps::empty_cells && c == 0 && in_first) cell = "";
      if (gaps == Gaps::nan_words && c == 0 && in_first) cell = i % 2 ? "NaN" : "NA";
      if (gaps == Gaps::nan_words && c == 1 && in_second) cell = "nan";
      if (gaps == Gaps::empty_lines && in_first) cell = "";
      if (gaps == Gaps::single_cells && chance(random) < 0.02 && i > 2 && i + 3 < rows) cell = "";
      line += "," + cell;
    }
    if (!lost) text += line + "\n";
  }
  return text;
}

}  // namespace whirl::testing
