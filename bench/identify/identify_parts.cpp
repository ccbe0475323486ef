// Rotors with one part that real machines have beside shaft, damping and unbalance: how often it is named, and what is
// claimed of the rotor. Named: among the terms taken up or the alternatives stated. Confidently wrong: as of
// bench_identify_odd.
// Usage: bench_identify_parts [seeds = 8] [first seed = 1] [SNR dB = 40] [kind] [v: each result]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/testing/systems/machine_parts.hpp"

using namespace whirl;

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 8;
  const int first = argc > 2 ? std::atoi(argv[2]) : 1;
  const double snr = argc > 3 ? std::atof(argv[3]) : 40;
  const std::string only = argc > 4 ? argv[4] : "";
  const bool each = argc > 5;
  fmt::print(
      "| part | found | stated as an alternative | ok | warning | unusable | confidently wrong | intervals hold "
      "| slowest, s |\n| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n");
  for (const testing::PartName& kind : testing::kParts) {
    if (!only.empty() && only != "all" && only != kind.name) continue;
    int found = 0, stated = 0, ok = 0, warning = 0, unusable = 0, wrong = 0, covered = 0, intervals = 0;
    double slowest = 0;
    std::string how;
    for (int seed = first; seed < first + seeds; ++seed) {
      const testing::PartRecord truth = testing::part_record(kind.part, snr, static_cast<unsigned long long>(seed));
      const std::clock_t begin = std::clock();
      const auto r = identification::identify_rotor_detailed(std::vector<Recording>{truth.record});
      const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
      slowest = std::max(slowest, seconds);
      const Status status = r.model.summary.status;
      ++(status == Status::ok ? ok : status == Status::warning ? warning : unusable);
      const bool taken = std::ranges::find(r.added, kind.label) != r.added.end();
      const bool open = std::ranges::any_of(
          r.model.ambiguities, [&](const Ambiguity& a) { return a.readings.find(kind.label) != std::string::npos; });
      found += taken;
      stated += !taken && open;
      bool is_wrong = false;
      std::string errors;
      for (const auto& [name, value] :
           {std::pair("k1", truth.k1), std::pair("k2", truth.k2), std::pair("c", truth.c), std::pair("e", truth.e)}) {
        const Estimate* p = r.model.parameter(name);
        if (p == nullptr || status == Status::unusable) continue;
        const double error = p->value - value, share = std::abs(error / value), sds = std::abs(error) / p->sd;
        ++intervals;
        covered += sds <= 2;
        errors += fmt::format(" {} {:+.3f} % ({:.1f} sd)", name, 100 * error / value, sds);
        is_wrong |= share > (std::string(name) == "k1" ? 0.001 : 0.01) && sds > 4;
      }
      wrong += is_wrong && status == Status::ok;
      if (each) {
        fmt::print("{} chi2 {:.3f} {:.1f} s {}{}:", seed, r.model.summary.chi_square, seconds, to_string(status),
                   errors);
        for (const std::string& a : r.added) fmt::print(" [{}]", a);
        fmt::print("\n");
      }
    }
    fmt::print("| {}, {:g} dB | {} | {} | {} | {} | {} | {} | {} of {} | {:.1f} |\n", kind.name, snr, found, stated, ok,
               warning, unusable, wrong, covered, intervals, slowest);
    std::fflush(stdout);
  }
}
