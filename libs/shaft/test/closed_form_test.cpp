// Rotors with a solution in closed form.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "rotors.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

constexpr double kPi = std::numbers::pi;

/// One mass on a massless shaft of stiffness k at its middle: coordinates (mass, support).
System kirk_gunter(double mass, double k, double k1, double c1) {
  System s;
  s.nodes = {0, 1};
  s.mass = testing::diagonal(mass, 0);
  s.gyroscopic = s.rotating = Eigen::Matrix2d::Zero();
  s.stiffness.resize(2, 2);
  s.stiffness << k, -k, -k, k;
  s.supports = {{"", Eigen::Vector2d(0, 1), {}, {{}, {testing::diagonal(k1, k1)}, {testing::diagonal(c1, c1)}, {}}}};
  s.unbalance = Eigen::Vector2cd(mass, 0);  // eccentricity 1
  s.bow = Eigen::Vector2cd::Zero();
  s.weight = Eigen::Vector2d(mass, 0);
  s.deflection = Eigen::Matrix2d::Identity();
  s.slope = Eigen::Matrix2d::Zero();
  s.bodies.resize(0, 2);
  return s;
}

/// Kirk and Gunter, J. Eng. Ind. 94, 1972: the least possible peak is 1 + 2 k1 / k.
TEST(ShaftReference, KirkGunterLeastPeak) {
  const double mass = 10, k = 1e6;
  const struct {
    double ratio, damping, peak, speed;
  } rows[] = {{0.5, 3375, 2, 258.20}, {1, 5162, 3, 273.86}, {2, 8437, 5, 288.68}};
  std::vector<double> speeds;
  for (int i = 0; i <= 4000; ++i) speeds.push_back(50 + 0.25 * i);
  for (const auto& row : rows) {
    const auto peak = [&](double c1) {
      const Response r = unbalance_response(kirk_gunter(mass, k, row.ratio * k, c1), speeds);
      Eigen::Index at = 0;
      const double size = r.x.row(0).cwiseAbs().maxCoeff(&at);
      return std::pair{size, speeds[static_cast<std::size_t>(at)]};
    };
    EXPECT_NEAR(peak(row.damping).first, row.peak, 1e-3 * row.peak);
    EXPECT_NEAR(peak(row.damping).second, row.speed, 5e-3 * row.speed);
    for (const double c1 : {0.5, 0.9, 1.1, 2.0}) EXPECT_GT(peak(c1 * row.damping).first, row.peak);
  }
}

/// Threshold w1 (1 + c_e / c_i) of a disc on a shaft whose damping c_i turns with it.
TEST(ShaftReference, ThresholdOfRotatingDamping) {
  System s = kirk_gunter(1, 0, 0, 0);
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
  s.nodes = {0};
  s.mass = one;
  s.gyroscopic = 0 * one;
  s.stiffness = 1e4 * one;
  s.rotating = one;
  s.supports = {{"", Eigen::VectorXd::Ones(1), {}, {{}, {testing::diagonal(0, 0)}, {testing::diagonal(2, 2)}, {}}}};
  s.unbalance = s.bow = Eigen::VectorXcd::Zero(1);
  s.weight = Eigen::VectorXd::Ones(1);
  s.deflection = one;
  s.slope = 0 * one;
  s.bodies.resize(0, 1);
  const auto found = stability_threshold(s, 1, 1000, 2);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->speed, 300, 1e-4);
  EXPECT_NEAR(found->frequency, 100, 1e-4);
  EXPECT_GT(found->direction, 0.99);
  EXPECT_FALSE(stability_threshold(s, 1, 299, 2));
}

