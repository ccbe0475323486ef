// General systems whose records hold what one set of coefficients cannot give, and some that do hold one: what identify
// claims of them. Truth: driven oscillators drawn at random.
// Usage: bench_identify_systems [machines = 40] [first seed = 1]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <functional>
#include <string>
#include <vector>

#include "whirl/testing/systems/identified_oscillator.hpp"

using namespace whirl;
using testing::DrivenOscillator;

namespace {

struct Kind {
  std::string name;
  std::function<std::vector<Recording>(DrivenOscillator&, unsigned)> records;
};

std::vector<Kind> kinds() {
  const auto noise = [](unsigned seed) { return seed % 3 == 0 ? 0.05 : seed % 3 == 1 ? 0.02 : 0.002; };
  return {
      {"one machine",
       [&](auto& m, unsigned s) { return std::vector{driven_record(m, {.seed = s, .noise = noise(s)})}; }},
      {"one machine, two records",
       [&](auto& m, unsigned s) {
         return std::vector{driven_record(m, {.seed = s, .noise = noise(s)}),
                            driven_record(m, {.seed = s + 5000, .seconds = 15, .noise = noise(s)})};
       }},
      {"noise AR(1) 0.9",
       [](auto& m, unsigned s) { return std::vector{driven_record(m, {.seed = s, .correlation = 0.9})}; }},
      {"two machines, stiffness 4 % apart",
       [](auto& m, unsigned s) {
         const double factor = s % 2 == 0 ? 1.04 : 0.96;
         return std::vector{driven_record(m, {.seed = s}),
                            driven_record(m, {.seed = s + 5000, .stiffness = [=](double) { return factor; }})};
       }},
      {"stiffness steps by 5 % halfway",
       [](auto& m, unsigned s) {
         return std::vector{driven_record(m, {.seed = s, .stiffness = [](double t) { return 1 + 0.05 * (t > 20); }})};
       }},
      {"stiffness drifts by 5 %",
       [](auto& m, unsigned s) {
         return std::vector{driven_record(m, {.seed = s, .stiffness = [](double t) { return 1 + 0.05 * t / 40; }})};
       }},
      {"v read 0.25 to 0.75 samples late",
       [](auto& m, unsigned s) {
         return std::vector{driven_record(m, {.seed = s, .noise = 0.01, .late = 0.25 * (1 + s % 3)})};
       }},
      {"a force of 10 % that is not measured",
       [&](auto& m, unsigned s) {
         return std::vector{driven_record(m, {.seed = s, .noise = noise(s), .unmeasured = 0.1})};
       }},
      {"x' = v - a x",
       [](auto& m, unsigned s) {
         m.leak = 0.05 * std::sqrt(m.stiffness);
         return std::vector{driven_record(m, {.seed = s, .noise = 0.01})};
       }},
  };
}

}  // namespace

int main(int argc, char** argv) {
  const int machines = argc > 1 ? std::atoi(argv[1]) : 40;
  const auto first = static_cast<unsigned>(argc > 2 ? std::atoi(argv[2]) : 1);
  fmt::print("{:36} {:>4} {:>6} {:>6} {:>7} {:>11} {:>8}\n", "records", "ok", "parts", "late", "extra", "inside 95 %",
             "> 4 sd");
  for (const Kind& kind : kinds()) {
    testing::Tally tally;
    int ok = 0, parts = 0, late = 0;
    for (unsigned seed = first; seed < first + static_cast<unsigned>(machines); ++seed) {
      DrivenOscillator machine = testing::drawn_oscillator(seed);
      const std::vector<Recording> records = kind.records(machine, seed);
      const identification::Identification id = testing::identified_oscillator(records);
      ok += id.summary.status == Status::ok;
      parts += std::ranges::any_of(id.summary.findings,
                                   [](const Finding& f) { return f.code == FindingCode::parts_differ; });
      late += testing::warns_of(id, "channel v is read");
      tally.add(id, machine);
    }
    fmt::print("{:36} {:>4} {:>6} {:>6} {:>7} {:>11.2f} {:>8} of {} (at most {:.1f})\n", kind.name, ok, parts, late,
               tally.extra, static_cast<double>(tally.inside) / tally.all, tally.far, tally.all, tally.worst);
  }
}
