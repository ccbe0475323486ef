// FRFs of chains with dashpots, damping 5 to 50 %: frequencies against the Cramer-Rao bound, false modes, time.
// Usage: bench_modal_damped [SETS] [SEED_OFFSET]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>

#include "whirl/modal/fit_modes.hpp"
#include "whirl/testing/modal/damped_chain.hpp"

int main(int argc, char** argv) {
  const int sets = argc > 1 ? std::atoi(argv[1]) : 10;
  const int offset = argc > 2 ? std::atoi(argv[2]) : 0;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  fmt::print(
      "| masses | noise | modes within three Cramer-Rao deviations | further modes listed | 95 % intervals that "
      "hold f, zeta | time, slowest |\n");
  for (const auto& [masses, noise] : {std::pair{3, 5e-3}, {5, 1e-3}, {7, 2e-4}, {9, 2e-4}}) {
    int modes = 0, within = 0, matched = 0, listed = 0, frequency = 0, damping = 0;
    double seconds = 0, slowest = 0;
    for (int k = 1; k <= sets; ++k) {
      const auto chain = whirl::testing::make_damped_chain({.masses = masses,
                                                            .responses = std::min(masses, 6),
                                                            .references = 1 + k % 2,
                                                            .noise = noise,
                                                            .lines = k % 3 == 0 ? 400 : 1000,
                                                            .seed = static_cast<unsigned>(offset + k)});
      const std::clock_t start = std::clock();
      const whirl::ModalModel found = whirl::modal::fit_modes(chain.frf);
      const double time = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      seconds += time;
      slowest = std::max(slowest, time);
      modes += static_cast<int>(chain.frequency.size());
      for (const whirl::Mode& mode : found.modes)
        listed += mode.frequency.value >= found.band_low && mode.frequency.value <= found.band_high;
      for (std::size_t m = 0; m < chain.frequency.size() && !found.modes.empty(); ++m) {
        const auto off = [&](const whirl::Mode& mode) { return std::abs(mode.frequency.value - chain.frequency[m]); };
        const whirl::Mode& mode = *std::min_element(found.modes.begin(), found.modes.end(),
                                                    [&](const auto& a, const auto& b) { return off(a) < off(b); });
        within += off(mode) < 3 * chain.deviation[m];
        if (off(mode) > 10 * chain.deviation[m]) continue;
        ++matched;
        frequency += mode.frequency.covers(chain.frequency[m]);
        damping += mode.damping.covers(chain.damping[m]);
      }
    }
    fmt::print("| {} | {:g} % | {} of {} | {} | {:.1f} %, {:.1f} % | {:.2f} s, {:.2f} s |\n", masses, 100 * noise,
               within, modes, listed - modes, 100.0 * frequency / std::max(1, matched),
               100.0 * damping / std::max(1, matched), seconds / sets, slowest);
  }
}
