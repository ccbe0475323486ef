#include "whirl/core/recording.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "whirl/core/error.hpp"

namespace whirl {
namespace {

Recording two_channels() {
  Recording r;
  r.dt = 1e-3;
  r.source = "a.csv";
  r.add("x", Quantity::displacement, Eigen::VectorXd::LinSpaced(4, 0, 3));
  r.add("y", Quantity::displacement, Eigen::VectorXd::Zero(4));
  return r;
}

TEST(Recording, GivesChannelsByNameAndNamesThePresentOnesOtherwise) {
  const Recording r = two_channels();
  EXPECT_EQ(r["x"][3], 3);
  EXPECT_DOUBLE_EQ(r.times()[3], 3e-3);
  try {
    (void)r.at("beta");
    FAIL();
  } catch (const Error& e) {
    EXPECT_STREQ(e.what(), "a.csv: no channel 'beta'; present: x, y");
  }
}

TEST(Recording, CheckRefusesNonFiniteSamplesAndUnequalLengths) {
  Recording r = two_channels();
  EXPECT_NO_THROW(r.check());
  r.channels[1].samples[2] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(r.check(), Error);
  r = two_channels();
  r.channels[1].samples.conservativeResize(3);
  EXPECT_THROW(r.check(), Error);
}

}  // namespace
}  // namespace whirl