/// Disc on a massless cantilever (Stodola 1924, Green 1948).
TEST(ShaftReference, StodolaGreenDisc) {
  Rotor r;
  r.materials = {{"steel", 2.1e11, 8e10, 1e-6}};
  r.shear.model = ShearModel::none;
  r.sections = {testing::round_section(0.5, 0.02, 0, 4)};
  r.discs = {{"disc", 0.5, 10, 0.05, 0.10}};
  r.supports = {testing::bearing_at(0, testing::diagonal(1e14, 1e14))};
  r.supports[0].tilt_stiffness = 1e10;
  const System s = assemble(r);
  const double still[] = {61.52704, 61.52704, 525.30166, 525.30166};
  const double turning[] = {40.90865, 81.07301, 258.51506, 1218.3507};
  const std::vector<Mode> at_rest = modes(s, 0, 4), at_speed = modes(s, 500, 4);
  for (std::size_t k = 0; k < 4; ++k) {
    EXPECT_NEAR(at_rest[k].frequency(), still[k], 1e-5 * still[k]);
    EXPECT_NEAR(at_speed[k].frequency(), turning[k], 1e-5 * turning[k]);
    EXPECT_NEAR(at_speed[k].direction, k % 2 == 0 ? -1 : 1, 1e-9);
  }
}

/// Roots of the quartic (rho r2 / kG)(w^4 - 2 W w^3) - w^2 (1 + r2 a^2 + E r2 a^2 / kG) + 2 W w r2 a^2 + E I a^4 / rho
/// A = 0 nearest to zero on either side, a = n pi / L, r2 = I / A; without shear kG is infinite and rotary inertia
/// stays.
double uniform_shaft_root(double kG, int n, double spin, double sign) {
  const double L = 1, d = 0.06, E = 2.1e11, rho = 7800, area = kPi * d * d / 4, I = kPi * std::pow(d, 4) / 64;
  const double r2 = I / area, a = n * kPi / L, q = kG > 0 ? rho * r2 / kG : 0, e = kG > 0 ? E * r2 * a * a / kG : 0;
  const auto f = [&](double w) {
    return q * (std::pow(w, 4) - 2 * spin * std::pow(w, 3)) - w * w * (1 + r2 * a * a + e) + 2 * spin * w * r2 * a * a +
           E * I * std::pow(a, 4) / (rho * area);
  };
  double low = 0, high = sign;
  while (f(high) > 0) high *= 1.1;
  for (int k = 0; k < 100; ++k) (f((low + high) / 2) > 0 ? low : high) = (low + high) / 2;
  return std::abs(low);
}

Rotor uniform_shaft(int elements, ShearModel shear, ElementKind kind) {
  Rotor r;
  r.materials = {{"steel", 2.1e11, 2.1e11 / 2.6, 7800}};
  r.shear.model = shear;
  r.element = kind;
  r.sections = {testing::round_section(1, 0.06, 0, elements)};
  for (const double z : {0.0, 1.0}) r.supports.push_back(testing::bearing_at(z, testing::diagonal(1e15, 1e15)));
  return r;
}

/// Observed order of the error of the third forward mode from 16 to 32 elements; printed for all meshes.
double observed_order(ShearModel shear, ElementKind kind) {
  const double spin = 1000, kG = shear == ShearModel::none ? 0 : shear_coefficient({shear}, 0.3, 0) * 2.1e11 / 2.6;
  const double exact = uniform_shaft_root(kG, 3, spin, 1);
  double before = 0, order = 0;
  for (const int n : {4, 8, 16, 32}) {
    const double found = modes(assemble(uniform_shaft(n, shear, kind)), spin, 6)[5].frequency();
    const double error = std::abs(found / exact - 1);
    order = std::log2(before / error);
    std::printf("  %d elements: %.6f rad/s, error %.2e, order %.2f\n", n, found, error, order);
    before = error;
  }
  return order;
}

TEST(ShaftConvergence, OrderFourWithAndWithoutShear) {
  EXPECT_NEAR(observed_order(ShearModel::none, ElementKind::internal_node), 4, 0.1);
  EXPECT_NEAR(observed_order(ShearModel::cowper, ElementKind::internal_node), 4, 0.1);
  EXPECT_NEAR(observed_order(ShearModel::cowper, ElementKind::usual), 2, 0.2);
}

