// A command that a message proposes works when it is followed.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <functional>
#include <numbers>

#include "../program.hpp"

namespace whirl::testing {
namespace {

/// Rows of a run at 1200 rpm: time, x, y, and what `last` makes of the turns.
std::string run(const std::string& header, const std::function<double(double turns)>& last, const char* cell = ",") {
  std::string text = header + "\n";
  for (int i = 0; i < 2000; ++i) {
    const double t = 1e-3 * i, turns = 20 * t, a = 2 * std::numbers::pi * turns;
    text += fmt::format("{0:.4f}{4}{1:.6f}{4}{2:.6f}{4}{3:.6f}\n", t, std::cos(a), std::sin(a), last(turns), cell);
  }
  return text;
}
double pulse(double turns) { return turns - std::floor(turns) < 0.1 ? 5 : 0; }
double radians(double turns) { return 2 * std::numbers::pi * turns; }

/// What follows `flag` in a message, with it, up to a bracket that explains.
std::string proposal(const Outcome& o, const std::string& flag) {
  const std::size_t at = o.err.find(flag);
  EXPECT_NE(at, std::string::npos) << o.err << o.out;
  return at == std::string::npos ? "" : o.err.substr(at, o.err.find_first_of("(;\n", at) - at);
}

TEST(AdviceE2e, PulsesAreFoundByTheirNameInAnyLettersOrProposed) {
  const Folder folder;
  for (const char* name : {"Tacho", "Keyphasor", "KEY", "tacho"}) {
    folder.write("run.csv", run(fmt::format("Time [s],X [mm],Y [mm],{} [V]", name), pulse));
    const Outcome o = folder.whirl("info run.csv");
    EXPECT_EQ(o.exit_code, 0) << o.err;
    EXPECT_EQ(o.out.find("no rotor angle"), std::string::npos) << name << "\n" << o.out;
    EXPECT_EQ(folder.whirl(fmt::format("info run.csv --pulses {}", name)).exit_code, 0) << name;
  }
  folder.write("run.csv", run("Time [s],X [mm],Y [mm],Beta [rad]", radians));
  EXPECT_EQ(folder.whirl("info run.csv").out.find("no rotor angle"), std::string::npos);
  for (const char* name : {"Tach", "Trigger", "AI3"}) {
    folder.write("run.csv", run(fmt::format("Time [s],X [mm],Y [mm],{} [V]", name), pulse));
    const Outcome o = folder.whirl("info run.csv");
    const std::string advice = fmt::format("--pulses {}", name);
    EXPECT_NE(o.out.find("looks like the pulses of a tacho; for the angle: " + advice), std::string::npos) << o.out;
    EXPECT_EQ(o.out.find("channel :"), std::string::npos) << o.out;
    EXPECT_EQ(folder.whirl("info run.csv " + advice).out.find("no rotor angle"), std::string::npos);
  }
  folder.write("run.csv", run("Time [s],X [mm],Y [mm],AI3 [V]", [](double turns) { return std::sin(radians(turns)); }));
  EXPECT_EQ(folder.whirl("info run.csv").out.find("--pulses"), std::string::npos) << "a sine is no tacho";
}

TEST(AdviceE2e, WhatMadeTheNumbersUnusableIsTheReason) {
  const Folder folder;
  std::string pull = "deflection_mm,force_N\n", wide = pull;
  for (int i = 0; i < 20; ++i) {
    pull += fmt::format("{},{}\n", 0.2 * i, -2.0 * i);
    wide += fmt::format("{},{}\n", 200 * i, 2.0 * i);
  }
  folder.write("pull.csv", pull), folder.write("wide.csv", wide);
  EXPECT_NE(folder.whirl("stiffness pull.csv").err.find("not usable: linear stiffness is not positive"),
            std::string::npos);
  const std::string err = folder.whirl("stiffness wide.csv").err;
  EXPECT_NE(err.find("not usable: deflections up to 3.8 m (3.8e+03 mm)"), std::string::npos) << err;
}

}  // namespace
}  // namespace whirl::testing
