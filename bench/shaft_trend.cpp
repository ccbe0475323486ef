// False alarms and finds of `whirl rotor trend`, and answers of `whirl rotor which`, on rotors that its library does
// not make (testing/shaft/shaft_rig.hpp), 30 dB, both critical speeds passed.
//     bench_shaft_trend trend|which [ROTORS [FIRST_SEED]]
#include <cstdio>
#include <cstdlib>
#include <string>

#include "whirl/shaft/fit/recognise.hpp"
#include "whirl/shaft/fit/trend.hpp"
#include "whirl/testing/shaft/rotor_population.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;

constexpr int kRuns = 3;
constexpr double kSoftens = 0.02;  // of a bearing, from run to run

/// Three run-ups of a machine; `softens`: part of kx of bearing A that it loses from run to run.
std::vector<shaft::OrderRun> runs_of(const RotorCase& c, unsigned seed, double softens) {
  std::vector<std::string> channels;
  for (const RigProbe& p : c.rig.probes) channels.push_back(p.name);
  std::vector<shaft::OrderRun> runs;
  for (unsigned k = 0; k < kRuns; ++k) {
    ShaftRig rig = c.rig;
    rig.bearings[0].kx *= 1 - softens * k;
    RigRun run;
    run.from = 20;
    run.to = c.top;
    run.duration = 48;
    run.noise_db = 30;
    run.seed = 977 * seed + k + 1;
    const Recording record = ShaftRigModel(rig).run(run);
    runs.push_back(shaft::order_run(record, 0, record["beta"], channels, "run" + std::to_string(k)));
  }
  return runs;
}

struct Tally {
  int tables = 0, rows = 0, false_alarms = 0, tables_with = 0, found = 0, held = 0;

  void add(const shaft::FitTrend& trend, double softens) {
    ++tables;
    bool any = false;
    for (const shaft::TrendRow& row : trend.rows) {
      const bool softened = softens > 0 && row.last.name == "stiffness x of A";
      const double truth = softened ? -softens * (kRuns - 1) : 0;
      ++rows;
      held += row.change.covers(truth);
      if (softened)
        found += row.changed;
      else if (row.changed)
        ++false_alarms, any = true;
    }
    tables_with += any;
  }
  void print(const char* what) const {
    std::printf(
        "%s: %d tables, false alarms in %d (%d of %d rows), softening found in %d, changes in their intervals %.1f "
        "%%\n",
        what, tables, tables_with, false_alarms, rows, found, 100.0 * held / rows);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const std::string question = argc > 1 ? argv[1] : "trend";
  const unsigned rotors = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 20;
  const unsigned first = argc > 3 ? static_cast<unsigned>(std::atoi(argv[3])) : 9001;
  PopulationOptions population;
  population.start_stiffness = 1.3, population.start_damping = 2;
  shaft::FitSetup setup;
  setup.tolerance.probe_gain = 0.05;
  Tally steady, softening;
  int right = 0, other = 0;
  for (unsigned seed = first; seed < first + rotors; ++seed) {
    const RotorCase c = make_rotor_case(seed, population);
    const auto runs = runs_of(c, seed, 0);
    if (question == "trend") {
      steady.add(shaft::fit_trend(c.drawing, setup, runs), 0);
      softening.add(shaft::fit_trend(c.drawing, setup, runs_of(c, seed + 500, kSoftens)), kSoftens);
    } else {
      const RotorCase wrong = make_rotor_case(seed + 1000, population);
      const shaft::RotorRecognition found = shaft::recognise_rotor(
          {{"right", {c.drawing, setup, {}}, runs[0]}, {"other", {wrong.drawing, setup, {}}, runs[0]}}, {});
      right += found.candidates[0].possible();
      other += found.candidates[1].possible();
    }
    std::fprintf(stderr, "%u of %u: %d, %d\n", seed - first + 1, rotors, right, other);
  }
  if (question == "trend") {
    steady.print("nothing changes");
    softening.print("a bearing softens by 2 % a run");
  } else {
    std::printf("%u asked: the right rotor possible in %d, another one in %d\n", rotors, right, other);
  }
}