TEST(ShaftReference, UniformTimoshenkoShaftWithGyroscopics) {
  const double printed[] = {762.65116, 767.02572, 3012.30838, 3029.04890, 6642.58636, 6677.69949};
  const double kG = shear_coefficient({ShearModel::cowper}, 0.3, 0) * 2.1e11 / 2.6;
  const std::vector<Mode> found =
      modes(assemble(uniform_shaft(32, ShearModel::cowper, ElementKind::internal_node)), 1000, 6);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(uniform_shaft_root(kG, static_cast<int>(k / 2) + 1, 1000, k % 2 == 0 ? -1 : 1), printed[k], 1e-5);
    EXPECT_NEAR(found[k].frequency() / printed[k], 1, 1e-5);
    EXPECT_NEAR(found[k].direction, k % 2 == 0 ? -1 : 1, 1e-9);
  }
}

TEST(ShaftConvergence, TaperedShaftToOrderFour) {
  const auto frequency = [](int n) {
    Rotor r = uniform_shaft(n, ShearModel::hutchinson, ElementKind::internal_node);
    r.sections[0].outer_end = 0.12;
    r.sections[0].inner_end = 0.06;
    return modes(assemble(r), 300, 4)[3].frequency();
  };
  const double f4 = frequency(4), f8 = frequency(8), f16 = frequency(16);
  EXPECT_NEAR(std::log2((f4 - f8) / (f8 - f16)), 4, 0.4);
}

/// A beam on two supports: 5 q L^4 / (384 E I) + q L^2 / (8 k G A) under its own weight.
TEST(ShaftReference, SagOfAUniformShaft) {
  Rotor r = uniform_shaft(2, ShearModel::cowper, ElementKind::internal_node);
  const System s = assemble(r);
  const double area = kPi * 0.06 * 0.06 / 4, I = kPi * std::pow(0.06, 4) / 64, q = 7800 * area * 9.80665;
  const double kG = shear_coefficient({ShearModel::cowper}, 0.3, 0) * 2.1e11 / 2.6;
  const Sag sag = static_sag(s);
  EXPECT_NEAR(-sag.y[1] / (5 * q / (384 * 2.1e11 * I) + q / (8 * kG * area)), 1, 1e-6);
  EXPECT_NEAR(sag.reactions[0].y(), q / 2, 1e-4 * q);
  EXPECT_NEAR(sag.reactions[0].x(), 0, 1e-6 * q);
}

/// Two magnets carry a lying shaft: each its share of the weight, and it sags between them as on two supports, however
/// weak or strong their bias is. A shaft as thin as a thread is refused on them too.
TEST(ShaftReference, SagOfAShaftThatMagnetsCarry) {
  const auto text = [](double outer, double bias) {
    std::string file = fmt::format(
        "[[material]]\nname = \"steel\"\nyoungs_modulus_GPa = 210\ndensity_kg_m3 = 7800\n[[section]]\nlength_mm = "
        "1000\n"
        "outer_mm = {}\n",
        outer);
    for (const int place : {0, 1000})
      for (const int angle : {45, 135})
        file += fmt::format(
            "[[actuator]]\nname = \"m{0} {1}\"\nposition_mm = {0}\nangle_deg = {1}\nforce_limit_N = 1e4\n"
            "bias_stiffness_N_m = {2}\n",
            place, angle, -bias);
    return file;
  };
  const double weight = 7800 * kPi * 0.06 * 0.06 / 4 * 9.80665;
  Rotor held = parse_rotor(text(60, 0), "r.toml");
  for (const double at : {0.0, 1.0}) {
    SupportLaw law;
    law.stiffness = {1e12 * Eigen::Matrix2d::Identity()};
    law.damping = law.mass = {Eigen::Matrix2d::Zero()};
    held.supports.push_back({"", {"shaft", at}, {"ground", 0}, law, 0, 0});
  }
  const double between = static_sag(assemble(held)).y.minCoeff();
  for (const double bias : {10.0, 1e5}) {
    const Sag sag = static_sag(assemble(parse_rotor(text(60, bias), "r.toml")));
    EXPECT_NEAR(sag.y.minCoeff() / between, 1, 1e-3) << bias;
    Eigen::Vector2d carried = Eigen::Vector2d::Zero();
    for (const Eigen::Vector2d& r : sag.reactions) carried += r;
    EXPECT_NEAR(carried.y() / weight, 1, 1e-6) << bias;
    EXPECT_NEAR(carried.x(), 0, 1e-6 * weight) << bias;
    EXPECT_THROW(parse_rotor(text(0.02, bias), "r.toml"), Error) << bias;
  }
}

