#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>

#include "served.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::testing {
namespace {

struct IoTestE2e : ::testing::Test {
  Folder folder;
  Outcome test(const std::string& arguments) {
    return folder.whirl("io test --io io.toml --seconds 1 --json " + arguments);
  }
};

double number(const io::Json& json, std::initializer_list<const char*> path) {
  io::JsonReader at(json, "io test");
  for (const char* key : path) at = at.at(key);
  return at.number();
}

// All but what a loaded machine adds: its own clock against the rig's.
std::string own_problems(const io::Json& json) {
  std::string out;
  for (const io::JsonReader& p : io::JsonReader(json, "io test").at("problems").items()) {
    if (p.text().find("this machine's clock") == std::string::npos) out += p.text() + "\n";
  }
  return out;
}

TEST_F(IoTestE2e, ChannelsAndTheDelayOfTheLoop) {
  const rig::RigParameters rig;
  for (const int samples : {1, 3}) {
    SCOPED_TRACE(samples);
    folder.write("rig.toml", std::string(kRig) + "[actuator]\ndelay_samples = " + std::to_string(samples) + "\n");
    const Served served(folder, "--lockstep --rig rig.toml");
    const Outcome o = test("--excite-N 0.3");
    const io::Json json = io::parse_json(o.out, "io test");
    EXPECT_EQ(own_problems(json), "");
    // Computation, amplifier lag, age of the laser's reading.
    const double lag = 1 / (2 * std::numbers::pi * rig.actuator.bandwidth);
    const double expected = samples / rig.timing.rate + lag + rig.laser.latency;
    for (const char* axis : {"x", "y"}) {
      EXPECT_NEAR(number(json, {axis, "noise"}), rig.laser.noise, 0.3e-6);
      EXPECT_NEAR(number(json, {axis, "rate"}), rig.laser.rate, 0.005 * rig.laser.rate);
      EXPECT_NEAR(number(json, {axis, "mean"}), 0.5 * rig.laser.range, 0.1 * rig.laser.range);
      EXPECT_GT(number(json, {axis, "good"}), 0.99);
      EXPECT_EQ(number(json, {axis, "frames_lost"}), 0);
      EXPECT_NEAR(number(json, {axis, "excitation", "delay"}), expected, 0.15e-3);
      EXPECT_LT(number(json, {axis, "excitation", "deviation"}), 0.1e-3);
      EXPECT_NEAR(number(json, {axis, "excitation", "gain"}), (1 + rig.actuator.gain_error) / rig.rotor.mass, 0.03);
      EXPECT_NEAR(number(json, {axis, "excitation", "frequency"}), rig.natural_frequency() / (2 * std::numbers::pi),
                  0.3);
    }
    EXPECT_GE(number(json, {"board", "turnaround_mean"}), 1);
    EXPECT_EQ(number(json, {"board", "turned"}), 0);
    // The run itself has not begun.
    io::save(folder / "controller.json", pd_design());
    const Outcome run = folder.whirl("run controller.json --io io.toml --seconds 0.5 --json");
    EXPECT_EQ(run.exit_code, 0) << run.err;
  }
}

// The excitation runs over the wires, the reference opens the loop in simulation on the rig that is served.
TEST_F(IoTestE2e, TheSensitivityOfTheRunningLoopIsThatOfItsMargins) {
  folder.write("rig.toml", kRig);
  const rig::RigParameters rig;
  for (const auto& [kp, kd] : {std::pair(0.0, 60.0), std::pair(2000.0, 30.0), std::pair(0.0, 300.0)}) {
    SCOPED_TRACE(kd);
    ControllerDesign d = pd_design();
    d.parameters["kp"] = kp;
    d.parameters["kd"] = kd;
    io::save(folder / "controller.json", d);
    tuning::MarginOptions one;
    one.speeds = 2;
    one.repeats = 8;
    one.verify = false;
    const tuning::LoopMargins expected = tuning::loop_margins(d, rig, one).front().margins;
    ASSERT_TRUE(expected.stable);
    const Served served(folder, "--lockstep --rig rig.toml");
    const Outcome o =
        folder.whirl("io test --io io.toml --json --seconds 12 --excite-N 0.5 --sensitivity controller.json");
    const io::Json json = io::parse_json(o.out, "io test");
    const double peak = number(json, {"peak_sensitivity"});
    std::printf("peak %.3f, standard deviation %.3f, at %.1f Hz, %.0f ticks left out; by the margins %.3f at %.1f Hz\n",
                peak, number(json, {"peak_deviation"}), number(json, {"peak_frequency"}), number(json, {"missed"}),
                expected.peak_sensitivity, expected.peak_frequency);
    EXPECT_NEAR(peak, expected.peak_sensitivity, std::max(0.05 * peak, 3 * number(json, {"peak_deviation"})));
    EXPECT_LT(number(json, {"peak_deviation"}), 0.1 * peak);
    EXPECT_NEAR(number(json, {"phase_margin"}), expected.phase, 0.05);
    EXPECT_EQ(o.exit_code, expected.zone() == 'D' ? 1 : 0) << o.err;
  }
}

TEST_F(IoTestE2e, ASensitivityThatCannotBeMeasuredIsRefused) {
  folder.write("rig.toml", kRig);
  ControllerDesign d = pd_design();
  io::save(folder / "controller.json", d);
  const Served served(folder, "--lockstep --rig rig.toml");
  const auto refused = [&](const std::string& arguments, const std::string& word) {
    const Outcome o = folder.whirl("io test --io io.toml " + arguments);
    EXPECT_EQ(o.exit_code, 2) << o.out;
    EXPECT_NE(o.err.find(word), std::string::npos) << o.err;
  };
  refused("--sensitivity controller.json --seconds 12", "--excite-N");
  refused("--sensitivity controller.json --excite-N 0.5", "--seconds");
  d.sample_time *= 2;
  io::save(folder / "controller.json", d);
  refused("--sensitivity controller.json --excite-N 0.5 --seconds 12", "rate_hz");
  d = pd_design();
  d.parameters["kp"] = -2 * d.model.k1;  // the shaft falls to one side
  io::save(folder / "controller.json", d);
  const Outcome o = folder.whirl("io test --io io.toml --sensitivity controller.json --excite-N 0.5 --seconds 12");
  EXPECT_EQ(o.exit_code, 1) << o.out;
  EXPECT_NE(o.err.find("tripped"), std::string::npos) << o.err;
}

// In order: with what was seen so far, and a sentence. In lockstep the clock is another one, which may be a problem.
TEST_F(IoTestE2e, ASignalEndsTheTestInOrder) {
  folder.write("rig.toml", kRig);
  const Served served(folder, "--lockstep --rig rig.toml");
  const std::string command = "cd '" + (folder / "").string() +
                              "' && timeout --foreground --preserve-status -s INT 4 '" + program() +
                              "' io test --io io.toml --seconds 600 --excite-N 0.3 >out.txt 2>err.txt";
  const int status = std::system(command.c_str());
  const std::string said = slurp(folder / "err.txt");
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) <= 1) << status << said;
  EXPECT_NE(said.find("stopped by a signal"), std::string::npos) << said;
}

