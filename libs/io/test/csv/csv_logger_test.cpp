// Tables as loggers and spreadsheets write them: read right, or refused in one line that says what to do.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

std::string logger_error(std::string_view text, const CsvOptions& options = {}) {
  try {
    parse_csv(text, "a.csv", options);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

// Each line is a way to write 10:59:58 and a step of 0.01 s.
TEST(CsvLogger, StampsAreTheTime) {
  const char* heads[] = {"timestamp,x_mm\n2026-11-26T10:59:58.00Z,1\n2026-11-26T10:59:58.01Z,2\n",
                         "Zeit;x [mm]\n26.11.2026 10:59:58,00;1,0\n26.11.2026 10:59:58,01;2,0\n",
                         "Date,Time,x_mm\n2026-11-26,10:59:58.000,1\n2026-11-26,10:59:58.010,2\n",
                         "Time,x_mm\n11/26/2026 10:59:58.00 AM,1\n11/26/2026 10:59:58.01 AM,2\n",
                         "Time,x_mm\n2026-11-26 12:59:58.00+02:00,1\n2026-11-26 12:59:58.01+02:00,2\n",
                         "time\tx_mm\n10:59:58.00\t1\n10:59:58.01\t2\n"};
  for (const char* text : heads) {
    const Recording r = parse_csv(text, "a.csv");
    EXPECT_NEAR(r.t0, 39598, 1e-9) << text;
    EXPECT_NEAR(r.dt, 0.01, 1e-9) << text;
    ASSERT_EQ(r.channels.size(), 1U) << text;
    EXPECT_EQ(r["x"][1], 2e-3) << text;
  }
  EXPECT_NEAR(parse_csv("Time,x_mm\n23:59:59.5,1\n00:00:00.0,2\n00:00:00.5,3\n", "a").dt, 0.5, 1e-12);
  EXPECT_NEAR(parse_csv("d,x_mm\n2026-12-31 23:59:59.5,1\n2027-01-01 00:00:00.0,2\n", "a").dt, 0.5, 1e-9);
  EXPECT_NEAR(parse_csv("Time,x_mm\n00:01.5,1\n00:02.0,2\n", "a").t0, 1.5, 1e-12);
  EXPECT_THAT(logger_error("Time,x_mm\n00:01.5,1\nend,2\n"), HasSubstr("'end' is no date or time"));
}

TEST(CsvLogger, NamesInOtherLettersAreKnown) {
  const Recording r =
      parse_csv("Time_s,X_mm,Y_mm,Beta_rad\n0,1,2,3\n1,2,3,4\n", "a.csv", {.required = {"x", "y", "beta"}});
  EXPECT_EQ(r["x"][0], 1e-3);
  EXPECT_EQ(r["beta"][1], 4);
  for (const char* spec : {"X:x", "X_mm:x", "x", "X_MM:x", "X:x_mm"})
    EXPECT_EQ(parse_csv("t_s,X_mm\n0,1\n1,2\n", "a.csv", {.columns = {spec}})["x"][1], 2e-3) << spec;
}

TEST(CsvLogger, BlanksASepLineAndInchesAreRead) {
  EXPECT_EQ(parse_csv("t_s  x_mm\n0   1\n0.5  2\n", "a.csv")["x"][1], 2e-3);
  EXPECT_EQ(parse_csv("sep=;\nt_s;x_mm\n0;1,5\n0,5;2,5\n", "a.csv")["x"][1], 2.5e-3);
  EXPECT_NEAR(parse_csv("t_s,x_inch\n0,1\n1,2\n", "a.csv")["x"][1], 2 * 0.0254, 1e-12);
}

TEST(CsvLogger, TimesOfFewDigitsTakeTheRate) {
  std::string two = "t_s,x_mm\n", six = two;
  for (int i = 0; i < 200000; ++i) {
    if (i < 3000) two += fmt::format("{:.2f},{}\n", 1e-3 * i, i % 7);
    six += fmt::format("{:.6g},{}\n", i / 1024.0, i % 7);
  }
  EXPECT_EQ(parse_csv(two, "a.csv", {.rate = 1000}).dt, 1e-3);
  EXPECT_EQ(parse_csv(six, "a.csv", {.rate = 1024}).dt, 1 / 1024.0);
  EXPECT_THAT(logger_error(two, {.rate = 500}), HasSubstr("a.csv"));
  EXPECT_THAT(logger_error(two), HasSubstr("--rate"));
}

TEST(CsvLogger, SeveralRatesInOneTable) {
  std::string text = "t_s,x_mm,T_degC\n";
  for (int i = 0; i < 1000; ++i) {
    text += fmt::format("{:.4f},{},\n", 1e-3 * i, std::sin(0.1 * i));
    if (i % 10 == 5) text += fmt::format("{:.4f},,{}\n", 1e-3 * i + 5e-4, 20 + 0.001 * i);
  }
  const Recording r = parse_csv(text, "a.csv", {.gaps = true});
  EXPECT_NEAR(1 / r.dt, 1000, 1e-6);
  EXPECT_EQ(r.size(), 1000);
  EXPECT_NEAR(r["T"][500], 293.15 + 0.4995, 1e-6);
  EXPECT_THAT(logger_error(text), HasSubstr("one table for each rate"));
}

TEST(CsvLogger, WhatCannotBeReadSaysWhatToDo) {
  EXPECT_THAT(logger_error("t_s,x_mm,y_mm\n0,0,1,0,2\n0,1,0,1,0,2\n"), HasSubstr("export with ';'"));
  EXPECT_THAT(logger_error(std::string("PK\x03\x04") + std::string(100, '\0')), HasSubstr("CSV UTF-8"));
  EXPECT_THAT(logger_error("t,x,Winkel [rad]\n0,1,2\n1,2,3\n"),
              HasSubstr("--columns t:t_s x:x_mm \"Winkel [rad]:beta_rad\""));
  EXPECT_THAT(logger_error("0,1,2,3\n1,2,3,4\n"), HasSubstr("--columns 1:t_s 2:x_mm 3:y_mm 4:beta_rad"));
  // No column that rises evenly: no time.
  EXPECT_THAT(logger_error("0.1\n-0.3\n0.2\n"), HasSubstr("--columns 1:x_mm --rate HZ"));
  EXPECT_THAT(logger_error("0.1;3\n-0.3;4\n0.2;5\n"), HasSubstr("--columns 1:x_mm 2:y_mm --rate HZ"));
  EXPECT_THAT(logger_error("t_s,x_mm\n2,1\n1,2\n0,3\n"), HasSubstr("newest line first"));
  EXPECT_THAT(logger_error("t_s,x_mm,x_mm\n0,1,2\n1,2,3\n"), HasSubstr("1:t_s 2:x_mm"));
  EXPECT_THAT(logger_error("t_s,x_mm\n"), HasSubstr("no data"));
  EXPECT_THAT(logger_error("t_s,x_mm\n0,1\n1,2\nMax,2\n"), HasSubstr("delete it"));
}

/// An oscilloscope writes NAME.Wfm.csv with values alone and NAME.csv with the step.
TEST(CsvLogger, ValuesOfAnOscilloscopeTakeTheRateOfTheirPair) {
  const std::filesystem::path folder = std::filesystem::path(::testing::TempDir()) / "scope";
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "run.csv") << "Type:WaveformType:\nResolution:0.0005:\nRecordLength:3:\n";
  std::ofstream(folder / "run.Wfm.csv") << "0.1\n-0.3\n0.2\n";
  const auto error = whirl::testing::error_of([&] { (void)read_csv(folder / "run.Wfm.csv"); });
  EXPECT_THAT(error, HasSubstr("--columns 1:x_mm --rate 2000"));
  EXPECT_THAT(error, HasSubstr("run.csv"));
}

}  // namespace
}  // namespace whirl::io
