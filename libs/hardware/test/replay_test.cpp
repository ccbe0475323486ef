#include "whirl/hardware/replay.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::hardware {
namespace {

ControllerDesign proportional() {
  ControllerDesign d;
  d.law = "pd";
  d.estimator = "lpf";
  d.sample_time = 1e-3;
  d.model.k1 = 5600;
  d.model.c = 0.9;
  d.model.gain = 1 / 1.5;
  return d;
}

/// What a loop with this controller recorded: it runs on a motion that is given, and its own force is what was sent.
rt::LoopRecord recording_of(const ControllerDesign& design) {
  control::Controller controller = control::make_controller(design);
  rt::LoopRecord record;
  record.head.sample_time = design.sample_time;
  record.head.texts = {{"controller", io::to_json(design).dump()}};
  record.closed = true;
  for (int k = 0; k < 400; ++k) {
    const double t = 1e-3 * k;
    const Measurement m{t, 1e-3 * std::sin(50 * t), 5e-4 * std::cos(50 * t), 80 * t, 80, 0, true};
    whirl::Command u;
    if (const auto request = controller.step(m)) u = *request;
    controller.applied(u);
    rt::LoopSample s;
    s.tick = k, s.t = t;
    s.x = m.x, s.y = m.y, s.beta = m.beta, s.omega = m.omega;
    s.ux = u.ux, s.uy = u.uy;
    s.flags = rt::kValid | rt::kArmed;
    record.cycles.push_back(s);
  }
  return record;
}

TEST(Replay, TheRecordedControllerGivesTheRecordedForceAgain) {
  const rt::LoopRecord record = recording_of(proportional());
  const Replay out = replay(record, recorded_design(record), "loop.h5");
  EXPECT_EQ(out.cycles, 400);
  EXPECT_EQ(out.compared, 400);
  EXPECT_LT(out.force_worst, 1e-12);
  EXPECT_GT(out.log["ux_recorded"].cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ(out.log["ux"], out.log["ux_recorded"]);
}

TEST(Replay, AForceThatWasNotTheControllersIsSeen) {
  rt::LoopRecord record = recording_of(proportional());
  record.cycles[200].ux += 0.25;
  const Replay out = replay(record, recorded_design(record), "loop.h5");
  EXPECT_GT(out.force_worst, 0.24);
  EXPECT_GT(out.force_rms, 0.01);
  // Cycles that the controller did not decide do not count.
  record.cycles[200].flags |= rt::kLimited;
  EXPECT_EQ(replay(record, recorded_design(record), "loop.h5").compared, 399);
}

TEST(Replay, AnotherEstimatorTakesItsOwnParameters) {
  const ControllerDesign design = with_estimator(proportional(), "kalman");
  EXPECT_EQ(design.estimator, "kalman");
  EXPECT_EQ(with_estimator(proportional(), "").estimator, "lpf");
  EXPECT_NO_THROW(control::make_controller(design));
}

TEST(Replay, RefusesWhatCannotBeReplayed) {
  rt::LoopRecord record = recording_of(proportional());
  record.cycles.clear();
  EXPECT_THROW(replay(record, proportional(), "loop.h5"), Error);
  record.head.texts.clear();
  EXPECT_THROW(recorded_design(record), Error);
}

}  // namespace
}  // namespace whirl::hardware
