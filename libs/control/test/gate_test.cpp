// The plausibility gate alone; the numbers are sums of powers of two, so that bounds are met exactly.
#include "whirl/control/gate.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace whirl::control {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN(), kInfinity = std::numeric_limits<double>::infinity();

Measurement at(double x, double y, bool valid = true) {
  Measurement m;
  m.x = x;
  m.y = y;
  m.valid = valid;
  return m;
}
SampleGate gate() {
  SampleGate g;
  g.range = 4;
  g.jump = 0.5;
  return g;
}

TEST(SampleGate, TheFirstSampleMayLieAnywhereInTheRangeOfEachAxis) {
  for (const Measurement& m : {at(3.5, -3.75), at(-3.75, 3.5), at(0, 0)}) {
    SampleGate g = gate();
    EXPECT_TRUE(g.accept(m));
    EXPECT_EQ(g.good, std::complex<double>(m.x, m.y));
    EXPECT_EQ(g.held, 0);
  }
  for (const Measurement& m : {at(4, 0), at(-4, 0), at(0, 4), at(0, -4), at(9, 9), at(kNaN, 0), at(0, kNaN),
                               at(kInfinity, 0), at(0, -kInfinity), at(0, 0, false)}) {
    SampleGate g = gate();
    EXPECT_FALSE(g.accept(m)) << m.x << " " << m.y;
    EXPECT_EQ(g.good, std::complex<double>());
    EXPECT_EQ(g.held, 1);
  }
}

TEST(SampleGate, AJumpIsHeldAndTheAllowedOneGrowsWithEveryHeldSample) {
  SampleGate g = gate();
  ASSERT_TRUE(g.accept(at(1, 1)));
  EXPECT_TRUE(g.accept(at(1, 1.5))) << "as far as allowed";
  EXPECT_TRUE(g.accept(at(1.5, 1.5)));
  for (int i = 1; i <= 3; ++i) {
    EXPECT_FALSE(g.accept(at(1.5, 3.25))) << "1.75 away, allowed " << 0.5 * i;
    EXPECT_EQ(g.held, i);
    EXPECT_EQ(g.good, std::complex<double>(1.5, 1.5));
  }
  EXPECT_TRUE(g.accept(at(1.5, 3.25))) << "allowed 2";
  EXPECT_EQ(g.held, 0);
  EXPECT_EQ(g.held_total, 3);
  EXPECT_FALSE(g.accept(at(0.75, 3.25)));
  EXPECT_FALSE(g.accept(at(1.5, 3.25, false))) << "in its place, but lost";
  EXPECT_EQ(g.held_total, 5);
  EXPECT_TRUE(g.accept(at(1.5, 3.25)));
}

TEST(SampleGate, AfterAResetTheNextSampleIsTheFirst) {
  SampleGate g = gate();
  EXPECT_TRUE(g.accept(at(3, 3)));
  EXPECT_FALSE(g.accept(at(-3, -3)));
  g.reset();
  EXPECT_EQ(g.good, std::complex<double>());
  EXPECT_EQ(g.held + g.held_total, 0);
  EXPECT_TRUE(g.accept(at(-3, -3)));
}

}  // namespace
}  // namespace whirl::control
