// Ambient records of machines whose speed wanders: modes found, orders taken for modes, damping, tones.
// Usage: bench_modal_wandering [MACHINES] [CASE] [SEED_OFFSET]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "whirl/modal/oma.hpp"
#include "whirl/testing/modal/wandering_machine.hpp"

namespace {

using whirl::testing::WanderingOptions;

struct Total {
  int modes = 0, found = 0, orders = 0, other = 0, tones = 0, false_tones = 0, frequency = 0, damping = 0, machines = 0;
  std::vector<double> deviations;  // of the damping, in its own standard deviations
  double seconds = 0;

  void add(const whirl::testing::WanderingMachine& truth, const whirl::modal::OperationalModes& listed) {
    ++machines;
    const whirl::testing::WanderingScore score = whirl::testing::score(truth, listed);
    modes += static_cast<int>(truth.frequency.size());
    found += score.found;
    orders += score.orders;
    other += score.other;
    tones += static_cast<int>(listed.tones.size());
    false_tones += score.false_tones;
    frequency += score.frequency_covered;
    damping += score.damping_covered;
    deviations.insert(deviations.end(), score.damping_deviations.begin(), score.damping_deviations.end());
  }
  void print(const char* name) {
    double mean = 0;
    for (const double d : deviations) mean += d / static_cast<double>(deviations.size());
    fmt::print("| {} | {} of {} | {} | {} | {} ({} false) | {:.1f} %, {:.1f} % | {:+.2f} | {:.2f} s |\n", name, found,
               modes, orders, other, tones, false_tones, 100.0 * frequency / std::max(1, found),
               100.0 * damping / std::max(1, found), mean, seconds / machines);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int machines = argc > 1 ? std::atoi(argv[1]) : 20;
  const char* only = argc > 2 ? argv[2] : "";
  const int offset = argc > 3 ? std::atoi(argv[3]) : 0;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  fmt::print(
      "| case | modes found | orders listed as modes | other false modes | tones | 95 % intervals that hold f, zeta | "
      "mean "
      "deviation of zeta, sd | time |\n");
  for (const auto& [name, options] : {
           std::pair{"wander 0.05 to 1 %", WanderingOptions{}},
           {"the same with a tacho", {.tacho = true}},
           {"small orders, 5 to 50 % of the rms", {.least_size = 0.05, .most_size = 0.5}},
           {"1X 0.2 % beside a mode, wander 0.05 to 0.2 %", {.most_wander = 2e-3, .beside = 0.002}},
           {"1X 0.2 % beside a mode, steady speed", {.least_wander = 1e-9, .most_wander = 2e-9, .beside = 0.002}},
           {"at rest", {.running = false}},
           {"at rest, damping 0.1 to 0.5 %", {.running = false, .least_damping = 0.001, .most_damping = 0.005}},
       }) {
    if (std::strstr(name, only) == nullptr) continue;
    Total total;
    for (int k = 1; k <= machines; ++k) {
      WanderingOptions o = options;
      o.seed = static_cast<unsigned>(offset + k);
      const auto truth = whirl::testing::make_wandering_machine(o);
      const std::clock_t start = std::clock();
      const auto found = whirl::modal::identify_operational(truth.recording);
      total.seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      total.add(truth, found);
    }
    total.print(name);
  }
}
