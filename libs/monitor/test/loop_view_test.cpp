#include "whirl/monitor/loop_view.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/control_types.hpp"
#include "whirl/core/error.hpp"
#include "whirl/monitor/limit_watch.hpp"
#include "whirl/monitor/loop_columns.hpp"

namespace whirl::monitor {
namespace {

rt::LoopSample cycle(std::int64_t tick, std::int32_t flags, Fault trip = Fault::none) {
  rt::LoopSample s;
  s.tick = tick;
  s.started = 1e-3 * static_cast<double>(tick + 1);
  s.scheduled = s.started;
  s.x = 1e-4;
  s.omega = 100;
  s.dx_est = 2;
  s.flags = flags;
  s.trip = static_cast<std::int32_t>(trip);
  return s;
}

TEST(LoopView, WhatTheLoopDidReachesThePage) {
  LoopView view({.name = "loop", .rate = 1000, .force_limit = 10, .attended = true});
  const std::unique_ptr<FrameSource> source = view.source();
  view.take(cycle(0, rt::kValid));
  view.take(cycle(1, rt::kValid | rt::kArmed));
  view.take(cycle(2, rt::kArmed, Fault::requested));
  Eigen::MatrixXd block(16, static_cast<Eigen::Index>(kLoopColumns.size()));
  double t = 0;
  ASSERT_EQ(source->read(block, t), 3);
  EXPECT_EQ(block(1, 0), 1e-4);
  EXPECT_TRUE(std::isnan(block(2, 0)));  // a reading that was lost
  EXPECT_EQ(block(0, 12), 0);            // disarmed: the controller has no eccentricity
  EXPECT_NEAR(block(1, 12), 2e-4, 1e-12);
  const std::vector<std::string> events = source->events();
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[0], "armed");
  EXPECT_NE(events[1].find("trip at tick 2"), std::string::npos);
  EXPECT_NE(source->status()[0].second.find("tripped"), std::string::npos);
  view.ended("done");
  EXPECT_EQ(source->status()[0].second, "ended");
}

TEST(LoopView, OnlyAnAttendedLoopTakesCommands) {
  LoopView alone({.name = "loop"});
  EXPECT_EQ(alone.control(), nullptr);
  EXPECT_TRUE(alone.source()->controls().empty());
  EXPECT_FALSE(alone.source()->urgent("trip"));
  LoopView view({.name = "loop", .rate = 1000, .force_limit = 10, .attended = true});
  const std::unique_ptr<FrameSource> source = view.source();
  ASSERT_NE(view.control(), nullptr);
  EXPECT_TRUE(source->command("force_limit", 4));
  EXPECT_EQ(view.control()->force_limit(), 4);
  EXPECT_THROW(source->command("force_limit", 11), Error);
  EXPECT_TRUE(source->urgent("trip"));
  EXPECT_TRUE(view.control()->tripped());
  EXPECT_THROW(source->command("arm", 0), Error);
  EXPECT_TRUE(source->command("clear", 0));
}

TEST(LoopView, ARecordingOfALoopHasTheSameColumns) {
  rt::LoopRecord record;
  record.head.sample_time = 1e-3;
  EXPECT_THROW(loop_recording(record, "run.h5"), Error);
  record.cycles = {cycle(5, rt::kValid), cycle(7, rt::kValid)};
  const Recording r = loop_recording(record, "run.h5");
  EXPECT_EQ(r.channels.size(), kLoopColumns.size());
  ASSERT_EQ(r.size(), 3);
  EXPECT_TRUE(std::isnan(r["x"][1]));  // tick 6 was left out
}

TEST(LoopView, LimitsAreWrittenWithTheirUnit) {
  EXPECT_EQ(read_limit("x_mm=0.5").first, "x");
  EXPECT_DOUBLE_EQ(read_limit("x_mm=0.5").second, 5e-4);
  for (const char* wrong : {"x", "x=1", "x_mm=", "x_mm=a"}) EXPECT_THROW(read_limit(wrong), Error) << wrong;
}

}  // namespace
}  // namespace whirl::monitor
