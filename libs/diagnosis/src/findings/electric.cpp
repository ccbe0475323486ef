// Lines at the frequency of the supply and twice it: a frequency that stays while the orders move with the speed.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "findings/channel_study.hpp"

namespace whirl::diagnosis::detail {
namespace {

constexpr std::size_t kQuarter = 4;
constexpr int kLineLobe = 4;                // steps: half the lobe of a Hann window
constexpr double kHannLobe = 4.5;           // steps: the lobe of a Hann window from its top on
constexpr double kFollowedBeat = 1.0 / 16;  // orders: the blocks of such an angle are 16 turns
constexpr double kOffSupply = 0.025;        // of the frequency: grids of one generating set, two-pole motors with slip
constexpr double kLeastStretch = 4;         // of 1 / duration, between two orders
constexpr std::size_t kManyBlocks = 16, kLook = 4;
constexpr double kSeenAtAll = 0.01;                   // chance at the best frequency of such a look
constexpr double kWhirlFrom = 0.38, kWhirlTo = 0.52;  // orders: such a line at steady speed is judged as a whirl
constexpr double kPairReach = 0.47;                   // orders from 1X or 2X within which a line may be a sideband
constexpr double kPairChance = 1e-6;                  // of its mirror
constexpr double kPairShare = 0.5;                    // of its amplitude that the mirror has

struct SearchedLine {
  Line line;
  double chance = 1;
  std::vector<LineValue> values;
};

// The line is there throughout the record: the quarter of the blocks that show it best does not count.
double throughout(std::vector<double> chances) {
  std::ranges::sort(chances);
  if (chances.size() >= kQuarter)
    chances.erase(chances.begin(), chances.begin() + static_cast<std::ptrdiff_t>(chances.size() / kQuarter));
  return fisher(chances);
}

// Blocks and what was seen in them: searches of wide and of narrow ranges look at the same places.
class Looks {
 public:
  explicit Looks(const std::vector<LineBlock>& all) : blocks(all) {}
  const LineValue& at(std::size_t block, double frequency) {
    const auto [seen, fresh] = seen_.try_emplace({frequency, block});
    if (fresh) seen->second = blocks[block].added({0, frequency});
    return seen->second;
  }
  const std::vector<LineBlock>& blocks;

