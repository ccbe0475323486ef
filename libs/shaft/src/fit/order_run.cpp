#include "whirl/shaft/fit/order_run.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/order.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::VectorXd;

OrderRun order_run(const Recording& record, Index first, const VectorXd& angle,
                   const std::vector<std::string>& channels, const std::string& name, int most_blocks) {
  require_range("most_blocks", most_blocks, 8, 100000);
  const Index n = angle.size();
  // The first whole turn, as `signal::order_vectors` finds it.
  const double begin = n > 1 ? kTwoPi * std::ceil(angle[0] / kTwoPi - 1e-9) : 0;
  const auto whole = static_cast<Index>(n > 1 ? std::floor(angle[n - 1] / kTwoPi + 1e-9) - begin / kTwoPi : 0);
  if (whole < 8)
    throw Error(fmt::format("{}: {} whole turns: a fit needs 8 and more", record.source, std::max<Index>(0, whole)));
  OrderRun run;
  run.name = name;
  run.turns = static_cast<int>((whole + most_blocks - 1) / most_blocks);
  for (std::size_t c = 0; c < channels.size(); ++c) {
    const signal::OrderVectors v =
        signal::order_vectors(record[channels[c]].segment(first, n), angle, record.dt, 1, run.turns);
    if (c == 0) run.vectors.resize(static_cast<Index>(channels.size()), v.value.size());
    run.vectors.row(static_cast<Index>(c)) = v.value.transpose();
  }
  const Index blocks = run.vectors.cols(), points = blocks * run.turns * kGridPerTurn;
  run.time.resize(points + 1);
  Index i = 0;
  for (Index k = 0; k <= points; ++k) {
    const double target = begin + kTwoPi / kGridPerTurn * static_cast<double>(k);
    while (i + 2 < n && angle[i + 1] < target) ++i;
    run.time[k] = record.dt * (static_cast<double>(first + i) + (target - angle[i]) / (angle[i + 1] - angle[i]));
  }
  run.speed.resize(blocks);
  run.samples.resize(blocks);
  const Index per_block = static_cast<Index>(run.turns) * kGridPerTurn;
  for (Index b = 0; b < blocks; ++b) {
    const double span = run.time[(b + 1) * per_block] - run.time[b * per_block];
    run.speed[b] = kTwoPi * run.turns / span;
    run.samples[b] = span / record.dt;
  }
  return run;
}

}  // namespace whirl::shaft
