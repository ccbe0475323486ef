// Rules of the supervisor, one by one, on a rotor that is stepped here.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>

#include "whirl/control/supervisor.hpp"

namespace whirl::control {
namespace {

using Complex = std::complex<double>;

constexpr double kRuleStep = 1e-3;
constexpr Complex kTurning{0, 1};

SupervisorSettings rotor_settings() {
  SupervisorSettings s;
  s.model.k1 = 3600;  // 60 rad/s
  s.model.c = 6;      // a twentieth of critical damping
  s.eps = 1e-4;
  s.sample_time = kRuleStep;
  s.level = 4e-6;
  return s;
}

/// Steady whirl at a held speed: the unbalance of the model and a control acceleration that turns with it, `part` of
/// the unbalance's.
Supervision whirl_with(const SupervisorSettings& s, double omega, double part, double seconds) {
  Supervisor supervisor(s);
  const Complex force = s.eps * omega * omega, stiffness(s.model.k1 - omega * omega, s.model.c * omega);
  Supervision out;
  for (int k = 0; k < seconds / kRuleStep; ++k) {
    const double angle = omega * kRuleStep * k;
    const Complex turn = std::exp(kTurning * angle), before = std::exp(kTurning * (angle - 0.5 * omega * kRuleStep));
    SupervisorInput in;
    in.omega = omega;
    in.turn = turn;
    in.forcing = unbalance_per_metre(turn, omega, 0);
    in.d = s.eps * in.forcing;
    in.z = (1 + part) * force / stiffness * turn;
    in.a = part * force * before;
    out = supervisor.step(in);
  }
  return out;
}

// The motion is 1 + part times that without control: from 1.1 times and a quarter of the level it is the controller's.
TEST(SupervisorReference, MotionIsComparedWithTheModelWithoutControl) {
  const SupervisorSettings s = rotor_settings();
  for (const double omega : {45.0, 58.0, 63.0, 90.0}) {
    const double open = std::abs(s.eps * omega * omega / Complex(s.model.k1 - omega * omega, s.model.c * omega));
    const double limit = 0.1 + 0.25 * s.level / open;
    EXPECT_EQ(whirl_with(s, omega, 0.8 * limit, 0.5).word & kWorseThanOpen, 0u) << omega;
    EXPECT_NE(whirl_with(s, omega, 1.2 * limit, 0.5).word & kWorseThanOpen, 0u) << omega;
  }
}

TEST(SupervisorReference, ALawAdaptsOnlyWhileItsForceActsAndItsReadingsCome) {
  Supervisor supervisor(rotor_settings());
  SupervisorInput in;
  in.turn = 1;
  EXPECT_TRUE(supervisor.step(in).adapt);
  in.saturated = true;
  Supervision out;
  for (int k = 0; k < 60; ++k) out = supervisor.step(in);
  EXPECT_NE(out.word & kSaturation, 0u);
  EXPECT_FALSE(out.adapt);
  in.saturated = false;
  for (int k = 0; k < 200; ++k) out = supervisor.step(in);
  EXPECT_TRUE(out.adapt);
  in.held = 3;
  EXPECT_FALSE(supervisor.step(in).adapt);
}

/// Motion that does not turn with the rotor and grows; from `full_from` on the force is at its limit.
struct Growth {
  double lowered = -1, off = -1;  // s
};
Growth growing(double full_from) {
  SupervisorSettings s = rotor_settings();
  s.level = 100e-6;
  Supervisor supervisor(s);
  Growth g;
  for (int k = 0; k < 1000; ++k) {
    const double t = kRuleStep * k;
    SupervisorInput in;
    in.turn = std::exp(kTurning * (100 * t));
    in.omega = 100;
    in.z = 400e-6 * std::exp(t) * std::cos(60 * t);
    in.saturated = g.lowered >= 0 && t > g.lowered + full_from;
    const std::uint32_t word = supervisor.step(in).word;
    if (g.lowered < 0 && (word & kGainLowered) != 0) g.lowered = t;
    if (g.off < 0 && (word & kFeedbackOff) != 0) g.off = t;
  }
  return g;
}

// Growth takes a quarter of the gain first. A force at its limit then opens the loop without waiting for more growth.
TEST(SupervisorReference, AtItsLimitTheForceIsTakenOffAtOnce) {
  const Growth patient = growing(10), full = growing(0);
  ASSERT_GE(patient.lowered, 0);
  ASSERT_GE(full.off, 0);
  EXPECT_GT(patient.off - patient.lowered, 0.1);
  EXPECT_LT(full.off - full.lowered, 0.05);
}

}  // namespace
}  // namespace whirl::control
