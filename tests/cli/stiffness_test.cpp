#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "program.hpp"
#include "whirl/io/json.hpp"

namespace whirl::testing {
namespace {

// `whirl rig parameters`: K1 = 8500 N/m, split 2 % between x and y, coupling 40 N/m.
TEST(StiffnessE2e, PullsInThreeDirectionsGiveTheStiffAxisOfTheRig) {
  const Folder folder;
  for (const char* angle : {"0", "45", "90"}) {
    const Outcome pull = folder.whirl(std::string("rig stiffness --angle-deg ") + angle + " --seed 1" + angle +
                                      " --out p" + angle + ".csv");
    ASSERT_EQ(pull.exit_code, 0) << pull.err;
  }
  const Outcome fit = folder.whirl("stiffness p0.csv p45.csv p90.csv --angle-deg 0 45 90 --out pulls.json");
  ASSERT_EQ(fit.exit_code, 0) << fit.err;
  const io::Json document = io::load_json(folder / "pulls.json");
  const io::JsonReader in(document, "pulls.json");
  in.require_schema("whirl.anisotropic_stiffness", 1);
  const Estimate mean = io::read_estimate(in.at("mean")), amplitude = io::read_estimate(in.at("amplitude"));
  EXPECT_NEAR(mean.value, 8500, 4 * mean.sd);
  EXPECT_LT(mean.sd, 0.005 * 8500);
  EXPECT_NEAR(amplitude.value, std::hypot(170, 40), 4 * amplitude.sd);
  EXPECT_LT(in.at("p_value").number(), 0.01);
  // Its error is that of the amplitude, seen from the centre at twice the angle.
  EXPECT_NEAR(in.at("axis_deg").number(), 0.5 * std::atan2(40, 170) * 180 / std::numbers::pi,
              2 * amplitude.sd / amplitude.value * 180 / std::numbers::pi);

  const Outcome csv = folder.whirl("stiffness p0.csv");
  EXPECT_EQ(csv.exit_code, 0) << csv.err;
  for (const std::string other : {"p0.mat", "p0.uff", "p0.h5"}) {
    ASSERT_EQ(folder.whirl("convert p0.csv " + other + " --rate 1").exit_code, 0);
    const Outcome same = folder.whirl("stiffness " + other);
    EXPECT_EQ(same.out, csv.out) << same.err;
  }
  EXPECT_EQ(folder.whirl("stiffness p0.csv p45.csv").exit_code, 2) << "directions not stated";
  EXPECT_EQ(folder.whirl("stiffness p0.csv p90.csv --angle-deg 0 180").exit_code, 2) << "one direction twice";
  EXPECT_EQ(folder.whirl("stiffness p0.csv --angle-deg 0 90").exit_code, 2);
  EXPECT_EQ(folder.whirl("stiffness p0.csv p90.csv --angle-deg 0 nan").exit_code, 2);
  EXPECT_EQ(folder.whirl("rig stiffness --angle-deg nan --out q.csv").exit_code, 2);
  EXPECT_EQ(folder.whirl("rig hammer --angle-deg nan --out q_").exit_code, 2);
}

}  // namespace
}  // namespace whirl::testing
