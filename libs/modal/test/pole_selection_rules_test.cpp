// Which poles of a stabilisation diagram are one: diagrams written down pole by pole, on either side of each limit.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "whirl/modal/poles.hpp"

namespace whirl::modal {
namespace {

using Complex = std::complex<double>;

StabilisationPole pole_of(int order, double hertz, double damping,
                          Eigen::VectorXcd participation = Eigen::VectorXcd::Ones(1)) {
  StabilisationPole p;
  p.order = order;
  const double size = 2 * std::numbers::pi * hertz;
  p.pole = size * Complex(-damping, std::sqrt(1 - damping * damping));
  p.participation = std::move(participation);
  p.stable_frequency = p.stable_damping = p.stable_vector = true;
  return p;
}

std::vector<PoleCluster> selected(std::vector<StabilisationPole> poles, const PoleOptions& options,
                                  StabilisationDiagram* left = nullptr) {
  StabilisationDiagram d;
  for (const StabilisationPole& p : poles)
    if (std::find(d.orders.begin(), d.orders.end(), p.order) == d.orders.end()) d.orders.push_back(p.order);
  d.poles = std::move(poles);
  const std::vector<PoleCluster> found = select_poles(d, options);
  if (left != nullptr) *left = d;
  return found;
}

/// In all orders.
PoleOptions throughout() {
  PoleOptions o;
  o.presence = 1;
  return o;
}

// Distances by frequency and by three times the tolerance of the damping, as legs of a triangle: below 1 they are one.
TEST(PoleSelectionRules, ANearPoleOfAnotherOrderIsTheSame) {
  PoleOptions o = throughout();
  const auto one = [&](double frequency, double damping) {
    return selected({pole_of(8, 20, 0.01), pole_of(9, 20 * (1 + frequency), 0.01 * std::exp(damping))}, o).size() == 1;
  };
  EXPECT_TRUE(one(0.0024, 0));
  EXPECT_FALSE(one(0.0026, 0));
  EXPECT_TRUE(one(0.00174, 0.21)) << "0.696 and 0.7";
  EXPECT_TRUE(one(0.00174, -0.21));
  o.min_mac = 1.1;  // never merged
  EXPECT_FALSE(one(0, 0));
  o.min_mac = 0;
  o.frequency_tolerance = 1e-3;
  EXPECT_FALSE(one(0.0012, 0));
}

// The first pole of an order that is near enough takes its place in the cluster.
TEST(PoleSelectionRules, DampingTellsPolesOfOneFrequencyApart) {
  const auto taken = [](double frequency, double damping) {
    StabilisationDiagram left;
    const double hertz = 20 * (1 + frequency);
    EXPECT_EQ(
        selected({pole_of(8, 20, 0.01), pole_of(9, hertz, 0.01 * std::exp(damping)), pole_of(9, 1.00001 * hertz, 0.01)},
                 throughout(), &left)
            .size(),
        1u);
    EXPECT_NE(left.poles[1].cluster, left.poles[2].cluster);
    return left.poles[1].cluster == 0;
  };
  for (const double sign : {1.0, -1.0}) {
    EXPECT_TRUE(taken(0, sign * 0.29));
    EXPECT_FALSE(taken(0, sign * 0.31));
    EXPECT_TRUE(taken(0.00174, sign * 0.21));
    EXPECT_FALSE(taken(0.00174, sign * 0.22));
  }
}

TEST(PoleSelectionRules, TheParticipationMustBeAlikeByAtLeastTheLimit) {
  PoleOptions o = throughout();
  const Eigen::VectorXcd along = Eigen::Vector2cd(1, 0), between = Eigen::Vector2cd(1, 1);  // MAC 1/2
  const auto count = [&](double limit) {
    o.min_mac = limit;
    return selected({pole_of(8, 20, 0.01, along), pole_of(9, 20, 0.01, between)}, o).size();
  };
  EXPECT_EQ(count(0.5), 1u);
  EXPECT_EQ(count(0.51), 0u);
  // It joins at once, before another of its order that is more alike.
  o.min_mac = 0.5;
  StabilisationDiagram left;
  selected({pole_of(8, 20, 0.01, along), pole_of(9, 20, 0.01, between), pole_of(9, 20.0001, 0.01, along)}, o, &left);
  EXPECT_EQ(left.poles[1].cluster, 0);
  EXPECT_EQ(left.poles[2].cluster, -1);
}

TEST(PoleSelectionRules, AnOrderHasAPoleOnce) {
  const auto found = selected(
      {pole_of(8, 20, 0.01), pole_of(8, 20.001, 0.01), pole_of(9, 20, 0.01), pole_of(9, 20.001, 0.01)}, throughout());
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].orders, 2);
  EXPECT_EQ(found[1].orders, 2);
}

TEST(PoleSelectionRules, PolesThatAreNotStableAreNone) {
  for (bool StabilisationPole::*stable :
       {&StabilisationPole::stable_frequency, &StabilisationPole::stable_damping, &StabilisationPole::stable_vector}) {
    StabilisationPole p = pole_of(9, 20, 0.01);
    p.*stable = false;
    EXPECT_TRUE(selected({pole_of(8, 20, 0.01), p}, throughout()).empty());
  }
}

