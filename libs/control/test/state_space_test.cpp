#include "whirl/control/laws/state_space.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/control/controller.hpp"
#include "whirl/control/method.hpp"
#include "whirl/core/error.hpp"
#include "whirl/testing/alloc_guard.hpp"
#include "whirl/testing/designs.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::control {
namespace {

ControllerDesign with(const LinearAxis& x, const LinearAxis& y, double gain = 1, double sample_time = 0) {
  ControllerDesign d = testing::design_of("state_space", "lpf");
  for (const auto& [name, value] : linear_parameters(x, y, gain, sample_time)) d.parameters[name] = value;
  return d;
}

TEST(StateSpaceReference, APdWrittenAsStateSpaceIsThePdLaw) {
  ControllerDesign pd = testing::design_of("pd", "lpf");
  pd.parameters["kp"] = 1234, pd.parameters["kd"] = 87;
  LinearAxis x, y;
  const double b = pd.model.gain;
  x.d = {-1234 / b, 0, -87 / b, 0};
  y.d = {0, -1234 / b, 0, -87 / b};
  Controller given = make_controller(pd), own = make_controller(with(x, y, b));
  for (const Measurement& m : testing::run_down_readings()) {
    const auto a = given.step(m), u = own.step(m);
    ASSERT_TRUE(a && u);
    ASSERT_NEAR(u->ux, a->ux, 1e-12 * (1 + std::abs(a->ux)));
    ASSERT_NEAR(u->uy, a->uy, 1e-12 * (1 + std::abs(a->uy)));
  }
}

// A geometric series: q_k = (1 - a^k) / (1 - a) for an input of 1.
TEST(StateSpaceReference, AFilterAnswersAStepAsItsClosedForm) {
  LinearAxis axis;
  axis.order = 1;
  axis.a[0] = 0.9, axis.b[0] = 2, axis.c[0] = 3, axis.d[0] = 5;
  for (int k = 0; k < 50; ++k)
    EXPECT_NEAR(axis.step({1, 0, 0, 0}), 5 + 3 * 2 * (1 - std::pow(0.9, k)) / 0.1, 1e-12) << k;
  axis.reset();
  EXPECT_EQ(axis.step({1, 0, 0, 0}), 5);
}

LinearAxis drawn(std::mt19937_64& random, int order) {
  std::uniform_real_distribution<double> any(-1, 1);
  LinearAxis out;
  out.order = order;
  const auto n = static_cast<std::size_t>(order);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) out.a[i * 12 + j] = 0.9 * any(random) / order;
    for (std::size_t k = 0; k < 4; ++k) out.b[i * 4 + k] = any(random);
    out.c[i] = any(random);
  }
  for (double& d : out.d) d = 100 * any(random);
  return out;
}

TEST(StateSpaceRealtime, TheLargestOrderAllocatesNothing) {
  std::mt19937_64 random(2);
  Controller c = make_controller(with(drawn(random, 12), drawn(random, 12)));
  const auto readings = testing::run_down_readings();
  const testing::AllocationGuard guard;
  for (std::size_t k = 0; k < 200; ++k) ASSERT_TRUE(c.step(readings[k]));
  c.reset();
  EXPECT_EQ(guard.count(), 0U);
}

TEST(StateSpaceUnit, WritesDownAndReadsBackEveryEntry) {
  std::mt19937_64 random(3);
  LinearAxis x = drawn(random, 12), y = drawn(random, 5);
  const ControllerDesign d = with(x, y);
  LinearLaw written = std::get<StateSpace>(law_entry("state_space").make(d, resolve_parameters(d))).linear;
  for (int k = 0; k < 40; ++k) {
    const LinearAxis::Inputs u{1e-4 * k, -1e-4, 0.01, 0.02 * k};
    const std::complex<double> a = written.step({u[0], u[1]}, {u[2], u[3]});
    EXPECT_EQ(a, std::complex<double>(x.step(u), y.step(u)));
  }
}

TEST(StateSpaceUnit, AnUnstableLawIsNamedAndAnotherSampleTimeRefused) {
  LinearAxis axis;
  axis.order = 1;
  axis.a[0] = 1.02, axis.b[0] = 1, axis.c[0] = -1;
  const auto warnings = design_warnings(with(axis, {}));
  ASSERT_EQ(warnings.size(), 1U);
  EXPECT_NE(warnings[0].find("axis x is unstable by itself: its largest pole is 1.02"), std::string::npos);
  axis.a[0] = 1;  // an integrator
  EXPECT_TRUE(design_warnings(with(axis, {})).empty());
  EXPECT_NO_THROW(make_controller(with(axis, {}, 1, 1e-3)));
  const std::string why = testing::error_of([&] { make_controller(with(axis, {}, 1, 2e-3)); });
  EXPECT_NE(why.find("sample_time"), std::string::npos) << why;
  EXPECT_NE(why.find("0.002"), std::string::npos) << why;
}

// What grows beyond all numbers ends the loop with a fault, not with a force.
TEST(StateSpaceUnit, AStateBeyondAllNumbersIsAFault) {
  LinearAxis axis;
  axis.order = 1;
  axis.a[0] = 1e10, axis.b[0] = 1, axis.c[0] = -1;
  Controller c = make_controller(with(axis, {}));
  const auto readings = testing::run_down_readings();
  std::size_t k = 0;
  while (k < 100 && c.step(readings[k])) ++k;
  ASSERT_LT(k, 100U);
  EXPECT_EQ(c.step(readings[k]).error(), Fault::not_finite);
}

}  // namespace
}  // namespace whirl::control
