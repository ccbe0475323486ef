#include "whirl/monitor/loop_columns.hpp"

#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"
#include "whirl/core/nan.hpp"

namespace whirl::monitor {

LoopRow loop_row(const rt::LoopSample& s, double previous_start) {
  const bool valid = (s.flags & rt::kValid) != 0, armed = (s.flags & rt::kArmed) != 0;
  const double unbalance = std::hypot(s.omega * s.omega, s.omega_dot);
  const auto internal = [&](double value) { return armed ? value : 0.0; };
  const double e = armed && std::abs(s.omega) > 1 ? std::hypot(s.dx_est, s.dy_est) / unbalance : 0.0;
  return {valid ? s.x : kNaN,
          valid ? s.y : kNaN,
          s.beta,
          s.omega,
          s.ux,
          s.uy,
          internal(s.s_x),
          internal(s.s_y),
          internal(s.x_est),
          internal(s.y_est),
          internal(s.vx_est),
          internal(s.vy_est),
          e,
          s.started - s.scheduled,
          previous_start > 0 ? s.started - previous_start : 0.0,
          armed ? 1.0 : 0.0,
          (s.flags & (rt::kLimited | rt::kSaturated)) != 0 ? 1.0 : 0.0};
}

Recording loop_recording(const rt::LoopRecord& record, const std::string& file) {
  if (record.cycles.size() < 2) throw Error::in_file(file, 0, "holds no two cycles");
  const std::int64_t first = record.cycles.front().tick, last = record.cycles.back().tick;
  if (last <= first || last - first > 100'000'000) throw Error::in_file(file, 0, "ticks that do not ascend");
  Eigen::MatrixXd table =
      Eigen::MatrixXd::Constant(last - first + 1, static_cast<Eigen::Index>(kLoopColumns.size()), kNaN);
  double previous = 0;
  for (const rt::LoopSample& s : record.cycles) {
    const LoopRow row = loop_row(s, previous);
    previous = s.started;
    if (s.tick < first || s.tick > last) continue;
    table.row(s.tick - first) = Eigen::Map<const Eigen::RowVectorXd>(row.data(), table.cols());
  }
  Recording out;
  out.dt = record.head.sample_time;
  out.source = file;
  for (std::size_t c = 0; c < kLoopColumns.size(); ++c) {
    out.add(std::string(kLoopColumns[c].first), kLoopColumns[c].second, table.col(static_cast<Eigen::Index>(c)));
  }
  return out;
}

}  // namespace whirl::monitor
