#include "whirl/io/csv.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/testing/data.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using whirl::testing::error_of;

std::string error_of_csv(std::string_view text, const CsvOptions& options = {}) {
  return error_of([&] { parse_csv(text, "a.csv", options); });
}

TEST(Csv, ReadsHeaderUnitsIntoSi) {
  const Recording r =
      parse_csv("t_s,x_mm,y_um,beta_deg,ux_N\n0,1,2,180,4\n0.001,5,6,360,8\n0.002,5,6,360,8\n", "a.csv");
  EXPECT_EQ(r.size(), 3);
  EXPECT_EQ(r.dt, 1e-3);
  EXPECT_EQ(r.t0, 0);
  EXPECT_EQ(r.source, "a.csv");
  EXPECT_EQ(r["x"][0], 1e-3);
  EXPECT_EQ(r["y"][1], 6e-6);
  EXPECT_EQ(r["beta"][0], std::numbers::pi);
  EXPECT_EQ(r.at("ux").quantity, Quantity::force);
  EXPECT_FALSE(r.has("t"));
}

TEST(Csv, AcceptsTheCommonDialectsAndSaysWhichItFound) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "dialect.csv";
  write_text(file, "\xef\xbb\xbft_s;x_mm\r\n0;1,5\r\n0,5;-2,25e1\r\n");
  CsvDialect d;
  const Recording r = read_csv(file, {}, &d);
  EXPECT_EQ(r["x"][0], 1.5e-3);
  EXPECT_EQ(r["x"][1], -22.5e-3);
  EXPECT_EQ(r.dt, 0.5);
  EXPECT_EQ(d.delimiter, ';');
  EXPECT_EQ(d.decimal, ',');
  EXPECT_TRUE(d.byte_order_mark);
  EXPECT_TRUE(d.carriage_return);
  EXPECT_EQ(to_string(d), "';' between values, decimal ',', byte order mark, CR LF");
  EXPECT_EQ(parse_csv("# made by hand\n\nt_s\tx_mm\n0\t +1 \n1\t\"2\"\n\n\n", "a.csv")["x"][1], 2e-3);
}

TEST(Csv, ColumnsOptionSelectsAndNames) {
  CsvOptions o;
  o.rate = 10;
  o.columns = {"V2:y_V", "1:u_mV"};
  const Recording r = parse_csv("\"V1\",\"V2\",\n1,2,\n3,4,\n\n", "a.csv", o);
  EXPECT_EQ(r["y"][1], 4);
  EXPECT_EQ(r["u"][1], 3e-3);
  EXPECT_EQ(parse_csv("1,2\n3,4\n", "a.csv", {.rate = 1, .columns = {"2:x_m"}})["x"][0], 2);
  EXPECT_EQ(parse_csv("note,x_mm\nabc,1\n\"d,e\",2\n", "a.csv", {.rate = 1, .columns = {"x_mm"}})["x"][1], 2e-3);
}

