// Pairs of lines at equal distances from 1X or 2X: an amplitude or a speed that changes periodically.
#include <algorithm>
#include <cmath>

#include "findings/channel_study.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::diagnosis::detail {
namespace {

constexpr Eigen::Index kLeastBand = 64;  // turns: in shorter blocks there is no room between the orders
constexpr double kFurthest = 0.47;       // orders
constexpr double kEitherSide = 1e-3;     // chance of each line of the pair alone
constexpr double kSkirts = 0.125;        // orders: a phase that wanders over eight turns spreads 1X so far
constexpr double kCarriers[] = {1, 2};

struct Pair {
  double carrier = 0, distance = 0;  // order, Hz
  double chance = 1, size = 0, power = 0;
};

Pair pair_at(const std::vector<const LineBlock*>& blocks, double carrier, double distance) {
  std::vector<double> up, down;
  Pair out{carrier, distance};
  double high = 0, low = 0;
  for (const LineBlock* b : blocks) {
    const double middle = b->bin_of({carrier, 0}), apart = distance * b->duration();
    const auto above = static_cast<Eigen::Index>(std::lround(middle + apart));
    const auto below = static_cast<Eigen::Index>(std::lround(middle - apart));
    if (below < 3 || above + 1 >= b->bins() || b->near_line(above) || b->near_line(below)) continue;
    const LineValue more = b->at_bin(above), less = b->at_bin(below);
    up.push_back(more.chance);
    down.push_back(less.chance);
    high += std::norm(more.vector);
    low += std::norm(less.vector);
    out.power += std::min(more.power, less.power);
  }
  if (up.empty()) return out;
  const double p = fisher(up), q = fisher(down);
  if (p < kEitherSide && q < kEitherSide) out.chance = fisher({p, q});
  out.size = std::sqrt(std::max(high, low) / static_cast<double>(up.size()));
  return out;
}

}  // namespace

void find_sidebands(ChannelStudy& s) {
  std::vector<const LineBlock*> blocks;
  double longest = 0, turning = 0;
  for (const LineBlock& b : s.blocks) {
    if (b.turns() < kLeastBand) continue;
    blocks.push_back(&b);
    longest = std::max(longest, b.duration());
    turning = std::max(turning, b.turning());
  }
  if (blocks.empty() || s.runs())
    return s.unjudged(VibrationCode::sidebands,
                      s.runs() ? UnjudgedReason::speed_changes : UnjudgedReason::too_few_turns);
  const LineValue first = blocks.front()->fitted({1, 0});
  Pair best;
  double tests = 0;
  for (const double carrier : kCarriers) {
    for (double distance = 3 / longest; distance < kFurthest * turning; distance += 1 / longest, ++tests) {
      const Pair here = pair_at(blocks, carrier, distance);
      // The skirts of a phase that wanders are no larger than the wander times 1X.
      if (distance < kSkirts * turning && here.size < s.scatter * first.amplitude()) continue;
      if (here.chance < best.chance || (here.chance == best.chance && here.power > best.power)) best = here;
    }
  }
  if (!(best.chance < 1)) return;
  VibrationFinding f;
  f.code = VibrationCode::sidebands;
  f.size = best.size;
  f.chance = best.chance * tests;
  f.order = best.carrier;
  f.frequency = best.distance;
  f.speed = blocks.front()->speed();
  const LineValue carrier = blocks.front()->fitted({best.carrier, 0});
  if (first.amplitude() > 0 && carrier.amplitude() > 0) f.ratio = best.size / first.amplitude();
  f.causes = {Cause::modulation, Cause::electric, Cause::looseness};
  s.add(std::move(f));
}

}  // namespace whirl::diagnosis::detail
