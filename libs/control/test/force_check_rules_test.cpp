// The force check on motions that follow its own equation exactly: what is found is what was done to the force.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <vector>

#include "whirl/control/force_check.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;

constexpr double kTick = 1e-3, kOmega = 150;

struct Done {
  double gain = 1;       ///< of the actuators, from `from` on
  long from = 1 << 20;   ///< tick
  long rest = 5;         ///< ticks without force and unbalance before all begins
  Complex eps{1e-4, 0};  ///< true; designed with 1e-4
};
struct Seen {
  ForceFault fault = ForceFault::none;
  std::vector<long> at;  ///< ticks since the rest at which something was found, let go or changed
  Complex eps;
};

/// The second difference of the readings is stiffness, damping, the force that acts and the unbalance.
Seen follow(const Done& done, long ticks = 900) {
  ForceCheckSettings s;
  s.model.k1 = 3600, s.model.c = 6;
  s.eps = 1e-4;
  s.level = 60e-6;
  ForceCheck check(s);
  Seen seen;
  Complex z, before, force, forcing;
  for (long k = -done.rest; k < ticks; ++k) {
    // Half of the unbalance is cancelled, beside a force that turns at another speed.
    const double t = kTick * static_cast<double>(k);
    const Complex asked = k < 0 || check.let_go()
                              ? Complex{}
                              : -0.5e-4 * kOmega * kOmega * std::polar(1.0, kOmega * t) + std::polar(0.6, 37 * t);
    const Complex now = k < 0 ? Complex{} : std::polar(kOmega * kOmega, kOmega * t);
    const ForceFault fault = check.step(z, true, asked, now, false);
    if (fault != ForceFault::none) {
      seen.fault = fault;
      seen.at.push_back(k);
      break;
    }
    if (check.let_go() || check.changed()) seen.at.push_back(k);
    // From here to the next reading.
    const double gain = k >= done.from ? done.gain : 1;
    const Complex next = k + 1 < 0 || check.let_go() ? Complex{} : asked;
    const Complex y = 0.5 * gain * (asked + next) + done.eps * now;
    const double h = kTick, c = s.model.c;
    const Complex after =
        (y + (2.0 * z - before) / (h * h) - s.model.k1 * z + 0.5 * c / h * before) / (1 / (h * h) + 0.5 * c / h);
    before = z, z = after;
  }
  seen.eps = check.eps();
  return seen;
}

TEST(ForceCheckRules, ASoundForceIsNeverDoubtedAndTheUnbalanceIsLearned) {
  Done done;
  done.eps = {0.8e-4, 0.5e-4};
  const Seen seen = follow(done);
  EXPECT_EQ(seen.fault, ForceFault::none);
  EXPECT_LT(std::abs(seen.eps - done.eps), 0.05 * std::abs(done.eps));
}

TEST(ForceCheckRules, AForceThatIsLostOrTurnedIsFoundWithin50Milliseconds) {
  for (const auto& [gain, fault] : {std::pair{0.0, ForceFault::lost}, {-1.0, ForceFault::reversed}}) {
    Done done;
    done.gain = gain, done.from = 500;
    const Seen seen = follow(done);
    EXPECT_EQ(seen.fault, fault) << gain;
    ASSERT_FALSE(seen.at.empty());
    EXPECT_GE(seen.at.front(), 500);
    EXPECT_LE(seen.at.back(), 550);
  }
  Done weak;
  weak.gain = 0.75, weak.from = 500;
  EXPECT_EQ(follow(weak).fault, ForceFault::none);
}

// Its clock begins with the first force, however long the rotor rested before.
TEST(ForceCheckRules, ARestBeforeTheFirstForceIsNoTimeInWhichAnythingWasLearned) {
  for (const double gain : {-1.0, 0.0}) {
    Done soon;
    soon.gain = gain, soon.from = 60;
    Done late = soon;
    late.rest = 700;
    const Seen first = follow(soon), second = follow(late);
    EXPECT_EQ(first.fault, second.fault);
    EXPECT_EQ(first.at, second.at);
    EXPECT_FALSE(first.at.empty());
  }
}

}  // namespace
}  // namespace whirl::control
