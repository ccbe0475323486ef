#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "whirl/core/error.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {
namespace {

/// A circle, its second coordinate read at every `every`-th instant only.
Recording circle_read_at(int every) {
  Recording r;
  r.dt = 0.02;
  Eigen::VectorXd x(1000), v(1000);
  for (int i = 0; i < 1000; ++i) {
    x[i] = std::sin(0.1 * i);
    v[i] = i % every == 0 ? std::cos(0.1 * i) : std::numeric_limits<double>::quiet_NaN();
  }
  r.add("x", Quantity::dimensionless, x);
  r.add("v", Quantity::dimensionless, v);
  return r;
}

TEST(ChannelRates, TheChannelThatIsReadLessOftenIsNamed) {
  SindyOptions options;
  options.states = {"x", "v"};
  try {
    fit_sindy({circle_read_at(4)}, options);
    FAIL() << "three of four readings of v are missing";
  } catch (const Error& e) {
    const std::string said = e.what();
    EXPECT_NE(said.find("channel v has no reading at 75 %"), std::string::npos) << said;
    EXPECT_NE(said.find("slowest"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace whirl::identification
