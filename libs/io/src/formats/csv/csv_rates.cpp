#include "formats/csv/csv_rates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace whirl::io::detail {
namespace {

using Rows = std::vector<Eigen::Index>;

Rows rows_with_values(const Eigen::VectorXd& v) {
  Rows out;
  for (Eigen::Index i = 0; i < v.size(); ++i)
    if (std::isfinite(v[i])) out.push_back(i);
  return out;
}

/// Values at rows `at`, by straight lines between the rows that have one; NaN outside.
Eigen::VectorXd by_lines(const Eigen::VectorXd& t, const Eigen::VectorXd& v, const Rows& known, const Rows& at) {
  Eigen::VectorXd out(static_cast<Eigen::Index>(at.size()));
  std::size_t k = 0;
  for (std::size_t i = 0; i < at.size(); ++i) {
    const double now = t[at[i]];
    while (k + 1 < known.size() && t[known[k + 1]] < now) ++k;
    double& value = out[static_cast<Eigen::Index>(i)];
    value = std::numeric_limits<double>::quiet_NaN();
    if (t[known[k]] == now) value = v[known[k]];
    if (k + 1 >= known.size() || t[known[k]] > now) continue;
    const double share = (now - t[known[k]]) / (t[known[k + 1]] - t[known[k]]);
    value = (1 - share) * v[known[k]] + share * v[known[k + 1]];
  }
  return out;
}

/// Rows that follow each other at even times.
bool evenly_timed(const Eigen::VectorXd& t, const Rows& rows) {
  const double step = (t[rows.back()] - t[rows.front()]) / static_cast<double>(rows.size() - 1);
  std::size_t even = 0;
  for (std::size_t k = 1; k < rows.size(); ++k) even += std::abs(t[rows[k]] - t[rows[k - 1]] - step) < 0.3 * step;
  return 10 * even >= 9 * (rows.size() - 1);
}

}  // namespace

std::vector<std::string> join_rates(Eigen::VectorXd& t, std::vector<Channel>& channels, std::size_t time) {
  std::vector<Rows> rows;
  std::size_t fastest = 0, slowest = static_cast<std::size_t>(t.size());
  for (const Channel& c : channels) {
    rows.push_back(rows_with_values(c.samples));
    if (rows.size() - 1 == time) continue;
    fastest = std::max(fastest, rows.back().size());
    slowest = std::min(slowest, rows.back().size());
  }
  if (slowest < 3 || 10 * slowest > 6 * static_cast<std::size_t>(t.size())) return {};
  Rows kept;
  for (std::size_t c = 0; c < rows.size(); ++c)
    if (c != time && rows[c].size() == fastest) kept = rows[c];
  for (std::size_t c = 0; c < rows.size(); ++c)
    if (c != time && !evenly_timed(t, rows[c])) return {};  // holes, not a rate
  std::vector<std::string> said;
  const double rate = static_cast<double>(fastest - 1) / (t[kept.back()] - t[kept.front()]);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (c == time) continue;
    if (rows[c] != kept)
      said.push_back(fmt::format(
          "{} has {:.4g} values a second, the table {:.4g}: taken to its times by straight lines", channels[c].name,
          rate * static_cast<double>(rows[c].size()) / static_cast<double>(fastest), rate));
    channels[c].samples = by_lines(t, channels[c].samples, rows[c], kept);
  }
  t = t(kept).eval();
  channels[time].samples = t;
  return said;
}

double six_digits(const Eigen::VectorXd& t) {
  const double largest = t.cwiseAbs().maxCoeff();
  return largest > 0 ? std::pow(10.0, std::floor(std::log10(largest)) - 5) : 0;
}

bool agrees_coarsely(const Eigen::VectorXd& t, double rate) {
  double step = std::numeric_limits<double>::infinity();  // in which the times are written
  bool stands = false;
  for (Eigen::Index i = 1; i < t.size(); ++i) {
    stands = stands || t[i] == t[i - 1];
    if (t[i] > t[i - 1]) step = std::min(step, t[i] - t[i - 1]);
  }
  const double allowed = std::max(step, six_digits(t)) + 0.5 / rate;
  for (Eigen::Index i = 0; stands && i < t.size(); ++i)
    if (std::abs(t[i] - t[0] - static_cast<double>(i) / rate) > allowed) return false;
  return stands;
}

}  // namespace whirl::io::detail