 private:
  std::map<std::pair<double, std::size_t>, LineValue> seen_;
};

// `every`: of the blocks, for a first look.
SearchedLine at_frequency(Looks& looks, double frequency, std::size_t every = 1) {
  SearchedLine out{{0, frequency}, 1, {}};
  std::vector<double> chances;
  for (std::size_t k = 0; k < looks.blocks.size(); k += every) {
    const LineValue& value = looks.at(k, frequency);
    if (!(value.share >= kLeastShare)) continue;
    chances.push_back(value.chance);
    out.values.push_back(value);
  }
  out.chance = throughout(chances);
  return out;
}

double total_power(const SearchedLine& s) {
  double sum = 0;
  for (const LineValue& v : s.values) sum += v.power;
  return sum;
}

// The frequency that all blocks show best, within a share of `nominal`.
SearchedLine search(Looks& looks, double nominal, double tolerance, std::size_t every = 1) {
  double longest = 0;
  for (const LineBlock& b : looks.blocks) longest = std::max(longest, b.duration());
  const double reach = tolerance * nominal, step = 0.5 / longest;
  const int half = static_cast<int>(std::floor(reach / step));
  SearchedLine best;
  for (int k = -half; k <= half; ++k) {
    SearchedLine here = at_frequency(looks, nominal + k * step, every);
    if (here.values.empty()) continue;
    const bool better =
        here.chance < best.chance || (here.chance == best.chance && total_power(here) > total_power(best));
    if (best.values.empty() || better) best = std::move(here);
  }
  if (best.values.empty() || every > 1) return best;
  // Far above the noise the chance counts the leakage of the line itself, which is least where it is not: the top is
  // where the power is.
  for (const int side : {-1, 1}) {
    for (int k = 1; k <= kLineLobe; ++k) {
      const double frequency = best.line.frequency + side * step;
      SearchedLine here = at_frequency(looks, frequency);
      const bool within = std::abs(frequency - nominal) < (half + 0.5) * step;
      if (!within || here.values.size() != best.values.size() || total_power(here) <= total_power(best)) break;
      here.chance = std::min(here.chance, best.chance);
      best = std::move(here);
    }
  }
  // More power beyond the end of the range: the skirt of a line that is not the supply's.
  for (const int side : {-1, 1}) {
    for (const int beyond : {1, 2}) {
      const double frequency = nominal + side * (half + beyond) * step;
      if (std::abs(frequency - best.line.frequency) < kHannLobe * step &&
          total_power(at_frequency(looks, frequency)) > total_power(best))
        return {};
    }
  }
  for (double fine = 0.5 * step; fine > 0.02 * step; fine *= 0.5) {
    for (const double move : {-fine, fine}) {
      SearchedLine here = at_frequency(looks, best.line.frequency + move);
      if (here.values.size() == best.values.size() && total_power(here) > total_power(best)) {
        here.chance = std::min(here.chance, best.chance);
        best = std::move(here);
      }
    }
  }
  best.chance *= 2 * half + 1;
  return best;
}

// The line and its mirror about 1X or 2X are a pair of sidebands, which may lie where the supply is.
bool is_sideband(const std::vector<LineBlock>& blocks, const SearchedLine& s, const std::vector<double>& mains) {
  // Midway between the supply and twice it the mirror of one is the other.
  const auto supplied = [&](double frequency, double duration) {
    return std::ranges::any_of(mains, [&](double m) {
      return std::abs(frequency - m) < kMainsTolerance * m + 3 / duration ||
             std::abs(frequency - 2 * m) < kMainsTolerance * 2 * m + 3 / duration;
    });
  };
  const double size = ChannelStudy::mean_amplitude(s.values);
  return std::ranges::any_of(std::array{1.0, 2.0}, [&](double carrier) {
    std::vector<double> chances;
    std::vector<LineValue> values;
    for (const LineBlock& b : blocks) {
      if (std::abs(s.line.frequency / b.turning() - carrier) > kPairReach) continue;
      const double across = 2 * carrier * b.turning() - s.line.frequency;
      if (supplied(across, b.duration())) continue;
      LineValue best;
      for (const double off : {-1.0, 0.0, 1.0}) {
        const LineValue value = b.added({0, across + off / b.duration()}, false);
        if (value.share >= kLeastShare && value.power > best.power) best = value;
      }
      if (!(best.share >= kLeastShare)) continue;
      chances.push_back(best.chance);
      values.push_back(best);
    }
    return fisher(chances) < kPairChance && ChannelStudy::mean_amplitude(values) > kPairShare * size;
  });
}

struct Stretch {
  double low = 0, high = 0;  // Hz
};

// Where a line off the supply may be. At steady speed an order leaves its skirts beside it, and a whirl is no electric
// line: there it is the wide range less what lies near a multiple of half the speed.
std::vector<Stretch> clear_of_orders(const ChannelStudy& s, const std::vector<LineBlock>& blocks, double nominal) {
  const double reach = kOffSupply * nominal;
  if (s.runs()) return {{nominal - reach, nominal + reach}};
  double longest = 0, slowest = INFINITY, fastest = 0;
  for (const LineBlock& b : blocks) {
    longest = std::max(longest, b.duration());
    slowest = std::min(slowest, b.turning());
    fastest = std::max(fastest, b.turning());
  }
  if (nominal / slowest > kWhirlFrom && nominal / fastest < kWhirlTo) return {};
  std::vector<Stretch> out;
  double low = nominal - reach;
  const double guard = 3 / longest;
  const auto add = [&](double high) {
    if (high - low > kLeastStretch / longest) out.push_back({low, high});
  };
  for (double k = std::ceil((nominal - reach - guard) / (0.5 * fastest)); 0.5 * k * slowest < nominal + reach + guard;
       ++k) {
    add(std::min(0.5 * k * slowest - guard, nominal + reach));
    low = std::max(low, 0.5 * k * fastest + guard);
  }
  add(nominal + reach);
  return out;
}

// The line within these stretches that the blocks show best.
SearchedLine search_off_supply(const ChannelStudy& s, Looks& looks, double nominal) {
  const std::vector<Stretch> stretches = clear_of_orders(s, looks.blocks, nominal);
  SearchedLine best;
  for (const Stretch& part : stretches) {
    const double middle = 0.5 * (part.low + part.high), share = 0.5 * (part.high - part.low) / middle;
    // Runs have many blocks and the range is wide: a first look at some of them.
    if (looks.blocks.size() >= kManyBlocks && search(looks, middle, share, kLook).chance > kSeenAtAll) continue;
    SearchedLine here = search(looks, middle, share);
    here.chance *= static_cast<double>(stretches.size());
    if (!here.values.empty() && (best.values.empty() || here.chance < best.chance)) best = std::move(here);
  }
  return best;
}

// Adds the line about `nominal` where it is one of the supply; whether it was added.
bool find_line(ChannelStudy& s, Looks& looks, double nominal, int multiple, VibrationCode code,
               bool off_supply = false) {
  const SearchedLine found =
      off_supply ? search_off_supply(s, looks, nominal) : search(looks, nominal, kMainsTolerance);
  if (found.values.empty()) return false;
  VibrationFinding f;
  f.code = code;
  f.nominal = nominal;
  f.off_supply = off_supply;
  f.size = ChannelStudy::mean_amplitude(found.values);
  f.chance = found.chance * static_cast<double>(s.options.mains.size());
  f.frequency = found.line.frequency;
  f.causes = off_supply      ? std::vector{Cause::other_machine, Cause::pickup, Cause::electric}
             : multiple == 1 ? std::vector{Cause::pickup, Cause::electric, Cause::other_machine}
                             : std::vector{Cause::electric, Cause::pickup, Cause::other_machine};
  if (!s.runs() && is_sideband(looks.blocks, found, s.options.mains)) return false;
  if (!s.add(std::move(f))) return false;
  s.electric.push_back(found.line);
  return true;
}

}  // namespace

void find_electric(ChannelStudy& s) {
  const std::vector<LineBlock> blocks = blocks_of(s.channel, order_lines(), kLongBlock, kSteadyBlock);
  for (const LineBlock& b : blocks) {
    for (const Line& l : order_lines()) {
      const LineValue v = b.fitted(l);
      if (v.share >= kLeastShare) s.largest = std::max(s.largest, v.amplitude());
    }
  }
  Looks looks(blocks);
  for (const double mains : s.options.mains) {
    for (const auto& [multiple, code] :
         {std::pair{1, VibrationCode::line_frequency}, std::pair{2, VibrationCode::twice_line_frequency}}) {
      if (find_line(s, looks, multiple * mains, multiple, code)) continue;
      if (find_line(s, looks, multiple * mains, multiple, code, true)) continue;
      // An angle taken from the vibration follows the beat of 1X with a line beside it, which has a mirror then.
      const double line = multiple * mains;
      const auto beats = [&, line](const LineBlock& b) { return std::abs(line / b.turning() - 1) < kFollowedBeat; };
      if (!s.phase && std::ranges::any_of(blocks, beats)) s.unjudged(code, UnjudgedReason::line_beside_1x);
    }
  }
  std::vector<Line> lines = order_lines();
  lines.insert(lines.end(), s.electric.begin(), s.electric.end());
  s.blocks = s.electric.empty() ? blocks : blocks_of(s.channel, lines, kLongBlock, kSteadyBlock);
}

}  // namespace whirl::diagnosis::detail
