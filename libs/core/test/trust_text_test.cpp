#include <gtest/gtest.h>

#include "whirl/core/finding.hpp"
#include "whirl/core/summary.hpp"

namespace whirl {
namespace {

// Whom a finding is about decides what must not be used.
TEST(TrustText, NamesTheControllerTheMassesOrTheModel) {
  const auto said = [](FindingCode code, Consequence consequence) {
    return trust_text({code, consequence, {{"value", 1}, {"least", 2}}, "gain"});
  };
  EXPECT_EQ(said(FindingCode::requirement_missed, Consequence::unusable), "Do not use this controller.");
  EXPECT_EQ(said(FindingCode::run_contradicted, Consequence::unusable), "Do not use these masses.");
  EXPECT_EQ(said(FindingCode::motion_unexplained, Consequence::unusable), "Do not use this model.");
  for (const FindingCode code : {FindingCode::requirement_missed, FindingCode::parts_differ, FindingCode::model_error})
    EXPECT_TRUE(said(code, Consequence::no_trust).starts_with("Do not trust this model beyond these records: "));
}

TEST(TrustText, AResultThatIsUnusableStaysSoWhateverComesAfter) {
  Summary s;
  s.add({FindingCode::motion_unexplained, Consequence::unusable});
  s.add({FindingCode::parts_differ, Consequence::no_trust});
  EXPECT_EQ(s.trust, "Do not use this model.");
  EXPECT_EQ(s.status, Status::unusable);
  s.add({FindingCode::parts_differ, Consequence::note});
  EXPECT_EQ(s.notes.size(), 1U);
  EXPECT_EQ(s.warnings.size(), 2U);
  Summary t;
  t.trust = "Trust it.";
  t.add({FindingCode::parts_differ, Consequence::warning});
  EXPECT_EQ(t.trust, "Trust it.");
  EXPECT_EQ(t.status, Status::warning);
  t.add({FindingCode::parts_differ, Consequence::no_trust});
  EXPECT_TRUE(t.trust.starts_with("Do not trust"));
}

TEST(TrustText, RequirementsSayLeastOrMostWithTheirUnit) {
  const auto said = [](std::vector<Amount> amounts) {
    return text({FindingCode::requirement_missed, Consequence::no_trust, std::move(amounts), "delay"});
  };
  EXPECT_EQ(said({{"value", 1, "s"}, {"least", 2}}), "delay 1 s: must be at least 2 s");
  EXPECT_EQ(said({{"value", 3}, {"most", 2}}), "delay 3: must be at most 2");
  EXPECT_EQ(said({}), "delay");
}

}  // namespace
}  // namespace whirl
