// Machines drawn at random with what data sheets of amplifiers and sensors state (testing/control/limited_machine.hpp):
// sound actuators are not blamed, lost and reversed ones are found.
// WHIRL_LIMITED_MACHINES=40 WHIRL_LIMITED_RUNS=40 count more of them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <utility>

#include "limited_designs.hpp"
#include "whirl/control/controller.hpp"

namespace whirl::tuning {
namespace {

constexpr std::uint32_t kBlamed = control::kForceLost | control::kForceReversed | control::kForceLate;

std::uint64_t setting(const char* variable, std::uint64_t otherwise) {
  const char* text = std::getenv(variable);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

/// The design of a machine; none where it is not certified or lets the second mode ring on the machine it is made for.
std::optional<ControllerDesign> held(std::uint64_t number) {
  constexpr std::pair<const char*, const char*> kMethods[] = {
      {"tsmc", "kfe"},        {"pd", "lpf"},  {"lqr", "eso"},      {"tsmc", "kfe"}, {"mpc", "kfe"},
      {"lsmc", "difference"}, {"pid", "lpf"}, {"pd_notch", "lpf"}, {"sta", "lpf"}};
  const auto& [law, estimator] = kMethods[number % std::size(kMethods)];
  const auto m = testing::LimitedMachine::draw(number);
  ControllerDesign d = designed(m, law, estimator, 8);
  if (d.margins.at("certified") != 1) return std::nullopt;
  ControllerDesign alone = d;
  alone.parameters["supervise"] = 0;
  control::Controller controller = control::make_controller(alone);
  testing::LimitedRig rig(m, number);
  const double w = 2 * std::numbers::pi * m.second_hertz;
  double ringing = 0, force = 0;
  for (; !rig.done(); rig.advance()) {
    const auto u = controller.step(rig.read());
    rig.write(u ? *u : Command{});
    if (rig.time() < 0.5) continue;
    ringing += std::norm(w * w * rig.second());
    force += std::norm(rig.force() / m.mass);
  }
  if (ringing > 0.25 * force) return std::nullopt;
  return d;
}

struct Run {
  double trip = -1;  ///< s; negative: none
  double asked = 0;  ///< smaller of both axes' largest force in the 50 ms before the fault, N
  double peak = 0;   ///< m, after 0.3 s
  std::uint32_t before = 0, word = 0;
};

Run run(const ControllerDesign& d, const testing::LimitedMachine& m, std::uint64_t seed, double end = 1e9) {
  control::Controller controller = control::make_controller(d);
  testing::LimitedRig rig(m, seed);
  Run out;
  double x = 0, y = 0;
  for (; !rig.done() && rig.time() < end; rig.advance()) {
    const auto u = out.trip < 0 ? controller.step(rig.read()) : Expected<Command, Fault>(Command{});
    if (!u) out.trip = rig.time();
    rig.write(u ? *u : Command{});
    out.word |= controller.state().supervision.word;
    if (rig.time() < m.wrong_from) out.before = out.word;
    if (u && rig.time() < m.wrong_from && rig.time() > m.wrong_from - 0.05)
      x = std::max(x, std::abs(u->ux)), y = std::max(y, std::abs(u->uy));
    if (rig.time() > 0.3) out.peak = std::max(out.peak, std::abs(rig.z()));
  }
  out.asked = std::min(x, y);
  return out;
}

struct Count {
  int designs = 0, sound = 0, blamed = 0, tripped = 0, faults = 0, late = 0, missed = 0;
  double slowest = 0;
};

/// Sound runs and faults of one machine; what is wrong is printed.
void count(std::uint64_t number, std::uint64_t runs, Count& all) {
  const std::optional<ControllerDesign> d = held(number);
  if (!d) return;
  ++all.designs;
  fmt::print("machine {} ({}, {}) is held\n", number, d->law, d->estimator);
  const auto m = testing::LimitedMachine::draw(number);
  for (std::uint64_t k = 0; k < runs; ++k) {
    const testing::LimitedMachine off = m.off(1000 * number + k);
    const auto at = [&] { return fmt::format("machine {} ({}, {}), run {}", number, d->law, d->estimator, k); };
    const Run sound = run(*d, off, 77 * number + k);
    ++all.sound;
    all.tripped += sound.trip >= 0;
    if ((sound.word & kBlamed) != 0) {
      ++all.blamed;
      fmt::print("{}: blamed at {:.3f} s: {}\n", at(), sound.trip, control::supervision_text(sound.word));
    }
    testing::LimitedMachine wrong = off;
    wrong.wrong_from = 0.5 + 0.25 * static_cast<double>((7 * k) % 10);
    if (k % 4 == 0) wrong.wrong = 0;
    if (k % 4 == 1) wrong.wrong = -1;
    if (k % 4 == 2) wrong.wrong_y = 0;
    if (k % 4 == 3) wrong.wrong_y = -1;
    const Run fault = run(*d, wrong, 77 * number + k, wrong.wrong_from + 0.4);
    // What the force does not carry, and a loop that does not hold, tell nothing.
    const double seen = 0.7 * d->parameters.at("watch_level") * d->model.k1 / d->model.gain;
    if ((fault.before & control::kUnheld) != 0 || fault.asked < std::max(1.5 * seen, 0.15 * m.force_limit)) continue;
    const double after = fault.trip < 0 ? 1 : fault.trip - wrong.wrong_from;
    ++all.faults;
    all.late += after > 0.05;
    all.missed += after > 0.1;
    all.slowest = std::max(all.slowest, after);
    if (after > 0.05) {
      fmt::print("{}: fault {} at {:.2f} s found after {:.3f} s: {}\n", at(), k % 4, wrong.wrong_from, after,
                 control::supervision_text(fault.word));
    }
  }
}

TEST(LimitedMachinesProperty, SoundActuatorsAreNotBlamedAndLostOrReversedOnesAreFound) {
  const std::uint64_t machines = setting("WHIRL_LIMITED_MACHINES", 3), runs = setting("WHIRL_LIMITED_RUNS", 12);
  const std::uint64_t first = setting("WHIRL_LIMITED_FIRST", 601);
  Count all;
  for (std::uint64_t number = first; number < first + machines; ++number) count(number, runs, all);
  fmt::print(
      "{} designs: {} of {} sound runs blame an actuator, {} trip; {} faults, {} found after 50 ms, {} after 100 ms\n",
      all.designs, all.blamed, all.sound, all.tripped, all.faults, all.late, all.missed);
  EXPECT_GT(all.sound, 0);
  EXPECT_LE(1000 * all.blamed, all.sound);
  EXPECT_GT(all.faults, 0);
  EXPECT_LE(20 * all.late, all.faults);
}

/// Largest motion of a run, m, from `late_from` on; with no design without control.
double largest(const ControllerDesign* d, const testing::LimitedMachine& m, std::uint64_t seed, std::uint32_t& word) {
  std::optional<control::Controller> controller;
  if (d != nullptr) controller.emplace(control::make_controller(*d));
  testing::LimitedRig rig(m, seed);
  bool tripped = d == nullptr;
  double peak = 0;
  for (; !rig.done(); rig.advance()) {
    const auto u = tripped ? Expected<Command, Fault>(Command{}) : controller->step(rig.read());
    tripped = tripped || !u;
    rig.write(u ? *u : Command{});
    if (d != nullptr && !tripped) word |= controller->state().supervision.word;
    if (d == nullptr || rig.time() >= m.late_from) peak = std::max(peak, std::abs(rig.z()));
  }
  return peak;
}

// Ended at once, a late force would leave the rotor ringing, and 1.2 times the motion without control at its next
// critical speed.
TEST(LimitedMachinesProperty, ALateForceFadesSoThatTheRotorStaysBelowTheOpenLoop) {
  int found = 0;
  for (const auto& [law, estimator, number] : {std::tuple{"pid", "lpf", 5001U}, {"lqr", "eso", 5006U}}) {
    const auto m = testing::LimitedMachine::draw(number);
    const ControllerDesign d = designed(m, law, estimator, 8);
    std::uint32_t none = 0;
    const double open = largest(nullptr, m, number, none);
    for (const double from : {0.4, 1.0, 1.8}) {
      testing::LimitedMachine late = m;
      late.late_from = from;
      late.late_by = 8.5e-3;
      std::uint32_t word = 0;
      const double peak = largest(&d, late, 7 * number + 3, word);
      fmt::print("{}, {}, from {:.1f} s: {:.2f} of the open loop: {}\n", law, estimator, from, peak / open,
                 control::supervision_text(word));
      EXPECT_LE(peak, 1.05 * open) << law << " " << from;
      found += (word & control::kForceLate) != 0;
    }
  }
  EXPECT_GE(found, 4);
}

}  // namespace
}  // namespace whirl::tuning
