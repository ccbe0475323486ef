#include "formats/csv/csv_headless.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "formats/csv/csv_fields.hpp"

namespace whirl::io::detail {
namespace {

bool rises_evenly(const std::vector<double>& v) {
  if (v.size() < 2) return true;  // one line tells nothing
  const double step = (v.back() - v.front()) / static_cast<double>(v.size() - 1);
  for (std::size_t i = 1; i < v.size(); ++i)
    if (!(std::abs(v[i] - v[i - 1] - step) < 0.3 * step)) return false;  // rounded times stay within that
  return true;
}

/// The step in s, in a line `Resolution:1e-4` or `SignalResolution:1e-4:` of the pair; 0 where there is none.
double step_of_pair(const std::filesystem::path& file, std::string& pair) {
  constexpr std::string_view kEnding = ".Wfm.csv";
  const std::string name = file.filename().string();
  if (!name.ends_with(kEnding)) return 0;
  pair = name.substr(0, name.size() - kEnding.size()) + ".csv";
  std::ifstream in(file.parent_path() / pair);
  double step = 0;
  for (std::string line; step <= 0 && std::getline(in, line);) {
    for (const std::string_view key : {"Resolution:", "SignalResolution:"})
      if (line.starts_with(key)) step = std::strtod(line.c_str() + key.size(), nullptr);
  }
  return std::isfinite(step) ? step : 0;
}

}  // namespace

std::string proposed_numbers(const std::string& file, std::size_t columns, const std::vector<double>& first) {
  constexpr std::string_view kNames[] = {"x_mm", "y_mm", "beta_rad"};
  const bool timed = columns > 1 && rises_evenly(first);
  std::string out = timed ? "1:t_s" : "";
  for (std::size_t i = timed ? 1 : 0, name = 0; i < columns && name < std::size(kNames); ++i, ++name)
    out += fmt::format("{}{}:{}", out.empty() ? "" : " ", i + 1, kNames[name]);
  if (timed) return out;
  std::string pair;
  const double step = step_of_pair(file, pair);
  return step > 0 ? fmt::format("{} --rate {:.6g} (the step of {} s is in {})", out, 1 / step, step, pair)
                  : out + " --rate HZ";
}

}  // namespace whirl::io::detail
