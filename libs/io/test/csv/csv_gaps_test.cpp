#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/remarks.hpp"

namespace whirl::io {
namespace {

Recording read(const std::string& text, std::vector<std::string>* remarks = nullptr) {
  CsvOptions options;
  options.gaps = true;
  const RemarkHandler before = set_remark_handler([&](const std::string&, const std::string& said, RemarkCode) {
    if (remarks != nullptr) remarks->push_back(said);
  });
  struct Restore {
    const RemarkHandler& handler;
    ~Restore() { set_remark_handler(handler); }
  } restore{before};
  return parse_csv(text, "a.csv", options);
}

TEST(CsvGaps, EmptyCellsAndWordsForNothingAreNaNAndAllElseIsRefusedAsBefore) {
  const Recording r = read("t_s,x_mm,y_mm\n0,1,2\n0.1,,3\n0.2,NaN,4\n0.3,na,\n0.4,5,6\n");
  EXPECT_TRUE(std::isnan(r["x"][1]) && std::isnan(r["x"][2]) && std::isnan(r["x"][3]));
  EXPECT_TRUE(std::isnan(r["y"][3]));
  EXPECT_DOUBLE_EQ(r["x"][4], 5e-3);
  EXPECT_DOUBLE_EQ(r["y"][2], 4e-3);
  for (const char* bad :
       {"t_s,x_mm\n0,1\n0.1,inf\n0.2,2\n", "t_s,x_mm\n0,1\n,2\n0.2,2\n", "t_s,x_mm\n0,1\nnan,2\n0.2,2\n",
        "t_s,x_mm\n0,1\n0.1,off\n0.2,2\n", "t_s,x_mm\n0,1\n0.2,2\n0.1,2\n"}) {
    EXPECT_THROW(read(bad), Error) << bad;
  }
  EXPECT_THROW(parse_csv("t_s,x_mm\n0,1\n0.1,\n0.2,2\n", "a.csv"), Error);  // without the option
}

TEST(CsvGaps, LostLinesBecomeNaNOnTheSameGrid) {
  std::string text = "t_s,x_mm\n";
  for (int i = 0; i < 100; ++i) {
    if (i < 40 || i > 52) text += fmt::format("{:.3f},{}\n", 2 + 0.01 * i, i);
  }
  std::vector<std::string> remarks;
  const Recording r = read(text, &remarks);
  ASSERT_EQ(r.size(), 100);
  EXPECT_NEAR(r.dt, 0.01, 1e-12);
  EXPECT_NEAR(r.t0, 2, 1e-9);
  for (int i = 0; i < 100; ++i) {
    if (i < 40 || i > 52) {
      EXPECT_DOUBLE_EQ(r["x"][i], 1e-3 * i);
    } else {
      EXPECT_TRUE(std::isnan(r["x"][i]));
    }
  }
  EXPECT_THAT(remarks, ::testing::ElementsAre("13 samples are missing between the times"));
}

TEST(CsvGaps, AChangeOfTheSampleRateIsRefused) {
  std::string text = "t_s,x_mm\n";
  for (int i = 0; i < 200; ++i) {
    if (i < 100 || i % 2 == 0) text += fmt::format("{:.3f},{}\n", 0.01 * i, i);
  }
  EXPECT_THROW(read(text), Error);
}

/// What reading says of lines with these times, a hundred a second unless changed; empty where it reads.
std::string refusal(const std::function<double(int)>& time) {
  std::string text = "t_s,x_mm\n";
  for (int i = 0; i < 100; ++i) text += fmt::format("{},{}\n", time(i), i % 7);
  try {
    const Recording r = read(text);
    EXPECT_LT(r.size(), 1100);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(CsvGaps, TimesThatCannotBeAreRefusedByLineAndTime) {
  using ::testing::HasSubstr;
  const auto even = [](int i) { return 0.01 * i; };
  // One far time stamp: the grid would have no bound.
  for (const double far : {1e2, 1e6, 1e9, 1e300}) {
    for (const int at : {1, 60, 99}) {
      if (far > 1e15 && at < 99) continue;  // digits too few for steps
      const std::string said = refusal([&](int i) { return even(i) + (i >= at ? far : 0); });
      EXPECT_THAT(said, HasSubstr(fmt::format("a.csv:{}", at + 2))) << far;
      EXPECT_THAT(said, HasSubstr(fmt::format("{:.9g} s", even(at) + far))) << far << " at " << at;
    }
    // Forth and back again: the first line that goes back.
    EXPECT_THAT(refusal([&](int i) { return even(i) + (i == 50 ? far : 0); }), HasSubstr("a.csv:53")) << far;
  }
  EXPECT_THAT(refusal([](int) { return 4.5; }), HasSubstr("a.csv:3"));                                    // constant
  EXPECT_THAT(refusal([&](int i) { return even(99 - i); }), HasSubstr("a.csv:3"));                        // reversed
  EXPECT_THAT(refusal([&](int i) { return even(i == 40 ? 39 : i); }), HasSubstr("a.csv:42"));             // duplicate
  EXPECT_THAT(refusal([&](int i) { return i < 70 ? even(i) : even(i - 70); }), HasSubstr("a.csv:72"));    // restarted
  EXPECT_THAT(refusal([&](int i) { return 0.01 * (i / 2); }), HasSubstr("a.csv:3"));                      // in pairs
  EXPECT_THAT(refusal([&](int i) { return 0.01 * (i / 2) + (i % 2) * 1e-9; }), HasSubstr("wrong time"));  // nearly
  EXPECT_THAT(refusal([](int i) { return (i - 50) * 3e306; }), HasSubstr("step"));                        // overflow
  EXPECT_THAT(refusal([](int i) { return i * 1e-315; }), HasSubstr("step"));                              // underflow
  // A hole of half the record is a hole.
  EXPECT_EQ(refusal([&](int i) { return even(i) + (i >= 50 ? 1 : 0); }), "");
  EXPECT_EQ(refusal([&](int i) { return even(i) + (i >= 50 ? 8.9 : 0); }), "");
}

TEST(CsvGapsProperty, UnevenTimesGiveTheCurveOnAnEvenGrid) {
  const auto curve = [](double t) { return std::sin(6 * t) + 0.3 * std::cos(17 * t); };
  std::string text = "t_s,x_m\n";
  double t = 0;
  for (int i = 0; i < 2000; ++i) {
    text += fmt::format("{:.9f},{:.12g}\n", t, curve(t));
    t = 0.005 * (i + 1) + 0.0015 * std::sin(1.7 * i) + (i >= 1200 ? 0.1 : 0);  // and a hole of 0.1 s
  }
  std::vector<std::string> remarks;
  const Recording r = read(text, &remarks);
  ASSERT_EQ(remarks.size(), 1u);
  EXPECT_THAT(remarks[0], ::testing::HasSubstr("not uniform"));
  EXPECT_NEAR(r.dt, 0.005, 1e-4);
  int missing = 0;
  for (Eigen::Index i = 20; i + 20 < r.size(); ++i) {
    const double at = r.t0 + r.dt * static_cast<double>(i);
    if (std::isnan(r["x"][i])) {
      ++missing;
    } else if (std::abs(at - 6.05) > 0.15) {  // splines end freely at the hole
      EXPECT_NEAR(r["x"][i], curve(at), 2e-5);
    }
  }
  EXPECT_NEAR(missing, 20, 2);
}

TEST(CsvGapsProperty, HolesBetweenUnevenTimesStayHolesHoweverMany) {
  std::mt19937_64 random(12);
  std::uniform_real_distribution<double> jitter(-0.0015, 0.0015), chance(0, 1);
  std::string text = "t_s,x_m\n";
  int lost = 0, slot = 0;
  for (int i = 0; i < 2000; ++i, ++slot) {
    if (i > 10 && chance(random) < 0.08) {  // 10 lines are lost after every twelfth
      slot += 10;
      lost += 10;
    }
    const double t = 0.005 * slot + (i > 0 ? jitter(random) : 0);
    text += fmt::format("{:.9f},{:.9g}\n", t, std::sin(6 * t));
  }
  std::vector<std::string> remarks;
  const Recording r = read(text, &remarks);
  EXPECT_NEAR(r.dt, 0.005, 1e-4);
  EXPECT_NEAR(static_cast<double>(r["x"].array().isNaN().count()), lost, 0.12 * lost);
}

TEST(CsvGapsProperty, AWrappedAngleAtUnevenTimesHasNoReadingInAWrap) {
  std::mt19937_64 random(13);
  std::uniform_real_distribution<double> jitter(-0.0003, 0.0003);
  const auto angle = [](double t) { return 100 * t + 8 * t * t; };
  std::string text = "t_s,x_m,beta_rad\n";
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.001 * i + (i > 0 ? jitter(random) : 0);
    text += fmt::format("{:.9f},{:.9g},{:.9g}\n", t, std::cos(angle(t)), std::fmod(angle(t), 2 * M_PI));
  }
  const Recording r = read(text);
  for (Eigen::Index i = 3; i + 3 < r.size(); ++i) {
    const double off = r["beta"][i] - angle(r.t0 + r.dt * static_cast<double>(i));
    EXPECT_NEAR(std::remainder(off, 2 * M_PI), 0, 1e-4) << i;
  }
}

}  // namespace
}  // namespace whirl::io
