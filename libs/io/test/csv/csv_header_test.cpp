#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string csv_header_error(std::string_view text, const CsvOptions& options = {}) {
  try {
    parse_csv(text, "a.csv", options);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

// The same record as instruments and spreadsheets head it.
TEST(CsvHeader, UnitsAreReadAsInstrumentsWriteThem) {
  const std::string rows = "0,1500,2\n0.1,1501,4\n0.2,1502,6\n";
  for (const std::string header :
       {"t_s,x_um,v_mm_s\n", "Time [s],x [um],v [mm/s]\n", "Time (s),x (\xC2\xB5m),v (mm/s)\n",
        "t / s,x / um,v / mm/s\n", "t {sec},x{\xCE\xBCm},v {mm/sec}\n",
        "\"time [seconds]\",\"x [micron]\",\"v [mm/s]\"\n", "t,x,v\ns,um,mm/s\n", "Zeit,x,v\n(s),(um),(mm/s)\n\n",
        "t,x,v\r\n[s],[\xC2\xB5m],[mm/s]\r\n", "t_s,x,v\n,um,mm/s\n"}) {
    const Recording record = parse_csv(header + rows, "a.csv");
    ASSERT_EQ(record.channels.size(), 2U) << header;
    EXPECT_DOUBLE_EQ(record.dt, 0.1) << header;
    EXPECT_DOUBLE_EQ(record["x"][1], 1501e-6) << header;
    EXPECT_EQ(record.at("v").quantity, Quantity::velocity) << header;
    EXPECT_DOUBLE_EQ(record["v"][2], 6e-3) << header;
  }
}

TEST(CsvHeader, UnitsOfOtherTongues) {
  const Recording r = parse_csv(
      "t [s],n [1/min],m [U/min],w [\xC2\xB0/s],phi [\xC2\xB0],a [m/s\xC2\xB2],b [m/s^2],c [m s^-2],p [%],q "
      "[N\xC2\xB7m]\n"
      "0,60,60,180,90,1,1,1,50,2\n1,60,60,180,90,1,1,1,50,2\n",
      "a.csv");
  for (const char* speed : {"n", "m"}) EXPECT_DOUBLE_EQ(r[speed][0], 2 * std::numbers::pi) << speed;
  EXPECT_DOUBLE_EQ(r["w"][0], std::numbers::pi);
  EXPECT_DOUBLE_EQ(r["phi"][0], std::numbers::pi / 2);
  for (const char* name : {"a", "b", "c"}) EXPECT_EQ(r.at(name).quantity, Quantity::acceleration) << name;
  EXPECT_DOUBLE_EQ(r["p"][0], 0.5);
  EXPECT_EQ(r.at("q").quantity, Quantity::torque);
}

TEST(CsvHeader, ForeignColumnsAreNamedAndCalibrated) {
  const std::string text = "Time [s],Probe 1 [V],Probe 2 [V]\n0,8,1\n0.5,4,1\n";
  CsvOptions options;
  options.columns = {"Time [s]", "Probe 1:x_mm*0.125", "Probe 2 [V]:y"};
  const Recording record = parse_csv(text, "a.csv", options);
  EXPECT_DOUBLE_EQ(record["x"][0], 1e-3);
  EXPECT_DOUBLE_EQ(record["x"][1], 0.5e-3);
  EXPECT_EQ(record.at("y").quantity, Quantity::voltage);
  EXPECT_EQ(parse_csv(text, "a.csv").channels[0].name, "Probe_1");
  options.columns = {"Time [s]", "Probe 1:x_mm*zero"};
  EXPECT_THAT(csv_header_error(text, options), HasSubstr("FACTOR"));
  options.columns = {"Time [s]", "Probe 1:x_furlong"};
  EXPECT_THAT(csv_header_error(text, options), HasSubstr("furlong"));
}

// The header says mm, --columns um: one of them is wrong, and a factor says which calibration is meant.
TEST(CsvHeader, AUnitAgainstThatOfTheHeaderIsRefused) {
  for (const std::string header : {"t_s,x [mm]\n", "t_s,x_mm\n", "t_s,x [V]\n"}) {
    const std::string text = header + "0,8\n0.5,4\n", name = header.substr(4, header.size() - 5);
    CsvOptions options;
    options.columns = {"t_s", name + ":x_um"};
    const std::string error = csv_header_error(text, options);
    const bool volts = header.find("V") != header.npos;
    EXPECT_THAT(error, AllOf(HasSubstr(name + ":x_um"), HasSubstr(name + (volts ? ":x_um*FACTOR" : ":x_um*1"))));
    EXPECT_THAT(error, HasSubstr(volts ? "says V, so FACTOR is the calibration in um per V" : "says mm")) << header;
    options.columns = {"t_s", name + ":x_um*1"};
    EXPECT_DOUBLE_EQ(parse_csv(text, "a.csv", options)["x"][0], 8e-6) << header;
  }
  // A number at the end of a name is no unit.
  EXPECT_DOUBLE_EQ(parse_csv("t_s,ch_1\n0,8\n1,4\n", "a.csv", {.columns = {"t_s", "ch_1:x_mm"}})["x"][0], 8e-3);
}

// Channels that have a part to play are known in any letters, and a speed in turns a second is one too.
TEST(CsvHeader, PartsAreKnownInAnyLetters) {
  const Recording r = parse_csv("Time [s],Beta [rad],Keyphasor [V],Pump_A [mm]\n0,1,0,1\n1,2,5,2\n", "a.csv");
  for (const char* name : {"beta", "Beta", "keyphasor", "Keyphasor", "Pump_A"}) EXPECT_TRUE(r.has(name)) << name;
  EXPECT_FALSE(r.has("pump_a"));
  EXPECT_NEAR(parse_table("Speed [Hz],amp_um\n25,1\n26,1\n", "a.csv").in("speed", Quantity::angular_velocity)[0],
              157.08, 0.01);
}

// Whoever names the probes wants the file's own time with them.
TEST(CsvHeader, TheTimeNeedNotBeNamed) {
  for (const std::string header :
       {"t_s,left_um,right_um\n", "Time [s],left [um],right [um]\n", "Zeit [s],left [um],right [um]\n"}) {
    const std::string text = header + "0,1500,2\n0.1,1501,4\n0.2,1502,6\n";
    CsvOptions options;
    options.columns = {"3:x_um"};
    const Recording record = parse_csv(text, "a.csv", options);
    EXPECT_DOUBLE_EQ(record.dt, 0.1) << header;
    ASSERT_EQ(record.channels.size(), 1U) << header;
    options.rate = 50;  // says more than the column
    EXPECT_DOUBLE_EQ(parse_csv(text, "a.csv", options).dt, 0.02) << header;
  }
}

TEST(CsvHeader, LinesBeforeTheHeader) {
  const std::string text = "Test 5; spring\nRate: 100 Hz\n\nt [s];x [mm]\n0,0;1,5\n0,01;1,6\n";
  CsvOptions options;
  EXPECT_THAT(csv_header_error(text), AllOf(HasSubstr("a.csv:1:"), HasSubstr("--header-line 4")));
  options.header_line = 4;
  const Recording record = parse_csv(text, "a.csv", options);
  EXPECT_DOUBLE_EQ(record.dt, 0.01);
  EXPECT_DOUBLE_EQ(record["x"][1], 1.6e-3);
  options.header_line = 40;
  EXPECT_THAT(csv_header_error(text, options), HasSubstr("has 6 lines"));
}

// What is no unit is not taken for one, and what contradicts is refused.
TEST(CsvHeader, RefusesWhatItCannotKnow) {
  EXPECT_THAT(csv_header_error("t [s],x [filtered]\n0,1\n1,2\n"),
              AllOf(HasSubstr("a.csv:1:"), HasSubstr("x [filtered]")));
  EXPECT_THAT(csv_header_error("t,x\n0,1\n1,2\n"),
              AllOf(HasSubstr("'t_s'"), HasSubstr("--columns"), Not(HasSubstr("line 2"))));
  EXPECT_THAT(csv_header_error("t,x\ns,furlong\n0,1\n1,2\n"), AllOf(HasSubstr("a.csv:2:"), HasSubstr("furlong")));
  EXPECT_THAT(csv_header_error("t_s,x_mm\ns,um\n0,1\n1,2\n"), HasSubstr("'s' is not a number"));
  EXPECT_THAT(csv_header_error("t,x_mm\ns,um\n0,1\n1,2\n"), HasSubstr("is in um by the line below"));
  EXPECT_THAT(csv_header_error("t [s],x [mm],x [um]\n0,1,2\n1,2,3\n"), HasSubstr("two columns are called 'x'"));
  EXPECT_THAT(csv_header_error("t [s],[mm]\n0,1\n1,2\n"), HasSubstr("column 2 has no name"));
  // A first column in units of time is the time only where the header is an instrument's.
  EXPECT_THAT(csv_header_error("delay_ms,x_mm\n0,1\n1,2\n"), HasSubstr("no time column"));
}

}  // namespace
}  // namespace whirl::io
