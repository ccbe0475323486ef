// Findings of a rotor's vibration record against what was put in.
// Usage: bench_diagnosis_findings [RECORDS] [FIRST_SEED] [none: without any fault | blind: without an angle] [-v]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <map>

#include "whirl/diagnosis/vibration_findings.hpp"
#include "whirl/testing/records/vibration_records.hpp"

namespace {

using whirl::diagnosis::VibrationCode;
using whirl::testing::VibrationTruth;

struct Kind {
  VibrationCode code;
  double (*size)(const VibrationTruth&);
  bool (*judged)(const VibrationTruth&) = [](const VibrationTruth&) { return true; };
};
constexpr Kind kKinds[] = {
    {VibrationCode::first_order, [](const VibrationTruth& t) { return t.amplitude > 0 ? 1.0 : 0; }},
    {VibrationCode::second_order, [](const VibrationTruth& t) { return t.second; }},
    {VibrationCode::harmonics, [](const VibrationTruth& t) { return t.loose; }},
    {VibrationCode::half_orders, [](const VibrationTruth& t) { return t.half; }},
    {VibrationCode::subsynchronous, [](const VibrationTruth& t) { return t.whirl; }},
    {VibrationCode::line_frequency, [](const VibrationTruth& t) { return t.line; }},
    {VibrationCode::twice_line_frequency, [](const VibrationTruth& t) { return t.twice; }},
    {VibrationCode::sidebands, [](const VibrationTruth& t) { return t.sideband; },
     [](const VibrationTruth& t) { return !t.runs; }},
    {VibrationCode::phase_scatter, [](const VibrationTruth& t) { return t.wander; },
     [](const VibrationTruth& t) { return !t.runs; }},
    {VibrationCode::run_out, [](const VibrationTruth& t) { return t.run_out; },
     [](const VibrationTruth& t) { return t.runs; }},
};

struct Count {
  int with = 0, found = 0, without = 0, wrong = 0, unjudged = 0;
};

}  // namespace

int main(int argc, char** argv) {
  const unsigned records = argc > 1 ? static_cast<unsigned>(std::atoi(argv[1])) : 200;
  const unsigned first = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 100001;
  const std::string mode = argc > 3 ? argv[3] : "";
  const bool verbose = argc > 4;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  std::map<VibrationCode, Count> counts;
  int any_wrong = 0;
  double seconds = 0, sound = 0;
  for (unsigned seed = first; seed < first + records; ++seed) {
    whirl::testing::vibration_detail::Draw draw{std::mt19937_64(104729ull * seed + 71)};
    VibrationTruth truth = whirl::testing::vibration_detail::draw_truth(draw);
    if (mode == "none")
      truth.second = truth.half = truth.loose = truth.line = truth.twice = truth.sideband = truth.whirl = truth.wander =
          truth.run_out = 0;
    auto record = whirl::testing::make_vibration_record(truth, seed);
    if (mode == "blind")
      std::erase_if(record.recording.channels, [](const whirl::Channel& c) { return c.name != "x"; });
    const std::clock_t start = std::clock();
    const auto found = whirl::diagnosis::find_vibration(record.recording);
    seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    sound += truth.duration;
    bool wrong = false;
    for (const Kind& k : kKinds) {
      if (!k.judged(truth)) continue;
      Count& c = counts[k.code];
      const bool is = k.size(truth) > 0;
      const auto* f = found.find(k.code);
      if (f == nullptr &&
          std::ranges::any_of(found.unjudged, [&](const auto& u) { return !u.code || u.code == k.code; })) {
        ++c.unjudged;
        continue;
      }
      ++(is ? c.with : c.without);
      if (f != nullptr) ++(is ? c.found : c.wrong);
      wrong |= f != nullptr && !is;
      if (verbose && (f != nullptr) != is) {
        fmt::print(
            "seed {} {} {}: size {:.3f} found {:.3f} chance {:.2g} order {:.4f} f {:.3f}; {} {} turning {:.2f} T "
            "{:.1f} mains {} white {:.3f} pink {:.3f} second {:.2f} half {:.2f} loose {:.2f} line {:.2f} twice {:.2f} "
            "side {:.2f}@{:.2f} whirl {:.2f}@{:.3f} wander {:.2f} out {:.2f}\n",
            seed, is ? "MISSED" : "FALSE", to_string(k.code), k.size(truth), f ? f->size / truth.amplitude : 0,
            f ? f->chance : 1, f ? f->order : 0, f ? f->frequency : 0,
            truth.runs ? (truth.down ? "down" : "up") : "steady", truth.encoder ? "encoder" : "key", truth.turning,
            truth.duration, truth.mains, truth.white, truth.pink, truth.second, truth.half, truth.loose, truth.line,
            truth.twice, truth.sideband, truth.modulation, truth.whirl, truth.whirl_order, truth.wander, truth.run_out);
      }
    }
    any_wrong += wrong;
  }
  fmt::print(
      "| finding | with it | found | without it | false | said not judged |\n| --- | --- | --- | --- | --- | --- |\n");
  for (const Kind& k : kKinds) {
    const Count& c = counts[k.code];
    fmt::print("| {} | {} | {:.1f} % | {} | {:.1f} % | {} |\n", to_string(k.code), c.with,
               100.0 * c.found / std::max(1, c.with), c.without, 100.0 * c.wrong / std::max(1, c.without), c.unjudged);
  }
  fmt::print(
      "{} records, seeds {} to {}, {:.0f} s of vibration in {:.1f} s; records with any false finding: {:.1f} %\n",
      records, first, first + records - 1, sound, seconds, 100.0 * any_wrong / records);
}
