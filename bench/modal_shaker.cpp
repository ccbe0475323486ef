// Modes from shaker records of drawn structures: `bench_modal_shaker [SETS] [CASE] [SEED_OFFSET]`.
#include <fmt/format.h>

#include <chrono>
#include <cstdlib>
#include <cstring>
#include <numbers>

#include "../libs/modal/test/synthetic.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/shaker_frf.hpp"
#include "whirl/testing/modal/shaker_records.hpp"

int main(int argc, char** argv) {
  using whirl::testing::ShakerForce;
  const int sets = argc > 1 ? std::atoi(argv[1]) : 10;
  const char* only = argc > 2 ? argv[2] : "";
  const int offset = argc > 3 ? std::atoi(argv[3]) : 0;
  const std::vector<std::pair<const char*, whirl::testing::ShakerTest>> cases = {
      {"random", {}},
      {"random, 10 % noise", {.noise = 0.1}},
      {"random, light damping", {.damping_low = 0.001, .damping_high = 0.005}},
      {"random, four records of 15 s", {.seconds = 15, .records = 4}},
      {"random, 2 % noise of the force too", {.force_noise = 0.02}},
      {"two forces", {.forces = 2}},
      {"three forces, four records", {.forces = 3, .records = 4}},
      {"burst random", {.force = ShakerForce::burst, .seconds = 64}},
      {"sweep", {.force = ShakerForce::sweep}},
      {"periodic random", {.force = ShakerForce::periodic, .seconds = 64}},
      {"periodic random, 10 % noise", {.force = ShakerForce::periodic, .seconds = 64, .noise = 0.1}},
  };
  fmt::print("| case | found | false (sharp) | intervals hold f, zeta | median error f, zeta | s |\n|-|-|-|-|-|-|\n");
  for (const auto& [name, options] : cases) {
    if (std::strstr(name, only) == nullptr) continue;
    int modes = 0, found = 0, extra = 0, sharp = 0, f = 0, zeta = 0;
    double error_f = 0, error_zeta = 0, seconds = 0;
    for (int set = 1; set <= sets; ++set) {
      whirl::testing::ShakerTest o = options;
      o.seed = static_cast<unsigned>(set + offset);
      const auto test = whirl::testing::make_shaker_records(o);
      std::vector<std::complex<double>> truth;
      for (std::size_t i = 0; i < test.frequency.size(); ++i)
        truth.push_back(2 * std::numbers::pi * test.frequency[i] *
                        std::complex<double>(-test.damping[i], std::sqrt(1 - test.damping[i] * test.damping[i])));
      const auto begin = std::chrono::steady_clock::now();
      const whirl::ModalModel model = whirl::modal::fit_modes(whirl::modal::estimate_shaker_frf(test.records));
      seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
      const auto score = whirl::testing::score(truth, model);
      modes += static_cast<int>(truth.size());
      found += score.frequency;
      extra += score.extra;
      sharp += score.sharp_extra;
      f += score.covered_frequency;
      zeta += score.covered_damping;
      error_f += score.median_frequency_error / sets;
      error_zeta += score.median_damping_error / sets;
    }
    fmt::print("| {} | {} of {} | {} ({}) | {:.0f}, {:.0f} % | {:.4f}, {:.3f} % | {:.2f} |\n", name, found, modes,
               extra, sharp, 100.0 * f / std::max(1, found), 100.0 * zeta / std::max(1, found), 100 * error_f,
               100 * error_zeta, seconds / sets);
    std::fflush(stdout);
  }
}