TEST_F(IoTestE2e, WithoutExcitationNoForceIsSent) {
  folder.write("rig.toml", kRig);
  const Served served(folder, "--rig rig.toml");
  const Outcome o = folder.whirl("io test --io io.toml --seconds 0.5");
  EXPECT_NE(o.out.find("turnaround by the board"), std::string::npos) << o.out << o.err;
  EXPECT_EQ(o.out.find("free vibration"), std::string::npos) << o.out;
}

TEST_F(IoTestE2e, AChannelThatIsNotFitIsNamed) {
  folder.write("rig.toml", kRig);
  folder.write("faults.toml", "[[fault]]\nkind = \"error_code\"\naxis = \"y\"\nstart_s = -1\n");
  {
    const Served served(folder, "--rig rig.toml --faults faults.toml");
    const Outcome o = test("");
    EXPECT_EQ(o.exit_code, 1);
    EXPECT_NE(o.err.find("y: sensor error in 100.0 % of the ticks, mostly: no peak"), std::string::npos) << o.err;
    EXPECT_EQ(o.err.find("x: "), std::string::npos) << o.err;
    EXPECT_EQ(number(io::parse_json(o.out, "io test"), {"y", "sensor_error"}), 1);
  }
  folder.write("faults.toml", "[[fault]]\nkind = \"lost_bytes\"\nevery = 199\naxis = \"x\"\nstart_s = -1\n");
  {
    const Served served(folder, "--rig rig.toml --faults faults.toml");
    const Outcome o = test("");
    EXPECT_EQ(o.exit_code, 1);
    EXPECT_NE(o.err.find("frames lost"), std::string::npos) << o.err;
  }
  folder.write("faults.toml", "[[fault]]\nkind = \"dropout\"\naxis = \"x\"\nstart_s = -1\n");
  {
    const Served served(folder, "--rig rig.toml --faults faults.toml");
    const Outcome o = test("");
    EXPECT_EQ(o.exit_code, 2);
    EXPECT_NE(o.err.find("clean frames"), std::string::npos) << o.err;
  }
}

// In the run itself the first turns of a dead actuator look like another unbalance.
TEST_F(IoTestE2e, AnActuatorThatIsDeadFromTheBeginningIsNamed) {
  folder.write("rig.toml", kRig);
  for (const std::string axis : {"y", "x", "both"}) {
    folder.write("faults.toml", "[[fault]]\nkind = \"actuator_loss\"\naxis = \"" + axis + "\"\nstart_s = -1\n");
    const Served served(folder, "--lockstep --rig rig.toml --faults faults.toml");
    const Outcome o = folder.whirl("io test --io io.toml --seconds 1 --excite-N 0.5");
    EXPECT_EQ(o.exit_code, 1) << o.err;
    for (const std::string name : {"x", "y"}) {
      const bool told = o.err.find(name + ": the excitation explains") != std::string::npos;
      EXPECT_EQ(told, axis == name || axis == "both") << axis << "\n" << o.err;
    }
  }
}

TEST_F(IoTestE2e, BadInputIsRefused) {
  EXPECT_EQ(folder.whirl("io test").exit_code, 2);
  folder.write("io.toml", "[board]\naddress = \"127.0.0.1:9\"\n[sensor.x]\nanalog = 0\n[sensor.y]\nanalog = 1\n");
  const Outcome o = test("--excite-N 1");
  EXPECT_EQ(o.exit_code, 2);
  EXPECT_NE(o.err.find("displacement_mm"), std::string::npos) << o.err;
  const Outcome silent = test("");
  EXPECT_EQ(silent.exit_code, 1) << silent.err;
  EXPECT_NE(silent.err.find("board"), std::string::npos) << silent.err;
}

}  // namespace
}  // namespace whirl::testing
