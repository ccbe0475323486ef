// Machines that differ from their design (testing/foreign_rig.hpp): cubic and quintic spring, further modes, axes that
// couple, runout, lag, encoder, noise; none of it is known to the re-identification.
// Its numbers were chosen on machines 1 to 110; WHIRL_REIDENTIFIED=200 counts more than these.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <tuple>
#include <vector>

#include "whirl/control/controller.hpp"
#include "whirl/testing/control/foreign_rig.hpp"

namespace whirl::control {
namespace {

std::uint64_t machines(std::uint64_t otherwise) {
  const char* text = std::getenv("WHIRL_REIDENTIFIED");
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// Runs down through the critical speed in 5 s, then dwells 5 % below it for 3 s.
testing::ForeignMachine drawn(std::uint64_t seed) {
  testing::ForeignMachine m = testing::ForeignMachine::draw(seed, 0.1);
  m.gain = 1;
  m.down = 5, m.still = 3;
  m.top = 1.6 * m.critical(), m.bottom = 0.95 * m.critical();
  m.force_limit *= 2;
  return m;
}

ControllerDesign design_for(const testing::ForeignMachine& m, std::uint64_t seed) {
  constexpr std::pair<const char*, const char*> kMethods[] = {{"pd", "lpf"},     {"lqr", "kalman"},
                                                              {"pd", "kalman"},  {"pd_notch", "lpf"},
                                                              {"pid", "kalman"}, {"lqr", "difference"}};
  ControllerDesign d;
  std::tie(d.law, d.estimator) = kMethods[seed % std::size(kMethods)];
  d.model.k1 = 1.01 * m.stiffness / m.mass;
  d.model.k2 = m.cubic / m.mass;
  d.model.c = 1.1 * m.damping / m.mass;
  d.model.gain = 1 / m.mass;
  d.model.eps = std::polar(0.98 * m.unbalance, m.unbalance_angle + 0.02);
  d.sample_time = testing::ForeignRig::kTick;
  d.delay = m.age + m.delay + m.lag;
  d.force_limit = m.force_limit;
  d.parameters = {{"sensor_delay", m.age}, {"supervise", 1}, {"watch_level", 60e-6}};
  if (d.law == "pd") d.parameters["kp"] = 0.1 * d.model.k1, d.parameters["kd"] = 0.3 * m.critical();
  if (d.estimator == "kalman") d.parameters["predict"] = 1;
  d.feedforward = d.law != "pd_notch";
  return d;
}

struct Claims {
  int made = 0, wrong = 0;
  void add(double error, double sd) { ++made, wrong += std::abs(error) > 2 * sd; }
};
struct Course {
  double peak = 0, late = 0;  ///< m; the latter of the last second
  bool trip = false;
  Claims claims[3], sharp;  ///< the last: of the stiffness with an sd below 1 %, wrong by more than 2 %
  std::uint32_t word = 0;
  Reidentification last;
};

Course run(ControllerDesign d, const testing::ForeignMachine& m, std::uint64_t seed, int reidentify) {
  d.parameters["reidentify"] = reidentify;
  Controller controller = make_controller(d);
  testing::ForeignRig rig(m, seed);
  const double truth[] = {m.stiffness / m.mass / d.model.k1 - 1, m.damping / m.mass / d.model.c - 1, m.gain - 1};
  Course out;
  for (; !rig.done(); rig.advance()) {
    const Measurement r = rig.read();
    const auto u = out.trip ? Expected<Command, Fault>(Command{}) : controller.step(r);
    out.trip = out.trip || !u;
    rig.write(u ? *u : Command{});
    const Reidentification& now = controller.state().reidentification;
    out.word |= now.word;
    if (now.estimate != out.last.estimate && (now.word & (kOtherMachine | kReidentifierFrozen)) == 0) {
      for (std::size_t i = 0; i < 3; ++i) {
        if ((now.word & (kStiffnessKnown << i)) != 0) out.claims[i].add(now.estimate[i] - truth[i], now.sd[i]);
      }
      if (now.sd[0] < 0.01) out.sharp.add(now.estimate[0] - truth[0], 0.01);
    }
    out.last = now;
    const double z = std::hypot(rig.x(), rig.y());
    if (r.t > 0.3) out.peak = std::max(out.peak, z);
    if (r.t > m.down + m.still - 1) out.late = std::max(out.late, z);
  }
  return out;
}

struct Count {
  Claims claims[3], sharp;
  std::vector<double> peak, late;  ///< with by without
  int trips = 0, unlike = 0, acting = 0;

  void add(const Course& with, const Course& without) {
    for (std::size_t i = 0; i < 3; ++i) claims[i].made += with.claims[i].made, claims[i].wrong += with.claims[i].wrong;
    sharp.made += with.sharp.made, sharp.wrong += with.sharp.wrong;
    peak.push_back(with.peak / without.peak);
    late.push_back(with.late / without.late);
    trips += with.trip && !without.trip;
    unlike += (with.word & kOtherMachine) != 0;
    acting += with.last.acting != MachineShares{};
  }
  void print(const char* what) {
    std::ranges::sort(peak);
    std::ranges::sort(late);
    fmt::print(
        "{}: {} runs, {} with a correction at the end; claims outside 2 sd: stiffness {} of {} (sd below 1 %: {} of {} "
        "off by 2 %), damping {} of {}, gain {} of {}; peak by that without: median {:.3f}, largest {:.3f}; last "
        "second "
        "{:.3f}, {:.3f}; trips {}; another machine {}\n",
        what, peak.size(), acting, claims[0].wrong, claims[0].made, sharp.wrong, sharp.made, claims[1].wrong,
        claims[1].made, claims[2].wrong, claims[2].made, peak[peak.size() / 2], peak.back(), late[late.size() / 2],
        late.back(), trips, unlike);
    for (const Claims& c : claims) EXPECT_LE(20 * c.wrong, c.made) << what;
    EXPECT_LE(20 * sharp.wrong, sharp.made) << what;
    EXPECT_EQ(trips, 0) << what;
  }
};

TEST(ReidentifierProperty, SofterMachinesWithLessDampingAndForceRunMoreQuietly) {
  Count all, ranges;
  for (std::uint64_t seed = 5001; seed <= 5000 + machines(30); ++seed) {
    const testing::ForeignMachine m = drawn(seed);
    const ControllerDesign d = design_for(m, seed);
    testing::ForeignMachine changed = m;
    changed.stiffness *= 0.85, changed.damping *= 0.6, changed.gain = 0.75;
    changed.bottom *= std::sqrt(0.85);
    all.add(run(d, changed, seed, 2), run(d, changed, seed, 0));
    // Anything within the bounds; more noise, unbalance, cubic spring.
    std::mt19937_64 random(seed);
    const auto in = [&](double low, double high) {
      return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
    };
    changed = m;
    const double k = in(0.8, 1.15);
    changed.stiffness *= k, changed.damping *= in(0.5, 1.5), changed.gain = in(0.7, 1.25);
    changed.bottom *= std::sqrt(k);
    changed.noise *= in(1, 4), changed.unbalance *= in(0.9, 1.1), changed.cubic *= in(0.5, 2);
    ranges.add(run(d, changed, seed, 2), run(d, changed, seed, 0));
  }
  all.print("k1 -15 %, c x 0.6, gain 0.75");
  EXPECT_LE(all.peak.back(), 1.05);
  EXPECT_LE(all.late[all.late.size() / 2], 0.5);
  EXPECT_GE(2 * all.acting, static_cast<int>(all.peak.size()));
  ranges.print("within the bounds");
  EXPECT_LE(ranges.peak.back(), 1.1);
  EXPECT_LE(ranges.late[ranges.late.size() / 2], 1);
}

TEST(ReidentifierProperty, MachinesAsDesignedRunAsBefore) {
  Count all;
  for (std::uint64_t seed = 1001; seed <= 1000 + machines(54); ++seed) {
    const testing::ForeignMachine m = drawn(seed);
    const ControllerDesign d = design_for(m, seed);
    all.add(run(d, m, seed, 2), run(d, m, seed, 0));
  }
  all.print("as designed");
  EXPECT_LE(all.peak.back(), 1.02);
}

TEST(ReidentifierProperty, OtherMachinesAreNotCorrected) {
  for (const auto& [what, change] : std::initializer_list<std::pair<const char*, void (*)(testing::ForeignMachine&)>>{
           {"a resonance at 1.25 of the critical speed",
            [](testing::ForeignMachine& m) {
              m.modes[0] = {1.25 * m.critical() / 6.283, 0.02, 0, 1, 1, 0.3 / m.mass, 0};
            }},
           {"actuators of the wrong sign", [](testing::ForeignMachine& m) { m.gain = -1; }},
           {"actuators without force", [](testing::ForeignMachine& m) { m.gain = 0; }},
           {"actuators of 0.4", [](testing::ForeignMachine& m) { m.gain = 0.4; }}}) {
    Count all;
    for (std::uint64_t seed = 2001; seed <= 2000 + machines(18); ++seed) {
      testing::ForeignMachine m = drawn(seed);
      const ControllerDesign d = design_for(m, seed);
      change(m);
      all.add(run(d, m, seed, 2), run(d, m, seed, 0));
    }
    std::ranges::sort(all.peak);
    fmt::print("{}: {} of {} corrected at the end, {} refused; claims {} {} {}; largest peak {:.3f} of that without\n",
               what, all.acting, all.peak.size(), all.unlike, all.claims[0].made, all.claims[1].made,
               all.claims[2].made, all.peak.back());
    EXPECT_LE(all.peak.back(), 1.02) << what;
    EXPECT_LE(20 * all.acting, static_cast<int>(all.peak.size())) << what;
    EXPECT_EQ(all.trips, 0) << what;
  }
}

// An estimator that finds the unbalance leaves hardly any motion: what little is said is true, too.
TEST(ReidentifierProperty, WhatIsOnlySaidIsTrueToo) {
  Count all;
  for (std::uint64_t seed = 3001; seed <= 3000 + machines(18); ++seed) {
    testing::ForeignMachine m = drawn(seed);
    ControllerDesign d = design_for(m, seed);
    d.estimator = "kfe";
    d.parameters["predict"] = 1;
    m.stiffness *= 0.85, m.damping *= 0.6, m.gain = 0.75;
    const Course said = run(d, m, seed, 1), without = run(d, m, seed, 0);
    EXPECT_EQ(said.peak, without.peak);
    all.add(said, without);
  }
  all.print("with kfe");
}

}  // namespace
}  // namespace whirl::control
