#include "whirl/core/finding.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "whirl/core/summary.hpp"

namespace whirl {
namespace {

Finding missed(double rmse) {
  return {
      FindingCode::held_out_missed, Consequence::no_trust, {{"rmse", rmse, "m"}, {"noise", 1e-6, "m"}}, "x of run 2"};
}

TEST(FindingUnit, EveryCodeHasItsOwnNameAndWords) {
  std::set<std::string_view> names;
  std::set<std::string> texts;
  for (int k = 0; k <= static_cast<int>(FindingCode::sliding_bound_missed); ++k) {
    const auto code = static_cast<FindingCode>(k);
    names.insert(to_string(code));
    texts.insert(text({code, Consequence::warning, {}, "somewhere"}));
  }
  EXPECT_EQ(names.size(), static_cast<std::size_t>(FindingCode::sliding_bound_missed) + 1);
  EXPECT_EQ(texts.size(), names.size());
  EXPECT_FALSE(texts.contains(""));
}

TEST(FindingUnit, AmountsAreReadByNameAndAMissingOneIsNoNumber) {
  EXPECT_EQ(missed(3e-6).amount("rmse"), 3e-6);
  EXPECT_TRUE(std::isnan(missed(3e-6).amount("share")));
  EXPECT_THAT(text(missed(3e-6)), testing::HasSubstr("x of run 2 with an error of 3e-06 rms, 3.0 times the noise"));
}

TEST(FindingUnit, TextsHoldTheirNumbersInTheUnitsTheyName) {
  struct Case {
    FindingCode code;
    std::vector<Amount> amounts;
    const char* part;
  };
  using enum FindingCode;
  const std::vector<Case> cases = {
      {motion_unexplained, {{"share", 0.31}}, "31 % of the motion"},
      {model_error, {{"chi_square", 2.5}}, "chi-square 2.50"},
      {held_out_not_predicted, {{"share", 0.42}}, "error 42 % of the motion"},
      {parameter_differs,
       {{"all", 12.5}, {"rest", 13.25}, {"deviations", 4.2}},
       "12.5 by all records and 13.25 without"},
      {parameter_differs, {{"all", 12.5}, {"rest", 13.25}, {"deviations", 4.2}}, "4.2 standard deviations apart"},
      {parameter_differs,
       {{"model", 1e-6, "m"}, {"record", -2.5e-5, "m"}, {"deviations", 40}},
       "-25 um in this record and 1 um in the model, 40.0 standard"},
      {parameter_differs,
       {{"model", 0.5, "m/s^2"}, {"record", 0.75, "m/s^2"}, {"deviations", 40}},
       "0.75 m/s^2 in this record and 0.5 m/s^2"},
      {parts_differ, {{"deviations", 5.1}}, "5.1 standard deviations apart"},
      {term_too_large, {{"ratio", 7.5}}, "7.5 times what"},
      {inertia_impossible, {{"polar_ratio", 2.75}}, "polar_ratio is 2.75"},
      {work_limit, {{"steps", 480}}, "limit of work (steps 480)"},
      {part_left_out, {{"k3", 1.5e8, "N/m^3"}}, "(k3 1.5e+08 N/m^3)"},
      {held_out_cannot_check, {{"instant", 2.25}}, "the change at 2.25 s"},
      {held_out_cannot_check, {{"frequency", 17.5}, {"low", 3}, {"high", 9}}, "17.5 Hz"},
      {held_out_cannot_check, {{"frequency", 17.5}, {"low", 3}, {"high", 9}}, "turn at 3 to 9 Hz"},
      {held_out_cannot_check, {{"frequency", 17}, {"low", 3}, {"high", 9}, {"share", 0.06}}, "show 6 % of the largest"},
      {freedom_spent, {{"spare", 0}}, "no spare run"},
      {freedom_spent, {{"spare", 1}}, "1 spare run to"},
      {freedom_spent, {{"spare", 2}}, "2 spare runs to"},
      {option_not_taken, {{"spare", 1}}, "leave 1 spare run;"},
      {not_repeatable, {{"share", 0.08}}, "differ by 8 % of the reading"},
      {requirement_missed, {{"value", 4.5, "um"}, {"most", 3, "um"}}, "4.5 um: must be at most 3 um"},
      {requirement_missed, {{"value", 0.25}, {"least", 0.5}}, "0.25: must be at least 0.5"},
      {requirement_missed, {{"value", 4.0004}, {"most", 4}}, "4.0004: must be at most 4"},
      {sliding_bound_missed,
       {{"switching gain", 2}, {"disturbance", 3.5}},
       "gain 2 m/s^2, disturbance up to 3.5 m/s^2"}};
  for (const Case& c : cases)
    EXPECT_THAT(text({c.code, Consequence::warning, c.amounts, "run 2"}), testing::HasSubstr(c.part));
}

TEST(FindingUnit, ConsequencesSetStatusAndTrust) {
  Summary s;
  s.add({FindingCode::model_error, Consequence::warning, {{"chi_square", 1.5}}});
  EXPECT_EQ(s.status, Status::warning);
  EXPECT_EQ(s.trust, "");
  EXPECT_EQ(s.distrust(), nullptr);
  s.add(missed(3e-6));
  EXPECT_EQ(s.status, Status::warning);
  EXPECT_THAT(s.trust, testing::HasSubstr("Do not trust"));
  ASSERT_NE(s.distrust(), nullptr);
  EXPECT_EQ(s.distrust()->code, FindingCode::held_out_missed);
  s.add({FindingCode::held_out_diverges, Consequence::unusable, {}, "run 2"});
  EXPECT_EQ(s.status, Status::unusable);
  EXPECT_EQ(s.trust, "Do not use this model.");
  s.add(missed(3e-6));
  EXPECT_EQ(s.trust, "Do not use this model.") << "what is unusable stays so";
  EXPECT_EQ(s.warnings.size(), s.findings.size());
  EXPECT_EQ(s.find(FindingCode::parts_differ), nullptr);
}

TEST(FindingUnit, TheReasonIsWhatFailedWhateverIsSaidAfterIt) {
  Summary s;
  s.warn("short record");
  EXPECT_EQ(s.reason, "");
  s.fail("no passage");
  s.warn("few samples");
  s.add(missed(3e-6));
  EXPECT_EQ(s.reason, "no passage");

  Summary whole;
  whole.take(s);
  whole.warn("another part is short");
  EXPECT_EQ(whole.status, Status::unusable);
  EXPECT_EQ(whole.reason, "no passage");
  EXPECT_EQ(whole.warnings.size(), 5u);

  Summary sound;
  sound.take({});
  EXPECT_EQ(sound.status, Status::ok);
  Summary doubtful;
  doubtful.warn("short record");
  sound.take(doubtful);
  EXPECT_EQ(sound.status, Status::warning);
  EXPECT_EQ(sound.reason, "");
}

}  // namespace
}  // namespace whirl
