// Lines that turn with the shaft: 1X, 2X, higher harmonics and half orders.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <span>

#include "findings/channel_study.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::diagnosis::detail {
namespace {

constexpr double kHarmonics[] = {3, 4, 5, 6, 7, 8};
constexpr double kHalves[] = {0.5, 1.5, 2.5, 3.5};
constexpr double kLineTests = 1 + 1 + std::size(kHarmonics) + std::size(kHalves);
constexpr double kSeen = 0.01;            // chance of a block that shows a line alone
constexpr double kToneChance = 1e-3;      // of a line of fixed frequency that explains a block
constexpr double kToneShare = 0.5;        // of the amplitude that it must have
constexpr std::size_t kCompared = 8;      // blocks in which such a line is looked for
constexpr double kApart = 4;              // lines of the spectrum between the order and the fixed frequency there
constexpr double kApartBefore = 2;        // a free vibration has few blocks before the order crosses it
constexpr double kMainsDeviation = 5e-4;  // usual, of the frequency

struct OrderTrack {
  Line line;
  std::vector<LineValue> values;
  Evidence evidence;
  std::size_t top = 0;  // block of the largest amplitude among those that show it
  double size = 0;
};

/// A line of fixed frequency in the blocks beside one.
struct Tone {
  std::vector<double> chances;
  double power = 0;

  void add(const LineValue& value) {
    chances.push_back(value.chance);
    power += std::norm(value.vector);
  }
  bool explains(double amplitude) const {
    return chances.size() >= 2 && fisher(chances) < kToneChance &&
           std::sqrt(power / static_cast<double>(chances.size())) > kToneShare * amplitude;
  }
};

// A line of fixed frequency crosses the order in block `at`: it is there, as large, where the order is elsewhere; or
// before it alone, for the free vibration after a critical speed decays.
bool crossed_by_tone(const std::vector<LineBlock>& blocks, std::size_t at, const Line& order, double amplitude) {
  const double frequency = order.order * blocks[at].turning();
  Tone beside, earlier;
  for (std::size_t distance = 1; distance < blocks.size() && beside.chances.size() < kCompared; ++distance) {
    for (const bool before : {true, false}) {
      if (before ? distance > at : at + distance >= blocks.size()) continue;
      const LineBlock& b = blocks[before ? at - distance : at + distance];
      const double apart = std::abs(b.bin_of(order) - b.bin_of({0, frequency}));
      if (apart < (before ? kApartBefore : kApart)) continue;
      const LineValue value = b.added({0, frequency});
      if (!(value.share >= kLeastShare)) continue;
      if (before) earlier.add(value);
      if (apart >= kApart) beside.add(value);
    }
  }
  return beside.explains(amplitude) || earlier.explains(amplitude);
}

OrderTrack track(const ChannelStudy& s, double order) {
  OrderTrack t{{order, 0}, {}, {}};
  std::vector<double> chances;
  for (std::size_t k = 0; k < s.blocks.size(); ++k) {
    t.values.push_back(s.blocks[k].fitted(t.line));
    LineValue& v = t.values.back();
    if (v.chance < kSeen && s.runs() && order != 1 && crossed_by_tone(s.blocks, k, t.line, v.amplitude())) v.chance = 1;
    chances.push_back(v.share >= kLeastShare ? v.chance : 1);
  }
  t.evidence = evidence_of(chances);
  for (const std::size_t k : t.evidence.seen) {
    if (t.values[k].amplitude() > t.size) t.size = t.values[k].amplitude(), t.top = k;
  }
  if (!s.runs() && !t.values.empty()) t.size = ChannelStudy::mean_amplitude(t.values);
  return t;
}

// Every block that shows the order has an electric frequency within what the block tells apart.
bool looks_electric(const ChannelStudy& s, const OrderTrack& t) {
  return !t.evidence.seen.empty() && std::ranges::all_of(t.evidence.seen, [&](std::size_t k) {
    const LineBlock& b = s.blocks[k];
    const double frequency = t.line.order * b.turning();
    return std::ranges::any_of(s.options.mains, [&](double mains) {
      return std::ranges::any_of(std::array{1.0, 2.0}, [&](double multiple) {
        return std::abs(frequency - multiple * mains) < 1.5 / b.duration() + kMainsDeviation * frequency;
      });
    });
  });
}

VibrationFinding finding_of(const ChannelStudy& s, const OrderTrack& t, VibrationCode code, std::vector<Cause> causes) {
  VibrationFinding f;
  f.code = code;
  f.size = t.size;
  f.chance = t.evidence.chance * kLineTests;
  f.order = t.line.order;
  f.causes = std::move(causes);
  if (t.values.empty()) return f;
  const LineBlock& at = s.blocks[t.top];
  f.speed = at.speed();
  for (const std::size_t k : t.evidence.seen) {
    f.low_speed = std::fmin(f.low_speed, s.blocks[k].speed());
    f.high_speed = std::fmax(f.high_speed, s.blocks[k].speed());
  }
  const LineValue first = at.fitted({1, 0});
  if (first.share >= kLeastShare && first.amplitude() > 0) f.ratio = t.values[t.top].amplitude() / first.amplitude();
  f.ambiguous = t.line.order != 1 && s.electric.empty() && looks_electric(s, t);
  if (f.ambiguous) f.causes.push_back(Cause::electric);
  return f;
}

// Several orders as one finding: the largest of those that count.
void add_group(ChannelStudy& s, VibrationCode code, std::span<const double> orders, const std::vector<Cause>& causes) {
  std::optional<VibrationFinding> largest;
  std::vector<double> seen;
  for (const double order : orders) {
    if (order == 0.5 && s.whirl) continue;
    const OrderTrack t = track(s, order);
    VibrationFinding f = finding_of(s, t, code, causes);
    if (!(f.chance * s.tests < s.options.chance) || f.size < kLeastLine * s.largest || 2 * f.size < s.channel.quantum)
      continue;
    seen.push_back(order);
    if (!largest || f.size > largest->size) largest = std::move(f);
  }
  if (!largest) return;
  largest->orders = std::move(seen);
  s.add(*std::move(largest));
}

}  // namespace

std::vector<Line> order_lines(bool with_half) {
  std::vector<Line> out{{1, 0}, {2, 0}};
  for (const double order : kHarmonics) out.push_back({order, 0});
  for (const double order : kHalves)
    if (with_half || order != 0.5) out.push_back({order, 0});
  return out;
}

void find_orders(ChannelStudy& s) {
  s.add(finding_of(s, track(s, 1), VibrationCode::first_order, {Cause::unbalance, Cause::bent_shaft}));
  s.add(finding_of(s, track(s, 2), VibrationCode::second_order,
                   {Cause::misalignment, Cause::unequal_stiffness, Cause::looseness}));
  add_group(s, VibrationCode::harmonics, kHarmonics, {Cause::looseness, Cause::rub, Cause::misalignment});
  add_group(s, VibrationCode::half_orders, kHalves, {Cause::looseness, Cause::rub});
}

}  // namespace whirl::diagnosis::detail
