#include "whirl/identify/record/channel_instants.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <optional>

#include "rules/rules.hpp"
#include "trajectory/held_input.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/evidence.hpp"

namespace whirl::identification {
namespace {

/// Rows of the weak form of all stretches: the states averaged, and their rates.
detail::IntegralRows rows_of(const std::vector<Recording>& records, const SindyOptions& options) {
  detail::IntegralRows all;
  const std::vector<detail::Stretch> stretches = detail::finite_stretches(records, options);
  std::vector<detail::Stretch> smooth = stretches;
  detail::smooth_stretches(smooth);
  const double rate = detail::characteristic_rate(smooth);
  for (const detail::Stretch& s : stretches) {
    const auto half = static_cast<Eigen::Index>(std::lround(1 / (rate * s.dt)));
    if (s.samples() < 2 * std::max<Eigen::Index>(4, half) + 1) continue;
    detail::IntegralRows own = detail::integral_rows(s, s.raw, 1, half);
    if (all.theta.rows() == 0) {
      all = std::move(own);
      continue;
    }
    detail::IntegralRows both{Eigen::MatrixXd(all.theta.rows() + own.theta.rows(), s.raw.cols()),
                              Eigen::MatrixXd(all.theta.rows() + own.theta.rows(), s.raw.cols())};
    both.theta << all.theta, own.theta;
    both.target << all.target, own.target;
    all = std::move(both);
  }
  return all;
}

/// Seconds by which state j is read after those instants at which it is the rate of state i.
std::optional<double> lateness(const detail::IntegralRows& rows, Eigen::Index i, Eigen::Index j) {
  const Eigen::VectorXd rate = rows.target.col(i), v = rows.theta.col(j);
  const double alone = (rate - v * (v.dot(rate) / v.squaredNorm())).squaredNorm();
  if (!(alone < rules::kIsRate * rate.squaredNorm())) return std::nullopt;
  // rate(t) = c v(t - late) = c (v - late v')
  Eigen::MatrixXd columns(rows.theta.rows(), 2);
  columns << v, rows.target.col(j);
  const Eigen::Vector2d fit = columns.colPivHouseholderQr().solve(rate);
  if (!((rate - columns * fit).squaredNorm() < rules::kLateBetter * alone)) return std::nullopt;
  return -fit[1] / fit[0];
}

}  // namespace

LateChannel late_channel(const std::string& text) {
  const std::size_t at = text.rfind('=');
  LateChannel late{text.substr(0, at), 0};
  std::size_t used = 0;
  try {
    if (at != std::string::npos && at > 0) late.seconds = std::stod(text.substr(at + 1), &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used == 0 || at + 1 + used != text.size() || !std::isfinite(late.seconds))
    throw Error::in_field("late channel", text, "CHANNEL=SECONDS, e.g. v=0.005");
  return late;
}

Recording at_common_instants(Recording record, const LateChannel& late) {
  record.at(late.channel);  // tells the channels that there are
  const double shift = late.seconds / record.dt;
  for (Channel& c : record.channels) {
    if (c.name == late.channel) c.samples = detail::read_before(c.samples, shift, false);
  }
  const auto lost = static_cast<Eigen::Index>(std::ceil(std::abs(shift)));
  if (record.size() <= lost)
    throw Error::in_field(
        "late channel", fmt::format("{}={:g}", late.channel, late.seconds),
        fmt::format("shorter than the record, {:g} s", record.dt * static_cast<double>(record.size())));
  return part_of(record, shift > 0 ? lost : 0, record.size() - lost);
}

std::vector<LateChannel> late_channels(const std::vector<Recording>& records, const SindyOptions& options) {
  constexpr int kRounds = 3;
  std::vector<LateChannel> found;
  if (options.order != 1 || options.discrete || options.states.size() < 2) return found;
  const double dt = records.front().dt;
  const auto n = static_cast<Eigen::Index>(options.states.size());
  const detail::IntegralRows rows = rows_of(records, options);
  if (rows.theta.rows() < 10 * n) return found;
  for (Eigen::Index j = 0; j < n; ++j) {
    for (Eigen::Index i = 0; i < n; ++i) {
      if (i == j) continue;
      std::optional<double> step = lateness(rows, i, j);
      if (!step || std::abs(*step) < rules::kLateLeast * dt) continue;
      LateChannel late{options.states[static_cast<std::size_t>(j)], *step};
      for (int round = 1; round < kRounds && step; ++round) {
        std::vector<Recording> moved;
        for (const Recording& r : records) moved.push_back(at_common_instants(r, late));
        step = lateness(rows_of(moved, options), i, j);
        late.seconds += step.value_or(0);
      }
      found.push_back(late);
      break;
    }
  }
  return found;
}

}  // namespace whirl::identification
