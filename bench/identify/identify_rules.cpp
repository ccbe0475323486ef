// False alarms of the rules of libs/identify/src/rules/rules.hpp over machines drawn with a seed: of rotors that are
// exactly the plain model, and of machines with a part that the list of terms has (does a rule of sizes distrust a part
// of its usual size?). One line an alarm: how many of the machines raise it.
// Usage: bench_identify_rules [machines of each kind = 100] [first seed = 60001] [SNR dB = 20]
//        [plain | oddities | parts | field]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/testing/machines.hpp"
#include "whirl/testing/systems/field_rotors.hpp"
#include "whirl/testing/systems/machine_parts.hpp"

using namespace whirl;

namespace {

using Draw = std::function<Recording(double snr, unsigned long long seed)>;

std::vector<Draw> population(const std::string& name) {
  std::vector<Draw> all;
  const auto odd = [](testing::Oddity oddity) {
    return [oddity](double snr, unsigned long long seed) {
      return testing::machine_record(testing::draw_machine(oddity, seed), snr, seed);
    };
  };
  if (name == "plain") all.emplace_back(odd(testing::Oddity::none));
  if (name == "oddities") {
    for (const testing::Oddity oddity : testing::kOddities)
      if (oddity != testing::Oddity::none && oddity != testing::Oddity::tilt) all.emplace_back(odd(oddity));
  }
  if (name == "parts") {
    for (const testing::PartName& part : testing::kParts)
      all.emplace_back(
          [part](double snr, unsigned long long seed) { return testing::part_record(part.part, snr, seed).record; });
  }
  if (name == "field") {
    for (const testing::FieldName& kind : testing::field_kinds())
      if (!kind.causes.empty())
        all.emplace_back([&kind](double snr, unsigned long long seed) {
          return testing::field_record(kind.kind, snr, seed).record;
        });
  }
  return all;
}

void count(const identification::Identification& found, std::map<std::string, int>& alarms) {
  const Summary& summary = found.summary;
  for (const double limit : {1.3, 2.0, 4.0})
    if (summary.chi_square > limit) ++alarms[fmt::format("chi-square above {:g}", limit)];
  if (summary.status == Status::unusable) ++alarms["unusable"];
  if (summary.status == Status::warning) ++alarms["a warning"];
  if (!summary.trust.starts_with("Trust")) ++alarms["no trust"];
  for (const Finding& f : summary.findings) ++alarms["finding " + std::string(to_string(f.code))];
  bool any = false;
  for (const identification::TermEntry* entry : identification::term_catalogue()) {
    const auto in_model = [&](const identification::TermParameter& q) {
      return found.model.parameter(std::string(q.name)) != nullptr;
    };
    if (!std::ranges::any_of(entry->parameters, in_model)) continue;
    any = true;
    ++alarms["term " + std::string(entry->label)];
  }
  if (any) ++alarms["a term beyond the plain rotor"];
  bool other = false;
  for (const Ambiguity& a : found.model.ambiguities) {
    // Stated of any record too weak to exclude the term, and of any orbit that is a circle.
    if (a.readings.starts_with("without or with "))
      ++alarms["open: " + a.readings.substr(16, a.readings.find(':') - 16)];
    else
      other = other || !a.readings.starts_with("a radial cubic spring");
  }
  if (other) ++alarms["another reading"];
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
  const int first = argc > 2 ? std::atoi(argv[2]) : 60001;
  const double snr = argc > 3 ? std::atof(argv[3]) : 20;
  const std::string name = argc > 4 ? argv[4] : "plain";
  std::map<std::string, int> alarms;
  int machines = 0, refused = 0;
  for (const Draw& draw : population(name)) {
    for (int seed = first; seed < first + seeds; ++seed) {
      ++machines;
      try {
        identification::IdentifyOptions options;
        options.method = identification::Method::weak;
        count(identification::identify({draw(snr, static_cast<unsigned long long>(seed))}, options), alarms);
      } catch (const Error&) {
        ++refused;
      }
    }
  }
  fmt::print("{}, {:g} dB, {} machines, {} refused\n", name, snr, machines, refused);
  for (const auto& [alarm, times] : alarms) fmt::print("  {:48} {:4}\n", alarm, times);
}
