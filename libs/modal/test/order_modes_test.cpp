// Modes from the orders of a run-up, against a structure of known modes.
#include "whirl/modal/order_modes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "whirl/modal/poles.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/runup_orders.hpp"

namespace {

using whirl::modal::identify_orders;
using whirl::modal::OperationalModes;
using whirl::testing::make_runup_orders;

struct OrderScore {
  int found = 0, extra = 0, frequency = 0, damping = 0;
  double worst_mac = 1;
};

void add_order(const whirl::testing::RunupOrders& truth, const OperationalModes& found, OrderScore& score) {
  std::size_t matched = 0;
  for (std::size_t k = 0; k < truth.frequency.size(); ++k) {
    for (const auto& mode : found.modes) {
      const double df = std::abs(mode.frequency.value / truth.frequency[k] - 1);
      if (df > 0.005) continue;
      ++matched;
      ++score.found;
      score.frequency += mode.frequency.covers(truth.frequency[k]);
      score.damping += mode.damping.covers(truth.damping[k]);
      const Eigen::VectorXcd shape =
          Eigen::VectorXd::Map(truth.shape[k].data(), static_cast<Eigen::Index>(truth.shape[k].size()))
              .cast<std::complex<double>>();
      score.worst_mac = std::min(score.worst_mac, whirl::modal::mac(mode.shape, shape));
      break;
    }
  }
  score.extra += static_cast<int>(found.modes.size() - matched);
}

// Up and down at 9 rpm/s: 1X passes the three lower modes, 2X all of them but at twice the rate.
TEST(OrderModesProperty, RunUpsShowTheModesThatTheirOrdersPass) {
  OrderScore score;
  for (unsigned seed = 71; seed <= 76; ++seed) {
    const auto truth = make_runup_orders({.down = seed % 2 == 0, .structure = seed, .seed = seed});
    add_order(truth, identify_orders(truth.recording, {.orders = 2}), score);
  }
  EXPECT_GE(score.found, 19);
  EXPECT_LE(score.extra, 1);
  EXPECT_GT(score.worst_mac, 0.95);
  EXPECT_GE(score.frequency, score.found - 2);
  EXPECT_GE(score.damping, score.found - 5);
}

TEST(OrderModes, RecordsWithoutAnAngleOrAChangeOfSpeedAreRefused) {
  auto truth = make_runup_orders({.duration = 20, .speed_low = 30, .speed_high = 31, .structure = 76});
  EXPECT_THAT(whirl::testing::error_of([&] { (void)identify_orders(truth.recording); }),
              testing::HasSubstr("must change by a tenth"));
  truth.recording.channels.pop_back();
  EXPECT_THAT(whirl::testing::error_of([&] { (void)identify_orders(truth.recording); }),
              testing::HasSubstr("beta_rad"));
}

}  // namespace
