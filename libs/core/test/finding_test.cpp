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

}  // namespace
}  // namespace whirl