/// A pinned shaft under tension: w_n^2 = (n pi / L)^2 (E I (n pi / L)^2 + N) / (rho A), rotary inertia aside.
TEST(ShaftReference, TensionRaisesTheFrequency) {
  Rotor r = uniform_shaft(16, ShearModel::none, ElementKind::internal_node);
  const double area = kPi * 0.06 * 0.06 / 4, I = kPi * std::pow(0.06, 4) / 64;
  const double slack = modes(assemble(r), 0, 2)[0].frequency();
  r.axial_force = 1e6;
  const double tight = modes(assemble(r), 0, 2)[0].frequency();
  EXPECT_NEAR(tight / slack, std::sqrt(1 + 1e6 / (2.1e11 * I * kPi * kPi)), 1e-6);
  EXPECT_GT(area, 0);
}

/// Roots b of cos b cosh b = 1 (free ends) and tan b = tanh b (one end pinned): w = b^2 sqrt(E I / (rho A)) / L^2 of a
/// thin beam. Motions of the rigid shaft, which nothing holds, are no modes, no critical speeds and no instability.
TEST(ShaftReference, ShaftsThatHangFreelyOrOnOneBearing) {
  constexpr double kThin = 0.004;
  const double wave = std::sqrt(2.1e11 / 7800) * kThin / 4;
  const struct {
    int supports, free;
    std::vector<double> roots;
  } cases[] = {{0, 4, {4.7300407449, 7.8532046241, 10.9956078380}},
               {1, 2, {3.9266023120, 7.0685827456, 10.2101761228}}};
  for (const auto& c : cases) {
    Rotor r = uniform_shaft(20, ShearModel::none, ElementKind::internal_node);
    r.sections = {testing::round_section(1, kThin, 0, 20)};
    r.supports.assign(static_cast<std::size_t>(c.supports), testing::bearing_at(0, testing::diagonal(1e7, 1e7)));
    const System s = assemble(r);
    EXPECT_EQ(s.free, c.free);
    EXPECT_EQ(static_sag(s).y.size(), 0);
    for (const double speed : {0.0, 200.0}) {
      const std::vector<Mode> found = modes(s, speed, 6);
      ASSERT_EQ(found.size(), 6u) << c.supports;
      for (std::size_t k = 0; k < 6; ++k) {
        EXPECT_NEAR(found[k].frequency() / (c.roots[k / 2] * c.roots[k / 2] * wave), 1, 2e-4) << speed << " " << k;
        EXPECT_FALSE(grows(s, found[k])) << speed << " " << k;
      }
    }
    EXPECT_FALSE(stability_threshold(s, 1, 1000));
    EXPECT_LT(check_mesh(r, 0, 6).worst, 1e-4);
    const std::vector<Critical> criticals = shaft::criticals(s, 1000);
    ASSERT_GE(criticals.size(), 2u);
    EXPECT_NEAR(criticals[0].speed / (c.roots[0] * c.roots[0] * wave), 1, 2e-4);
  }
}

/// A stiff rotor that hangs freely precesses with its speed times polar by transverse moment of inertia.
TEST(ShaftReference, AFreeDiscPrecesses) {
  Rotor r = uniform_shaft(2, ShearModel::none, ElementKind::internal_node);
  r.sections = {testing::round_section(0.05, 0.02)};
  r.discs = {{"disc", 0.025, 20, 0.5, 0.8}};
  r.supports.clear();
  const System s = assemble(r);
  const Mode first = modes(s, 300, 2).front();
  EXPECT_NEAR(first.frequency() / (300 * 0.8 / 0.5), 1, 1e-3);
  EXPECT_NEAR(first.direction, 1, 1e-6);
}

}  // namespace
}  // namespace whirl::shaft
