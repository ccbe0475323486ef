// Ambient records through `whirl oma`'s two methods: modes found, false ones, damping, coverage, tones, time.
// Usage: bench_modal_ambient [RECORDS_PER_STRUCTURE] [CASE] [SEED_OFFSET]
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "whirl/modal/oma.hpp"
#include "whirl/testing/ambient.hpp"

namespace {

struct Case {
  const char* name;
  whirl::testing::AmbientOptions options;
};

struct Total {
  int all = 0, matched = 0, extra = 0, frequency = 0, damping = 0, tones = 0, records = 0;
  std::vector<double> errors;  // of the damping, signed
  double seconds = 0;

  void add(const whirl::testing::Ambient& truth, const whirl::modal::OperationalModes& found) {
    ++records;
    all += static_cast<int>(truth.frequency.size());
    tones += static_cast<int>(found.tones.size());
    std::vector<bool> used(found.modes.size());
    for (std::size_t k = 0; k < truth.frequency.size(); ++k) {
      std::size_t best = found.modes.size();
      double distance = 0.006;
      for (std::size_t m = 0; m < found.modes.size(); ++m) {
        const double d = std::abs(found.modes[m].frequency.value / truth.frequency[k] - 1);
        if (used[m] || d >= distance) continue;
        distance = d;
        best = m;
      }
      if (best == found.modes.size()) continue;
      used[best] = true;
      ++matched;
      frequency += found.modes[best].frequency.covers(truth.frequency[k]);
      damping += found.modes[best].damping.covers(truth.damping[k]);
      errors.push_back(found.modes[best].damping.value / truth.damping[k] - 1);
    }
    extra += static_cast<int>(std::count(used.begin(), used.end(), false));
  }
  void print(const char* name, const char* method) {
    const auto median = [](std::vector<double> values) {
      std::nth_element(values.begin(), values.begin() + std::ssize(values) / 2, values.end());
      return 100 * values[values.size() / 2];
    };
    std::vector<double> sizes = errors;
    for (double& e : sizes) e = std::abs(e);
    fmt::print("| {} | {} | {} of {} | {} | {:.1f} %, signed {:+.1f} % | {:.1f} %, {:.1f} % | {} | {:.2f} s |\n", name,
               method, matched, all, extra, median(sizes), median(errors), 100.0 * frequency / matched,
               100.0 * damping / matched, tones, seconds / records);
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int records = argc > 1 ? std::atoi(argv[1]) : 5;
  const char* only = argc > 2 ? argv[2] : "";
  const int offset = argc > 3 ? std::atoi(argv[3]) : 0;
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  fmt::print(
      "| case | method | found | false | median error of the damping | 95 % intervals that hold f, zeta | tones | time "
      "|\n");
  const std::vector<double> frame{0.9, 2.6, 4.1, 5.3, 6.0};
  for (const Case& c : {
           Case{"eight modes, 80 Hz", {}},
           {"eight modes, 400 Hz", {.rate = 400}},
           {"three modes, four channels", {.frequency = {4, 9, 17}, .channels = 4, .tones = {}}},
           {"five modes, 100 Hz, noise 10 %",
            {.frequency = frame,
            .damping_low = 0.02,
            .damping_high = 0.02,
            .channels = 5,
            .rate = 100,
            .tones = {},
            .noise = 0.1}},
           {"five modes, 20 Hz, noise 70 %",
            {.frequency = frame,
            .damping_low = 0.02,
            .damping_high = 0.02,
            .channels = 5,
            .rate = 20,
            .tones = {},
            .noise = 0.7}},
       }) {
    if (std::strstr(c.name, only) == nullptr) continue;
    for (const auto method : {whirl::modal::SubspaceMethod::data, whirl::modal::SubspaceMethod::covariance}) {
      Total total;
      for (unsigned structure = 91; structure <= 94; ++structure) {
        for (int k = 1; k <= records; ++k) {
          whirl::testing::AmbientOptions o = c.options;
          o.structure = structure;
          o.seed = static_cast<unsigned>(offset + k);
          const auto truth = whirl::testing::make_ambient(o);
          whirl::modal::OmaOptions options;
          options.method = method;
          const std::clock_t start = std::clock();
          const auto found = whirl::modal::identify_operational(truth.recording, options);
          total.seconds += static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
          total.add(truth, found);
        }
      }
      total.print(c.name, method == whirl::modal::SubspaceMethod::data ? "SSI-data" : "SSI-cov");
    }
  }
}
