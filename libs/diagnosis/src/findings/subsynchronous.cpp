// A line below half of the speed: oil whirl, which keeps its order, or oil whip, which keeps a natural frequency. A
// line at 0.5X itself is a half order.
#include <algorithm>
#include <cmath>

#include "findings/channel_study.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::diagnosis::detail {
namespace {

constexpr Eigen::Index kShortBlock = 64;                            // turns: a whirl wanders, long blocks spread it
constexpr double kShortSteady = 0.05;                               // change of the speed over a block
constexpr double kLowest = 0.38, kHighest = 0.495, kBeyond = 0.52;  // orders
constexpr double kStep = 0.5 / static_cast<double>(kShortBlock);
constexpr int kWhirlLobe = 4;                           // steps: half the lobe of a Hann window
constexpr double kLockedNats = 6, kLockedShare = 0.02;  // of the log likelihood: below it a line may stand at 0.5X
constexpr double kOutside = 1e-3;  // chance of a fixed line where it is no subharmonic: another source

struct Whirl {
  Line line;
  double evidence = 1, likelihood = 0, power = 0;
  std::vector<LineValue> values;
  std::vector<std::size_t> seen;
};

// The line in the blocks where its order lies in the range.
Whirl whirl_at(const std::vector<LineBlock>& blocks, const Line& line) {
  Whirl out{line, 1, 0, 0, std::vector<LineValue>(blocks.size()), {}};
  std::vector<double> chances;
  std::vector<std::size_t> places;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const LineBlock& b = blocks[k];
    const double order = b.bin_of(line) / static_cast<double>(b.turns());
    if (order < kLowest - 1e-9 || order > kBeyond) continue;
    out.values[k] = b.added(line);
    if (!(out.values[k].share >= kLeastShare)) continue;
    const double noise = b.floor(b.bin_of(line));
    if (noise > 0) out.likelihood += out.values[k].power / noise;
    out.power += out.values[k].power;
    chances.push_back(out.values[k].chance);
    places.push_back(k);
  }
  const Evidence e = evidence_of(chances);
  out.evidence = e.chance;
  for (const std::size_t k : e.seen) out.seen.push_back(places[k]);
  return out;
}

Whirl best_of(const std::vector<LineBlock>& blocks, double from, double to, double step, bool fixed) {
  Whirl best;
  double tests = 0;
  for (double at = from; at <= to; at += step, ++tests) {
    Whirl here = whirl_at(blocks, fixed ? Line{0, at} : Line{at, 0});
    if (here.likelihood > best.likelihood) best = std::move(here);
  }
  if (best.likelihood <= 0) return best;
  const double tested = tests * best.evidence;
  // Far above the noise the floor beside a line is its own leakage, which is least where the line is not: the top is
  // where the power is.
  const auto place = [&] { return fixed ? best.line.frequency : best.line.order; };
  for (const int side : {-1, 1}) {
    for (int k = 0; k < kWhirlLobe; ++k) {
      const double at = place() + side * step;
      if (at < from - 1e-9 || at > to + 1e-9) break;
      Whirl here = whirl_at(blocks, fixed ? Line{0, at} : Line{at, 0});
      if (here.power <= best.power) break;
      best = std::move(here);
    }
  }
  for (double fine = 0.5 * step; fine > 0.05 * step; fine *= 0.5) {
    for (const double move : {-fine, fine}) {
      const double at = place() + move;
      Whirl here = whirl_at(blocks, fixed ? Line{0, at} : Line{at, 0});
      if (here.power > best.power) best = std::move(here);
    }
  }
  best.evidence = tested;
  return best;
}

// A fixed line that also stands outside of the range is no whip.
bool is_elsewhere(const std::vector<LineBlock>& blocks, const Line& line) {
  std::vector<double> chances;
  for (const LineBlock& b : blocks) {
    const double order = b.bin_of(line) / static_cast<double>(b.turns());
    if (order >= kLowest - 0.1 && order <= kBeyond + 0.1) continue;
    const LineValue value = b.added(line);
    if (value.share >= kLeastShare) chances.push_back(value.chance);
  }
  return chances.size() >= 2 && fisher(chances) < kOutside;
}

}  // namespace

void find_subsynchronous(ChannelStudy& s) {
  std::vector<Line> lines = order_lines(false);
  lines.insert(lines.end(), s.electric.begin(), s.electric.end());
  const std::vector<LineBlock> blocks = blocks_of(s.channel, lines, kShortBlock, kShortSteady);
  if (blocks.empty()) return;
  Whirl best = best_of(blocks, kLowest, kBeyond, kStep, false);
  // Both against the noise beside the best.
  const double half = best.power > 0 ? best.likelihood * whirl_at(blocks, {0.5, 0}).power / best.power : 0;
  const bool locked = best.likelihood - half < std::max(kLockedNats, kLockedShare * best.likelihood);
  bool whip = false;
  if (s.runs()) {
    double slow = INFINITY, fast = 0, longest = 0;
    for (const LineBlock& b : blocks) {
      slow = std::min(slow, b.turning());
      fast = std::max(fast, b.turning());
      longest = std::max(longest, b.duration());
    }
    Whirl fixed = best_of(blocks, kLowest * slow, kHighest * fast, 0.5 / longest, true);
    whip = fixed.likelihood > best.likelihood + kLockedNats && !is_elsewhere(blocks, fixed.line);
    if (whip) best = std::move(fixed);
  }
  if (best.seen.empty() || (!whip && (locked || best.line.order > kHighest))) return;
  VibrationFinding f;
  f.code = VibrationCode::subsynchronous;
  f.chance = 2 * best.evidence;
  std::size_t top = best.seen.front();
  std::vector<LineValue> shown;
  for (const std::size_t k : best.seen) {
    shown.push_back(best.values[k]);
    if (best.values[k].amplitude() > best.values[top].amplitude()) top = k;
    f.low_speed = std::fmin(f.low_speed, blocks[k].speed());
    f.high_speed = std::fmax(f.high_speed, blocks[k].speed());
  }
  f.size = s.runs() ? best.values[top].amplitude() : ChannelStudy::mean_amplitude(shown);
  f.speed = blocks[top].speed();
  f.order = blocks[top].bin_of(best.line) / static_cast<double>(blocks[top].turns());
  f.frequency = whip ? best.line.frequency : f.order * blocks[top].turning();
  const LineValue first = blocks[top].fitted({1, 0});
  if (first.amplitude() > 0) f.ratio = best.values[top].amplitude() / first.amplitude();
  f.causes =
      whip ? std::vector{Cause::oil_whip, Cause::rub} : std::vector{Cause::oil_whirl, Cause::rub, Cause::other_machine};
  s.whirl = s.add(std::move(f));
}

}  // namespace whirl::diagnosis::detail
