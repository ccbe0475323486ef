// Rotors with many effects at once (testing/systems/many_effects.hpp). Found: terms named of those that the machine
// has. Confidently wrong: status ok, and a parameter more than 3 stated standard deviations and 1 % from the truth.
// Usage: bench_identify_many [seeds = 12] [first seed = 1] [SNR dB = 70]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "whirl/identify/identify.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/testing/systems/many_effects.hpp"

using namespace whirl;

namespace {

bool has(const IdentifiedModel& model, std::string_view label) {
  if (label == "anisotropic stiffness") return model.parameter("k1_conj_re") != nullptr;
  const auto& all = identification::term_catalogue();
  const auto entry = std::ranges::find(all, label, &identification::TermEntry::label);
  return entry != all.end() && std::ranges::any_of((*entry)->parameters, [&](const auto& q) {
           return model.parameter(std::string(q.name)) != nullptr;
         });
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 12, first = argc > 2 ? std::atoi(argv[2]) : 1;
  const double snr = argc > 3 ? std::atof(argv[3]) : 70;
  for (std::size_t more = 1; more <= 4; ++more) {
    int causes = 0, named = 0, all = 0, trusted = 0, ok = 0, wrong = 0, covered = 0;
    double slowest = 0, worst = 0;
    for (int seed = first; seed < first + seeds; ++seed) {
      const testing::ManyEffects truth = testing::many_effects(static_cast<unsigned long long>(seed), more);
      const testing::Machine& m = truth.drawn.machine;
      const Recording record = testing::machine_record(truth.drawn, snr, static_cast<unsigned long long>(seed));
      identification::IdentifyOptions options;
      options.method = identification::Method::weak;
      const std::clock_t begin = std::clock();
      const identification::Identification found = identification::identify({record}, options);
      slowest = std::max(slowest, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
      int here = 0;
      for (const std::string_view cause : truth.causes) {
        const std::size_t bar = cause.find('|');
        here += has(found.model, cause.substr(0, bar)) ||
                (bar != std::string_view::npos && has(found.model, cause.substr(bar + 1)));
      }
      causes += static_cast<int>(truth.causes.size()), named += here;
      all += here == static_cast<int>(truth.causes.size());
      const bool sure = found.summary.status == Status::ok;
      ok += sure;
      trusted += found.summary.status != Status::unusable && found.summary.distrust() == nullptr;
      worst = std::max(worst, found.summary.chi_square);
      bool off = false;
      for (const auto& [name, value] :
           {std::pair("k1", m.k), std::pair("k2", m.cubic), std::pair("c", m.c), std::pair("e", m.e)}) {
        const Estimate* e = found.model.parameter(name);
        if (e == nullptr) continue;
        const double sds = std::abs(e->value - value) / e->sd;
        covered += sds <= 2;
        off |= sds > 3 && std::abs(e->value / value - 1) > 0.01;
      }
      wrong += sure && off;
    }
    fmt::print("| {} effects, {:g} dB | {} of {} | {} of {} | {} | {} | {} | {} of {} | {:.3g} | {:.1f} |\n", 5 + more,
               snr, named, causes, all, seeds, trusted, ok, wrong, covered, 4 * seeds, worst, slowest);
    std::fflush(stdout);
  }
}
