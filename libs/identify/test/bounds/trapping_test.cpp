#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/identify_json.hpp"
#include "whirl/testing/systems/quadratic_flows.hpp"

namespace whirl::identification {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;
using whirl::testing::Flow3;
using whirl::testing::Point3;

IdentifyOptions trapping_options() {
  IdentifyOptions o;
  o.method = Method::sindy;
  o.holdout = 0;
  o.bounds.trapping = true;
  return o;
}

std::string reported(const IdentifiedModel& m) {
  std::string all;
  for (const std::string& w : m.summary.warnings) all += w + "; ";
  return all;
}

/// The identified model as a flow that is integrated apart from the library.
Flow3 flow_of(const IdentifiedModel& m) {
  auto compiled = std::make_shared<CompiledModel>(m);
  return [compiled](const Point3& p) {
    Point3 rate;
    compiled->rate(p.data(), rate.data());
    return rate;
  };
}

struct Spread {
  Point3 mean{}, sd{};
};
Spread spread_of(const Flow3& flow, Point3 p, double h, int steps) {
  Spread s;
  Point3 squares{};
  for (int i = 0; i < steps; ++i) {
    p = whirl::testing::stepped(flow, p, h);
    for (std::size_t k = 0; k < 3; ++k) {
      s.mean[k] += p[k] / steps;
      squares[k] += p[k] * p[k] / steps;
    }
  }
  for (std::size_t k = 0; k < 3; ++k) s.sd[k] = std::sqrt(squares[k] - s.mean[k] * s.mean[k]);
  return s;
}

/// From 100 starts at up to `far` radii the energy ends inside the certified ball.
void expect_trapped(const Identification& id, std::uint64_t seed, double far, double h, int steps) {
  ASSERT_TRUE(id.evidence.trapping);
  const Trapping& t = *id.evidence.trapping;
  EXPECT_LT(t.eigenvalue, 0);
  const Flow3 flow = flow_of(id.model);
  const auto distance = [&](const Point3& p) {
    double sum = 0;
    for (std::size_t k = 0; k < 3; ++k) sum += t.weights[k] * (p[k] - t.shift[k]) * (p[k] - t.shift[k]);
    return std::sqrt(sum);
  };
  std::mt19937_64 draw(seed);
  std::normal_distribution<double> normal;
  for (int run = 0; run < 100; ++run) {
    Point3 p, u{normal(draw), normal(draw), normal(draw)};
    const double norm = std::hypot(u[0], u[1], u[2]);
    for (std::size_t k = 0; k < 3; ++k)
      p[k] = t.shift[k] + far * t.radius * (run + 1) / 100 * u[k] / norm / std::sqrt(t.weights[k]);
    for (int i = 0; i < steps; ++i) p = whirl::testing::stepped(flow, p, h);
    ASSERT_LE(distance(p), 1.01 * t.radius) << run;
  }
}

TEST(TrappingProperty, ConvectionIsTrappedAndItsAttractorIsThatOfTheMachine) {
  for (const std::uint64_t seed : {501, 502, 503}) {
    SCOPED_TRACE(seed);
    const Flow3 truth = whirl::testing::convection(seed);
    const Recording r = whirl::testing::flow_record(truth, {-8, 7, 27}, 0.005, 4000, 0.02, seed);
    const Identification id = identify(r, trapping_options());
    EXPECT_TRUE(id.usable());
    EXPECT_THAT(reported(id.model), Not(HasSubstr("trapping")));
    expect_trapped(id, seed, 5, 0.0005, 8000);
    const Spread mine = spread_of(flow_of(id.model), {1, 1, 20}, 0.005, 100000),
                 true_spread = spread_of(truth, {1, 1, 20}, 0.005, 100000);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(mine.sd[k], true_spread.sd[k], 0.05 * true_spread.sd[k]) << k;
      EXPECT_NEAR(mine.mean[k], true_spread.mean[k], 0.15 * true_spread.sd[k]) << k;
    }
  }
}

// Also where the states' units are unlike, so that the energy preserved has other weights.
TEST(TrappingProperty, WakesAreTrappedInTheirOwnEnergy) {
  for (const double unlike : {1.0, 20.0, 0.05}) {
    for (const std::uint64_t seed : {511, 512}) {
      SCOPED_TRACE(::testing::Message() << unlike << ' ' << seed);
      const Flow3 truth = whirl::testing::wake(seed, unlike);
      const Recording r = whirl::testing::flow_record(truth, {0.02, 0, 0}, 0.1, 1500, 0.01, seed);
      const Identification id = identify(r, trapping_options());
      EXPECT_TRUE(id.usable()) << reported(id.model);
      EXPECT_THAT(reported(id.model), Not(HasSubstr("against a trapping")));
      expect_trapped(id, seed, 3, 0.005, 10000);
      const Spread mine = spread_of(flow_of(id.model), {0.3, 0, 0.1}, 0.02, 20000),
                   true_spread = spread_of(truth, {0.3, 0, 0.1}, 0.02, 20000);
      EXPECT_NEAR(mine.sd[0], true_spread.sd[0], 0.02 * true_spread.sd[0]);
    }
  }
}

TEST(TrappingProperty, WhatRunsAwayIsRefusedOrNotTrusted) {
  for (const std::uint64_t seed : {521, 522, 523}) {
    SCOPED_TRACE(seed);
    const Recording r =
        whirl::testing::flow_record(whirl::testing::runaway(seed), {0.9, 1.5, 0.5}, 0.01, 800, 0.002, seed);
    std::string why;
    try {
      const Identification id = identify(r, trapping_options());
      if (id.summary.status != Status::ok) why = reported(id.model);
    } catch (const Error& e) {
      why = e.what();
    }
    EXPECT_THAT(why, HasSubstr("trapping model"));
  }
}

TEST(Trapping, WhatIsNotQuadraticIsNamed) {
  const Recording r = whirl::testing::flow_record(whirl::testing::convection(531), {-8, 7, 27}, 0.01, 500, 0, 531);
  const auto refusal = [&](const std::function<void(IdentifyOptions&)>& change) {
    IdentifyOptions o = trapping_options();
    change(o);
    try {
      identify(r, o);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_THAT(refusal([](IdentifyOptions& o) { o.sindy.library = {"x", "x^3"}; }), HasSubstr("x^3"));
  EXPECT_THAT(refusal([](IdentifyOptions& o) { o.sindy.library = {"x", "sin(y)"}; }), HasSubstr("sin(y)"));
  EXPECT_THAT(refusal([](IdentifyOptions& o) { o.sindy.inputs = {"z"}; }), HasSubstr("without inputs"));
  EXPECT_THAT(refusal([](IdentifyOptions& o) { o.bounds.least_decay = 0; }), HasSubstr("exclude"));
  EXPECT_THAT(refusal([](IdentifyOptions& o) { o.sindy.discrete = true; }), HasSubstr("differential equations"));
}

}  // namespace
}  // namespace whirl::identification
