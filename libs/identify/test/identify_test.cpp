#include "whirl/identify/identify.hpp"

#include <gtest/gtest.h>

#include "rotor_synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify_json.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;

Recording run_down(unsigned seed) {
  const Sweep sweep;
  return recording(with_noise(motion(rotor_a(), sweep), 20, seed), sweep);
}

TEST(Identify, OneCallGivesModelEvidenceAndVerdict) {
  const identification::Identification id = identification::identify(run_down(1));
  ASSERT_TRUE(id.usable());
  ASSERT_TRUE(id.model.rotor);
  EXPECT_EQ(id.model.method, "weak");
  EXPECT_LT(std::abs(model_error(*id.model.rotor, rotor_a()).k1), 0.1);
  ASSERT_EQ(id.evidence.held_out.scores.size(), 2u);
  EXPECT_LT(identification::worst_nrmse(id.evidence.held_out.scores), 0.3);
  EXPECT_EQ(id.summary.warnings, id.model.summary.warnings);
  const io::Json document = to_json(id);
  EXPECT_NE(document.find("evidence"), nullptr);
}

TEST(Identify, MethodFollowsTheChannelsAndTheQuestion) {
  const Recording rotor = run_down(2);
  identification::IdentifyOptions o;
  EXPECT_EQ(o.chosen(rotor), identification::Method::weak);
  o.sindy.states = {"x"};
  EXPECT_EQ(o.chosen(rotor), identification::Method::sindy);
  Recording plain;
  plain.dt = 0.01;
  plain.add("u", Quantity::dimensionless, Eigen::VectorXd::Ones(100));
  EXPECT_EQ(identification::IdentifyOptions{}.chosen(plain), identification::Method::sindy);
  EXPECT_THROW(identification::method_of("guess"), Error);
}

TEST(Identify, ARecordThatDoesNotMoveIsUnusableAndSaysWhy) {
  Recording still = run_down(3);
  for (Channel& c : still.channels) {
    if (c.name == "x") c.samples.setZero();
  }
  const identification::Identification id = identification::identify(still);
  EXPECT_FALSE(id.usable());
  ASSERT_FALSE(id.summary.warnings.empty());
  EXPECT_TRUE(id.evidence.held_out.scores.empty());
}

TEST(Identify, OptionsOutOfRangeAreRefused) {
  identification::IdentifyOptions o;
  o.holdout = 0.9;
  EXPECT_THROW(identification::identify(run_down(4), o), Error);
  EXPECT_THROW(identification::identify(std::vector<Recording>{}), Error);
  o.holdout = 0.3;
  o.method = identification::Method::paper;
  EXPECT_THROW(identification::identify({run_down(4), run_down(5)}, o), Error);
}

TEST(Validate, OneCallJudgesEveryRecord) {
  const identification::Identification id = identification::identify(run_down(1));
  const identification::ValidationReport report = identification::validate(id.model, {run_down(7), run_down(8)});
  ASSERT_EQ(report.runs.size(), 2u);
  ASSERT_TRUE(report.runs[1].rotor);
  EXPECT_NE(report.summary.status, Status::unusable);
  EXPECT_THROW(identification::validate(id.model, {run_down(7), run_down(8)}, {}, {run_down(7)}), Error);
}

}  // namespace
