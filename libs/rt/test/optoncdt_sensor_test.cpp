#include "whirl/rt/drivers/optoncdt_sensor.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cmath>
#include <string>
#include <thread>
#include <vector>

#include "optoncdt_simulator.hpp"
#include "whirl/core/error.hpp"

namespace whirl::rt::optoncdt {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

SensorOptions options_for(const Simulator& laser, bool counter) {
  SensorOptions o;
  o.device = laser.device();
  o.counter = counter;
  o.timeout = 10;  // a loaded machine must not fail the test
  return o;
}

/// Reads until `count` samples or ten seconds.
std::vector<Sample> collect(Sensor& sensor, std::size_t count) {
  std::vector<Sample> out;
  std::array<Sample, 64> block;
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (out.size() < count && sensor.connected() && std::chrono::steady_clock::now() < end) {
    const std::size_t n = sensor.read(block);
    out.insert(out.end(), block.begin(), block.begin() + static_cast<std::ptrdiff_t>(n));
    if (n == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return out;
}

TEST(OptoncdtSensor, ReadsDistancesInOrderFromALineThatWasLeftRunning) {
  Simulator::Options o;
  o.value = [](std::uint64_t k) { return static_cast<std::uint32_t>(1000 + k % 60000); };
  const Simulator laser(o);
  std::this_thread::sleep_for(std::chrono::milliseconds(20));  // frames of the earlier use lie on the line
  Sensor sensor(options_for(laser, false));
  const Scale scale(0.010);
  const auto samples = collect(sensor, 400);
  ASSERT_GE(samples.size(), 400u);
  const double step = scale.resolution();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    ASSERT_EQ(samples[i].reading.error, SensorError::none);
    ASSERT_EQ(samples[i].index, samples[i - 1].index + 1);
    ASSERT_NEAR(samples[i].reading.distance - samples[i - 1].reading.distance, step, 1e-12) << i;
  }
}

TEST(OptoncdtSensor, TheCounterShowsLostFramesAndKeepsTheIndexTrue) {
  Simulator::Options o;
  o.value = [](std::uint64_t k) { return static_cast<std::uint32_t>(1000 + k); };
  o.lose_byte_every = 101;
  const Simulator laser(o);
  Sensor sensor(options_for(laser, true));
  const auto samples = collect(sensor, 500);
  ASSERT_GE(samples.size(), 500u);
  EXPECT_GT(sensor.lost_frames(), 10u);
  EXPECT_GT(sensor.statistics().dropped, 0u);
  const Scale scale(0.010);
  const auto raw = [&](const Sample& s) { return std::lround((s.reading.distance / 0.010 + 0.01) * 65520 / 1.02); };
  for (const Sample& s : samples) {
    // Index and value advance together although frames are missing.
    ASSERT_EQ(raw(s) - raw(samples[0]), static_cast<long>(s.index - samples[0].index));
  }
}

TEST(OptoncdtSensor, ErrorCodesArriveAsErrors) {
  Simulator::Options o;
  o.value = [](std::uint64_t k) { return k % 2 == 0 ? 262076u : 40000u; };
  const Simulator laser(o);
  Sensor sensor(options_for(laser, false));
  for (const Sample& s : collect(sensor, 100)) {
    if (s.reading.error == SensorError::none) {
      EXPECT_NEAR(s.reading.distance, 6.127e-3, 1e-6);
    } else {
      EXPECT_EQ(s.reading.error, SensorError::no_peak);
      EXPECT_TRUE(std::isnan(s.reading.distance));
    }
  }
}

std::string options_error(const SensorOptions& o) {
  try {
    const Sensor sensor(o);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(OptoncdtSensor, StartUpErrorsNameDeviceCommandAndReason) {
  Simulator::Options refusing;
  refusing.refuse = "MEASRATE";
  const Simulator r(refusing);
  EXPECT_THAT(options_error(options_for(r, false)),
              AllOf(HasSubstr(r.device()), HasSubstr("refused 'MEASRATE 4': E204")));
  Simulator::Options mute;
  mute.mute = true;
  const Simulator m(mute);
  SensorOptions o = options_for(m, false);
  o.timeout = 0.05;
  EXPECT_THAT(options_error(o), HasSubstr("no answer to 'OUTPUT NONE' within 0.05 s"));
  o.device = "/dev/null";
  EXPECT_THAT(options_error(o), HasSubstr("is no serial line"));
  o.device = "/nonexistent";
  EXPECT_THAT(options_error(o), HasSubstr("cannot be opened"));
  o.baud = 5;
  EXPECT_THAT(options_error(o), HasSubstr("baud = 5: must be between"));
}

TEST(OptoncdtSensor, AnUnpluggedLineIsNoticed) {
  Simulator laser({});
  Sensor sensor(options_for(laser, false));
  EXPECT_FALSE(collect(sensor, 10).empty());
  laser.unplug();
  std::array<Sample, 64> block;
  for (int i = 0; i < 10000 && sensor.connected(); ++i) (void)sensor.read(block);
  EXPECT_FALSE(sensor.connected());
  EXPECT_EQ(sensor.read(block), 0u);
}

}  // namespace
}  // namespace whirl::rt::optoncdt
