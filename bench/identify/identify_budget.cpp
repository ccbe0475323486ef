// Processor time and a hash of the JSON of identifications of rotor records of every kind of testing/: what 12 s at
// 1 kHz cost, and whether a change of the code moves any result. One line a record; kinds are those of machines.hpp,
// odd_rotors.hpp and machine_parts.hpp.
// Usage: bench_identify_budget [seeds = 1] [first seed = 1] [SNR dB = 40] [kind]
#include <fmt/format.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <string>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/testing/systems/machine_parts.hpp"
#include "whirl/testing/systems/odd_rotors.hpp"

using namespace whirl;

namespace {

using Draw = std::function<Recording(double snr, unsigned long long seed)>;
struct Kind {
  std::string name;
  Draw draw;
};

std::vector<Kind> kinds() {
  std::vector<Kind> all;
  for (const testing::Oddity oddity : testing::kOddities)
    all.push_back({testing::to_string(oddity), [oddity](double snr, unsigned long long seed) {
                     return testing::machine_record(testing::draw_machine(oddity, seed), snr, seed);
                   }});
  for (const auto& [kind, name] : testing::kOddKinds)
    all.push_back({name, [kind](double snr, unsigned long long seed) {
                     const testing::OddRecord odd = testing::odd_record(kind, snr, seed);
                     return odd.pulses ? identification::with_angle_from_pulses(odd.record, "pulse") : odd.record;
                   }});
  for (const testing::PartName& part : testing::kParts)
    all.push_back({part.name, [part](double snr, unsigned long long seed) {
                     return testing::part_record(part.part, snr, seed).record;
                   }});
  return all;
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 1;
  const int first = argc > 2 ? std::atoi(argv[2]) : 1;
  const double snr = argc > 3 ? std::atof(argv[3]) : 40;
  const std::string only = argc > 4 ? argv[4] : "all";
  for (const Kind& kind : kinds()) {
    if (only != "all" && only != kind.name) continue;
    for (int seed = first; seed < first + seeds; ++seed) {
      const Recording record = kind.draw(snr, static_cast<unsigned long long>(seed));
      identification::IdentifyOptions options;
      options.method = identification::Method::weak;
      const std::clock_t begin = std::clock();
      std::string json, status = "refused";
      try {
        const identification::Identification found = identification::identify({record}, options);
        json = identification::to_json(found).dump();
        status = std::string(to_string(found.summary.status));
      } catch (const Error& e) {
        json = e.what();
      }
      const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
      fmt::print("{:26} {:g} dB seed {}: {:6.2f} s {:8} {:016x}\n", kind.name, snr, seed, seconds, status,
                 std::hash<std::string>{}(json));
      std::fflush(stdout);
    }
  }
}