TEST(Csv, EveryDefectNamesFileLineColumnAndWhatIsAllowed) {
  EXPECT_THAT(error_of_csv("t_s,x_furlong\n0,1\n"),
              AllOf(HasSubstr("a.csv:1:"), HasSubstr("'x_furlong' has the unknown unit 'furlong'"), HasSubstr(" mm ")));
  EXPECT_THAT(error_of_csv("t_s,x_MM\n0,1\n"), HasSubstr("did you mean 'mm'?"));
  EXPECT_THAT(error_of_csv("t_s,x\n0,1\n"), HasSubstr("'x' has no unit; write name_unit, e.g. 'x_mm'"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,nan\n"), HasSubstr("a.csv:3: column 'x_mm': 'nan' is not finite"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,-1e999\n"), HasSubstr("'-1e999' is not finite"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,\n"), HasSubstr("a.csv:3: column 'x_mm': empty"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,1.5x\n"), HasSubstr("'1.5x' is not a number"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,2,3\n"), HasSubstr("a.csv:3: 3 values, but the header has 2"));
  EXPECT_THAT(error_of_csv("t_s,x_mm,\n0,1,\n1,2\n"), HasSubstr("a.csv:3: 2 values, but the header has 3"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,001,0,5\n"), HasSubstr("decimal commas need ';'"));
  EXPECT_THAT(error_of_csv("t_s;x_mm\n0,1;1\n1.5;2\n"),
              HasSubstr("a.csv:3: column 't_s': '1.5' has the decimal sign '.'"));
  EXPECT_THAT(error_of_csv("t_s,x_mm,x_m\n0,1,2\n"), HasSubstr("two columns are called 'x'"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n\n1,2\n"), HasSubstr("a.csv:4: data after an empty line"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n"), HasSubstr("1 sample; at least 2"));
  EXPECT_THAT(error_of_csv("x_mm\n0\n1\n"), HasSubstr("no time column"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,2\n", {.required = {"y"}}),
              AllOf(HasSubstr("no column 'y'"), HasSubstr("present: t, x")));
  EXPECT_EQ(error_of_csv("t_s,x_mm\n0,1\n1,2\n", {.required = {"x_um"}}), "no error");
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,2\n", {.required = {"x_N"}}),
              HasSubstr("column 'x_mm' is a displacement, must be a force; allowed units: N mN"));
  EXPECT_THAT(error_of_csv("1,2\n3,4\n", {.rate = 1}), HasSubstr("no header"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n1,1\n", {.refuse_constant = true}), HasSubstr("channel 'x' is constant"));
  EXPECT_THAT(error_of_csv(""), HasSubstr("no header and no data"));
  EXPECT_THAT(error_of_csv(std::string("t_s,x\0_mm\n", 10)), HasSubstr("zero bytes"));
  EXPECT_THAT(error_of_csv(std::string(5000, ',')), HasSubstr("5000 columns; at most 4096"));
  EXPECT_THAT(error_of_csv("\xff\xfet"), HasSubstr("UTF-16"));
  EXPECT_THAT(error_of_csv(std::string(3 << 20, '1')), HasSubstr("longer than"));
  EXPECT_THAT(error_of([] { read_csv("/nonexistent/a.csv"); }), HasSubstr("/nonexistent/a.csv: cannot be opened"));
}

TEST(Csv, RefusesTimeThatIsNotUniformAndShowsTheSteps) {
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n0.1,1\n0.3,1\n0.4,1\n0.5,1\n0.6,1\n"),
              AllOf(HasSubstr("a.csv:4: time is not uniform: step 0.2 s here, 0.12 s on average"), HasSubstr("5 %")));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n0.1,1\n0.1,1\n"), HasSubstr("a.csv:4: time 0.1 s does not follow 0.1 s"));
  EXPECT_THAT(error_of_csv("t_s,x_mm\n0,1\n0.1,1\n", {.rate = 20}), HasSubstr("the rate given is 20 Hz"));
}

TEST(Csv, FindsTheRateBehindRoundedTimes) {
  std::string text = "t_s,x_mm\n";
  for (int i = 0; i < 5000; ++i) text += fmt::format("{:.6f},1\n", i / 51200.0);
  EXPECT_EQ(parse_csv(text, "a.csv").dt, 1 / 51200.0);
  text = "t_ms,x_mm\n";
  for (int i = 0; i < 300; ++i) text += fmt::format("{},1\n", 7 + i * 1000 / 610.3516);
  EXPECT_EQ(parse_csv(text, "a.csv").dt, 1 / 610.3516);
  EXPECT_EQ(parse_csv(text, "a.csv").t0, 7e-3);
}

TEST(Csv, AStatedRateAllowsCoarselyRoundedTimesButNoMissingSample) {
  std::string text = "t_ms,x_mm\n", holed = text;
  for (int i = 0; i < 100; ++i) {
    const std::string line = fmt::format("{:.0f},1\n", i * 1000 / 300.0);
    text += line;
    if (i != 50) holed += line;
  }
  EXPECT_THAT(error_of_csv(text), HasSubstr("times rounded? state the rate"));
  EXPECT_EQ(parse_csv(text, "a.csv", {.rate = 300}).dt, 1 / 300.0);
  EXPECT_THAT(error_of_csv(holed, {.rate = 300}), HasSubstr("a.csv"));
}

TEST(Csv, WriteAndReadGiveTheSameDoubles) {
  const std::filesystem::path dir(::testing::TempDir());
  Recording r;
  r.t0 = -0.125;
  r.dt = 1 / 610.3516;
  r.add("x", Quantity::displacement, Eigen::VectorXd::Random(100000) * 1e-3);
  r.add("ux", Quantity::force, Eigen::VectorXd::LinSpaced(100000, -1 / 3.0, 7e8));
  for (const char* name : {"a.csv", "a.csv.gz"}) {
    write_csv(dir / name, r);
    const Recording back = read_csv(dir / name);
    EXPECT_EQ(back.dt, r.dt);
    EXPECT_EQ(back.t0, r.t0);
    EXPECT_EQ(back["x"], r["x"]);
    EXPECT_EQ(back["ux"], r["ux"]);
  }
  write_csv(dir / "b.csv", r, {.units = {"x_mm", "t_ms"}});
  EXPECT_TRUE(read_csv(dir / "b.csv")["x"].isApprox(r["x"], 1e-15));
  EXPECT_THAT(error_of([&] { write_csv(dir / "b.csv", r, {.units = {"x_N"}}); }), HasSubstr("allowed units: m cm mm"));
}

TEST(Csv, TablesKeepComplexPartsAndNamedUnits) {
  const Table t = parse_table("rpm,amp_um,H1_re,H1_im\n60,1,2,3\n30,1,2,3\n", "b.csv");
  EXPECT_DOUBLE_EQ(t["speed"][0], 2 * std::numbers::pi);
  EXPECT_EQ(t["H1_im"][1], 3);
  EXPECT_EQ(t.rows(), 2);
  EXPECT_THAT(error_of([&] { (void)t.at("phase"); }), HasSubstr("present: speed, amp, H1_re, H1_im"));
}

TEST(Csv, StreamGivesBlocksInConstantMemory) {
  std::string text = "t_s,x_m\n";
  for (int i = 0; i < 1000; ++i) text += fmt::format("{},{}\n", i, 2 * i);
  CsvStream s(text, "a.csv");
  Eigen::MatrixXd block(300, 2);
  Eigen::Index rows = 0;
  while (const Eigen::Index n = s.next(block)) {
    EXPECT_EQ(block(n - 1, 1), 2.0 * static_cast<double>(rows + n - 1));
    rows += n;
  }
  EXPECT_EQ(rows, 1000);
}

TEST(Csv, DamagedGzipIsRefused) {
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "c.csv.gz";
  Recording r;
  r.dt = 1;
  r.add("x", Quantity::force, Eigen::VectorXd::Random(1000));
  write_csv(file, r);
  std::string bytes;
  {
    std::FILE* f = std::fopen(file.c_str(), "rb");
    bytes.resize(std::filesystem::file_size(file));
    ASSERT_EQ(std::fread(bytes.data(), 1, bytes.size(), f), bytes.size());
    std::fclose(f);
  }
  EXPECT_EQ(parse_csv(bytes, "c.csv.gz")["x"], r["x"]);
  EXPECT_THAT(error_of_csv(bytes.substr(0, bytes.size() / 2)), HasSubstr("gzip data are cut off"));
  std::string bad = bytes;
  bad[bytes.size() / 2] = static_cast<char>(bad[bytes.size() / 2] ^ 0x55);
  EXPECT_NE(error_of_csv(bad), "no error");
  EXPECT_THAT(error_of_csv(bytes + "x"), HasSubstr("bytes after the end"));
}

TEST(CsvReference, ReadsTheMeasuredFiles) {
  const auto silverbox = testing::data_file("silverbox/SNLS80mV.csv");
  WHIRL_REQUIRE_DATA(silverbox);
  const Recording s = read_csv(silverbox, {.rate = 1e7 / 16384, .columns = {"V1:u_V", "V2:y_V"}});
  EXPECT_EQ(s.size(), 131072);
  EXPECT_EQ(s["u"][0], 0.0057756);
  EXPECT_EQ(s["y"][131071], -0.0072247);
  const Recording hammer = read_csv(testing::data_file("modal/hammer_raw.csv.gz"));
  EXPECT_EQ(hammer.size(), 50030);
  EXPECT_EQ(hammer.dt, 2e-5);
  EXPECT_EQ(hammer["acc"][0], -0.007387 * 9.80665);
  const Table bode = read_table(testing::data_file("rk4_runup/runup_bode_1037_2110rpm.csv"));
  EXPECT_EQ(bode.rows(), 124);
  EXPECT_NEAR(bode["speed"][0] * 60 / (2 * std::numbers::pi), 1037.129, 1e-12);
  EXPECT_DOUBLE_EQ(bode["amp_1x"][0], 1.67125e-6);
  const Table frf = read_table(testing::data_file("modal/building9.csv.gz"));
  EXPECT_EQ(frf.columns.size(), 19u);
  EXPECT_EQ(frf.rows(), 1601);
}

}  // namespace
}  // namespace whirl::io
