// A rotor whose angle nobody measured: its own vibration tells the speed, or the record is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <tuple>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::identification {
namespace {

using namespace testing;
using ::testing::Contains;
using ::testing::HasSubstr;

// Whoever gets a model gets a right one, without a phase.
TEST(VibrationAngleProperty, NoModelWithoutAnAngleIsWrong) {
  int found = 0;
  for (unsigned seed = 11; seed < 14; ++seed) {
    SCOPED_TRACE(seed);
    const Machine truth = draw_machine(Oddity::none, seed).machine;
    Recording r = machine_record(draw_machine(Oddity::none, seed), 40, seed);
    std::erase_if(r.channels, [](const Channel& c) { return c.name == "beta"; });
    RotorIdentifyOptions options;
    options.angle_source = AngleSource::vibration;
    const RotorIdentification id = identify_rotor_detailed(std::vector<Recording>{r}, options);
    if (id.model.summary.status == Status::unusable) continue;
    ++found;
    EXPECT_THAT(id.model.summary.warnings, Contains(HasSubstr("no angle is measured")));
    EXPECT_THAT(id.assumptions, Contains(HasSubstr("the phase of e means nothing")));
    const Estimate& phase = *id.model.parameter("e_phase");
    EXPECT_GE(phase.high - phase.low, 2 * std::numbers::pi - 1e-9);
    for (const auto& [name, value] : {std::tuple("k1", truth.k), std::tuple("k2", truth.cubic),
                                      std::tuple("c", truth.c), std::tuple("e", truth.e)}) {
      const Estimate& e = *id.model.parameter(name);
      EXPECT_LT(std::abs(e.value - value), 5 * e.sd + 1e-3 * std::abs(value)) << name;
    }
  }
  EXPECT_GE(found, 1);
}

}  // namespace
}  // namespace whirl::identification
