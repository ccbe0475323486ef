#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/monitor/limit_watch.hpp"
#include "whirl/monitor/reference.hpp"
#include "whirl/monitor/speed_trend.hpp"

namespace whirl::monitor {
namespace {

/// Turns of a shaft with speed w(t), rad/s, from t = 0 to `end`; calls f(t, speed).
template <class Speed, class F>
double turns(double from, double end, Speed&& w, F&& f) {
  double t = from;
  while (t < end) {
    const double speed = w(t);
    t += kTwoPi / speed;
    f(t, speed);
  }
  return t;
}

TEST(MonitorTrend, RunUpIsFoundWithItsRateAndItsPeak) {
  SpeedTrend trend;
  std::vector<SpeedTrend::Run> runs;
  const auto take = [&](double t, double speed) {
    // Largest at 150 rad/s.
    const double amplitude = 1e-3 / (1 + std::pow((speed - 150) / 5, 2));
    if (const auto run = trend.turn(t, speed, {amplitude, 2 * amplitude})) runs.push_back(*run);
  };
  double t = turns(
      0, 3, [](double) { return 100.0; }, take);
  EXPECT_EQ(trend.trend(), Trend::steady);
  const double begin = t;
  t = turns(
      t, begin + 10, [&](double now) { return 100 + 10 * (now - begin); }, take);
  EXPECT_EQ(trend.trend(), Trend::run_up);
  turns(
      t, t + 4, [](double) { return 200.0; }, take);
  EXPECT_EQ(trend.trend(), Trend::steady);
  ASSERT_EQ(runs.size(), 1U);
  EXPECT_EQ(runs[0].trend, Trend::run_up);
  EXPECT_NEAR(runs[0].speed_begin, 100, 5);
  EXPECT_NEAR(runs[0].speed_end, 200, 2);  // one percent
  EXPECT_NEAR(runs[0].rate(), 10, 0.5);
  EXPECT_NEAR(runs[0].largest[1].amplitude, 2e-3, 2e-4);
  EXPECT_NEAR(runs[0].largest[0].speed, 150, 1);
}

TEST(MonitorTrend, RunDownEndsWhenTheShaftStands) {
  SpeedTrend trend;
  turns(
      0, 9, [](double now) { return 100 - 10 * now; },
      [&](double t, double speed) { EXPECT_FALSE(trend.turn(t, speed, {})); });
  EXPECT_EQ(trend.trend(), Trend::run_down);
  EXPECT_FALSE(trend.stopped(10));
  const auto run = trend.stopped(20);
  ASSERT_TRUE(run);
  EXPECT_EQ(run->trend, Trend::run_down);
  EXPECT_LT(run->rate(), -5);
  EXPECT_EQ(name(run->trend), "run-down");
}

TEST(MonitorTrend, RippleIsNoRun) {
  SpeedTrend trend;
  turns(
      0, 30, [](double now) { return 100 + 0.4 * std::sin(4 * now); },
      [&](double t, double speed) {
        EXPECT_FALSE(trend.turn(t, speed, {}));
        EXPECT_EQ(trend.trend(), Trend::steady);
      });
}

TEST(MonitorReference, AmplitudeOverSpeedOfTheOpenLoop) {
  Recording r;
  r.dt = 1e-3;
  const Eigen::VectorXd beta = Eigen::VectorXd::LinSpaced(10'001, 0, 1000);  // 100 rad/s
  r.add("x", Quantity::displacement, 1e-4 * beta.array().cos());
  r.add("x_est", Quantity::displacement, beta);
  r.add("beta", Quantity::angle, beta);
  Reference reference = reference_of(r, 50);
  EXPECT_EQ(reference.channels, std::vector<std::string>{"x"});
  EXPECT_LE(reference.speed.size(), 50);
  EXPECT_GT(reference.speed.size(), 25);
  EXPECT_NEAR(reference.speed(3), 100, 1e-6);
  EXPECT_NEAR(reference.amplitude(3, 0), 1e-4, 1e-6);
  r.add("x_open", Quantity::displacement, 3e-4 * (beta.array() - 0.5).cos());
  EXPECT_NEAR(reference_of(r).amplitude(3, 0), 3e-4, 3e-6);
  EXPECT_NEAR(reference_of(r).phase(3, 0), -0.5, 0.01);
  EXPECT_NEAR(reference_of(r, 600, Motion::measured).amplitude(3, 0), 1e-4, 1e-6);
  // Turn after turn, each 2 pi / 100 rad/s long, on the clock of the record.
  r.t0 = 7;
  const Reference all = reference_of(r);
  for (Eigen::Index i = 0; i < all.time.size(); ++i) {
    EXPECT_NEAR(all.time(i), 7 + static_cast<double>(i + 1) * 2 * std::numbers::pi / 100, 1e-3) << i;
  }
  r.channels.erase(r.channels.begin() + 2);
  EXPECT_THROW(reference_of(r), Error);
  Recording half;
  half.dt = 1e-3;
  half.add("x", Quantity::displacement, beta.head(30).array().cos());
  half.add("beta", Quantity::angle, beta.head(30));
  EXPECT_THROW(reference_of(half), Error);
}

TEST(MonitorLimits, AreSetCheckedAndCounted) {
  const StreamInfo info{"loop", 1000, {{"x", Quantity::displacement}, {"u", Quantity::force}}};
  LimitWatch watch(info, {{"u", 5}});
  EXPECT_THROW(watch.set("absent", 1), Error);
  EXPECT_THROW(watch.set("x", 0), Error);
  EXPECT_THROW(watch.set("x", NAN), Error);
  watch.set("x", 1e-3);
  watch.set("u", 6);
  ASSERT_EQ(watch.states().size(), 2U);
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(10, 2);
  rows(4, 0) = -2e-3;
  rows(5, 1) = 5.5;
  rows(6, 0) = NAN;
  const auto lines = watch.look(1, rows, " at 900 rpm");
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_EQ(lines[0], "x above its limit of 1.00 mm peak since 1.004 s at 900 rpm");
  EXPECT_EQ(watch.states()[1].crossings, 1);
  EXPECT_DOUBLE_EQ(watch.states()[0].largest, 5.5);
  watch.reset();
  EXPECT_EQ(watch.states()[1].crossings, 0);
}

}  // namespace
}  // namespace whirl::monitor
