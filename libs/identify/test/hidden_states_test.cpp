#include "whirl/identify/hidden_states.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/hidden_systems.hpp"

namespace whirl::identification {
namespace {

const EquationTerm* term(const IdentifiedModel& model, const std::string& lhs, const std::string& function) {
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (e.lhs == lhs && t.function == function) return &t;
    }
  }
  return nullptr;
}

SindyOptions second_order(const char* state, std::vector<std::string> library) {
  SindyOptions o;
  o.states = {state};
  o.inputs = {"u"};
  o.order = 2;
  o.library = std::move(library);
  o.hidden = 1;
  o.timing.find = false;
  return o;
}

// The published hysteretic benchmark from noise-free records of its equations: free runs of other signals below 1e-5 m.
TEST(HiddenStateReference, BoucWenIsPredictedTo1e5) {
  const Recording train = testing::bouc_wen_record(5000, 50, 3);
  const IdentifiedModel model = fit_hidden({train}, second_order("y", {"1", "y", "y'", "u", "y^3"}));
  ASSERT_NE(model.summary.status, Status::unusable) << model.summary.warnings.back();
  ASSERT_EQ(model.states.size(), 3u) << model.summary.trust;
  for (const double low : {5.0, 20.0}) {
    const Recording other = testing::bouc_wen_record(4000, 40, 77, low, low == 5 ? 150 : 50);
    EXPECT_LT(score(model, other).front().rmse, 1e-5) << low;
  }
}

TEST(HiddenStateProperty, LagOfAnActuatorIsFound) {
  const double rate = 25;
  const Recording train = testing::lagging_actuator_record(4000, rate, 0.005, 5);
  std::vector<HiddenTrial> trials;
  const IdentifiedModel model = fit_hidden({train}, second_order("x", {"1", "x", "x'", "x^2", "x^3", "u"}), &trials);
  ASSERT_EQ(model.states.size(), 3u) << model.summary.trust;
  const EquationTerm* lag = term(model, "h1'", "-h1 + u");
  ASSERT_NE(lag, nullptr);
  EXPECT_NEAR(lag->coefficient.value, rate, 0.02 * rate);
  const Recording other = testing::lagging_actuator_record(3000, rate, 0.005, 6);
  const StateScore s = score(model, other).front();
  EXPECT_LT(s.nrmse, 1.2 * 0.005);
}

// The whole identification, with its collinear terms and verdict, not the fit alone.
TEST(HiddenStateProperty, AModelWithAHiddenStateIsJudgedLikeOthers) {
  IdentifyOptions options;
  options.method = Method::sindy;
  options.holdout = 0;
  options.sindy = second_order("x", {"x", "x'", "x^3"});
  const Identification found = identify(testing::lagging_actuator_record(2500, 25, 0.002, 9), options);
  ASSERT_TRUE(found.usable()) << found.summary.warnings.back();
  ASSERT_EQ(found.model.states.size(), 3u) << found.summary.trust;
  EXPECT_LT(score(found.model, testing::lagging_actuator_record(2500, 25, 0.002, 10)).front().nrmse, 0.004);
}

// Nothing hidden: none is found.
TEST(HiddenStateProperty, NoneWhereThereIsNone) {
  Recording fast = testing::lagging_actuator_record(3000, 20000, 0.01, 8);
  const IdentifiedModel model = fit_hidden({fast}, second_order("x", {"1", "x", "x'", "x^3", "u"}));
  EXPECT_EQ(model.states.size(), 2u) << model.summary.trust;
}

}  // namespace
}  // namespace whirl::identification