// Of five and more, what lies 1.5 interquartile ranges and 2e-5 of the frequency (2 % of the damping) outside leaves.
TEST(PoleSelectionRules, StragglersOfATightClusterLeave) {
  const auto members = [](std::vector<double> frequencies, std::vector<double> dampings) {
    std::vector<StabilisationPole> poles;
    for (std::size_t i = 0; i < frequencies.size(); ++i)
      poles.push_back(pole_of(8 + static_cast<int>(i), 20 * (1 + frequencies[i]), 0.01 * std::exp(dampings[i])));
    PoleOptions o;
    o.presence = 0.01;
    StabilisationDiagram left;
    const auto found = selected(poles, o, &left);
    EXPECT_EQ(found.size(), 1u);
    int kept = 0;
    for (const StabilisationPole& p : left.poles) kept += p.cluster == 0;
    EXPECT_EQ(kept, found.front().orders);
    return kept;
  };
  const std::vector<double> same(5, 0.0);
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(members({0, 0, 0, 0, sign * 1.8e-5}, same), 5);
    EXPECT_EQ(members({0, 0, 0, 0, sign * 2.2e-5}, same), 4);
    EXPECT_EQ(members({0, 0, 0, sign * 2.2e-5}, same), 4) << "of four nobody leaves";
    EXPECT_EQ(members(same, {0, 0, 0, 0, sign * 0.019}), 5);
    EXPECT_EQ(members(same, {0, 0, 0, 0, sign * 0.021}), 4);
    // Quartiles 0 and 1e-4: 1.5e-4 and 2e-5 beyond them.
    const double e = sign * 1e-4;
    EXPECT_EQ(members({0, 0, e, e, 2.65 * e}, same), 5);
    EXPECT_EQ(members({0, 0, e, e, 2.75 * e}, same), 4);
    EXPECT_EQ(members(same, {0, 0, sign * 0.05, sign * 0.05, sign * 0.143}), 5);
    EXPECT_EQ(members(same, {0, 0, sign * 0.05, sign * 0.05, sign * 0.147}), 4);
  }
}

TEST(PoleSelectionRules, ClustersAtOnePlaceThatShareNoOrderAreOne) {
  const Eigen::VectorXcd along = Eigen::Vector2cd(1, 0), across = Eigen::Vector2cd(0, 1);
  PoleOptions o;
  const auto count = [&](double apart, int second, const Eigen::VectorXcd& participation) {
    o.presence = 2.0 / 3;
    return selected(
        {pole_of(8, 20, 0.01, along), pole_of(9, 20, 0.01, along),
         pole_of(second, 20 * (1 + apart), 0.05, participation), pole_of(11, 20 * (1 + apart), 0.05, participation)},
        o);
  };
  auto found = count(0.002, 10, along);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].orders, 4);
  EXPECT_TRUE(count(0.003, 10, along).empty()) << "too far apart: two of two orders of four each";
  EXPECT_TRUE(count(0.002, 10, across).empty()) << "other shapes";
  found = count(0.002, 9, along);  // both have order 9
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].orders, 2);
}

TEST(PoleSelectionRules, AClusterIsTheMedianOfItsMembersInTheirOrder) {
  const Eigen::VectorXcd one = Eigen::Vector2cd(1, 0.1), two = Eigen::Vector2cd(1, 0.2),
                         three = Eigen::Vector2cd(1, 0.3);
  StabilisationDiagram left;
  const auto found =
      selected({pole_of(8, 50, 0.02), pole_of(8, 20, 0.01, one), pole_of(9, 50, 0.02), pole_of(9, 20.01, 0.0104, two),
                pole_of(10, 50, 0.02), pole_of(10, 20.03, 0.0101, three), pole_of(10, 80, 0.01)},
               throughout(), &left);
  ASSERT_EQ(found.size(), 2u);
  const std::vector<Complex> members = {left.poles[1].pole, left.poles[3].pole, left.poles[5].pole};
  EXPECT_EQ(found[0].pole.real(), members[2].real());
  EXPECT_EQ(found[0].pole.imag(), members[1].imag());
  EXPECT_EQ(found[0].participation, two) << "of the member nearest to the median";
  // Deviations 0.01, 0 and 0.02 Hz; of the dampings 0.0001, 0.0003 and 0.
  EXPECT_NEAR(found[0].frequency_spread, 0.01, 2e-4);
  EXPECT_NEAR(found[0].damping_spread, 0.0001, 2e-5);
  EXPECT_NEAR(std::abs(found[1].pole), 100 * std::numbers::pi, 1e-9);
  const int numbers[] = {1, 0, 1, 0, 1, 0, -1};
  for (std::size_t i = 0; i < 7; ++i) EXPECT_EQ(left.poles[i].cluster, numbers[i]) << i;
}

TEST(PoleSelectionRules, AClusterStandsInItsShareOfTheOrders) {
  PoleOptions o;
  o.presence = 0.5;
  const auto found =
      selected({pole_of(8, 20, 0.01), pole_of(9, 20, 0.01), pole_of(10, 50, 0.01), pole_of(11, 80, 0.01)}, o);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(std::abs(found[0].pole), 40 * std::numbers::pi, 1e-9);
}

}  // namespace
}  // namespace whirl::modal
