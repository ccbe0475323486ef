// Ticks that never arrive, over real wires: `whirl rig serve` and `whirl run --io` in lockstep, so that a loaded
// machine changes nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "served.hpp"
#include "whirl/rt/recorder.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::testing {
namespace {

constexpr long kGaps[] = {1, 2, 3, 5, 10, 20, 30, 45};
constexpr double kFirst = 1, kEvery = 0.5;  // s

/// One run with every gap; largest force after each, relative to the largest of the 0.35 s before it. The force does
/// not reach the rotor, which goes on as before: what the last command does during a gap of 45 ms is another matter.
std::vector<double> forces_after_gaps(const std::string& estimator, const std::string& policy) {
  const Folder folder;
  io::save(folder / "controller.json", design_of("tsmc", estimator));
  folder.write("rig.toml", "[profile]\nstart_rpm = 900\nend_rpm = 860\nramp_s = 5.0\ndwell_end_s = 0.1\n");
  std::string faults = "[[fault]]\nkind = \"actuator_loss\"\nstart_s = 0\n";
  for (std::size_t i = 0; i < std::size(kGaps); ++i) {
    const double start = kFirst + kEvery * static_cast<double>(i) - 5e-4;
    faults += fmt::format("[[fault]]\nkind = \"gap\"\nstart_s = {:.4f}\nend_s = {:.4f}\n", start,
                          start + 1e-3 * static_cast<double>(kGaps[i]));
  }
  folder.write("faults.toml", faults);
  const Served rig(folder, "--lockstep --added-mass-g 0 --seed 5 --rig rig.toml --faults faults.toml");
  rig.be_patient();
  std::string io = slurp(folder / "io.toml");
  const std::string key = "dt = \"";
  const std::size_t at = io.find(key);
  if (at == std::string::npos) {
    ADD_FAILURE() << io;
    return {};
  }
  folder.write("io.toml", io.replace(at + key.size(), io.find('"', at + key.size()) - at - key.size(), policy));
  const Outcome o = folder.whirl("run controller.json --io io.toml --record run.h5");
  EXPECT_EQ(o.exit_code, 0) << estimator << ", " << policy << ": " << o.err << o.out;
  rig.result();
  const std::vector<rt::LoopSample> cycles = rt::read_loop_record(folder / "run.h5").cycles;
  const auto size = [](const rt::LoopSample& s) { return std::max(std::abs(s.ux), std::abs(s.uy)); };
  std::vector<double> out;
  for (std::size_t k = 400; k < cycles.size(); ++k) {
    if (cycles[k].tick - cycles[k - 1].tick <= 1 || out.size() >= std::size(kGaps)) continue;
    EXPECT_EQ(cycles[k].tick - cycles[k - 1].tick - 1, kGaps[out.size()]) << estimator << ", " << policy;
    double before = 0, after = 0;
    for (std::size_t i = k - 350; i < k; ++i) before = std::max(before, size(cycles[i]));
    for (std::size_t i = k; i < std::min(k + 150, cycles.size()); ++i) after = std::max(after, size(cycles[i]));
    EXPECT_GT(before, 0.5) << "no force to compare with";
    out.push_back(after / before);
  }
  return out;
}

TEST(GapE2e, ForceAfterTicksThatNeverArriveStaysNearTheSteadyOne) {
  double worst = 0;
  for (const char* estimator : {"lpf", "difference", "red", "red_implicit", "kalman", "eso", "kfe", "kfo"}) {
    for (const char* policy : {"fill", "nominal"}) {
      const std::vector<double> ratios = forces_after_gaps(estimator, policy);
      ASSERT_EQ(ratios.size(), std::size(kGaps)) << estimator << ", " << policy;
      for (std::size_t i = 0; i < ratios.size(); ++i) {
        EXPECT_LE(ratios[i], 1.3) << estimator << ", " << policy << ", gap of " << kGaps[i] << " ticks";
        worst = std::max(worst, ratios[i]);
      }
    }
  }
  fmt::print("largest force after a gap over the wires: {:.3f} of that before it\n", worst);
}

}  // namespace
}  // namespace whirl::testing
