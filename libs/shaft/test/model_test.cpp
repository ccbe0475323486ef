#include <gtest/gtest.h>

#include <cmath>

#include "rotors.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

std::string message(const std::string& text) {
  try {
    parse_rotor(text, "rotor.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

const std::string kShaft = "[[section]]\nlength_mm = 500\nouter_mm = 20\n";

TEST(RotorFile, ErrorsNameFileLineKeyValueAndWhatIsAllowed) {
  const std::string bearing = message(kShaft + "[[bearing]]\nposition_mm = 600\nstiffness_N_m = 1e6\n");
  EXPECT_NE(bearing.find("rotor.toml:5"), std::string::npos) << bearing;
  EXPECT_NE(bearing.find("bearing[0].position_mm = 600"), std::string::npos) << bearing;
  EXPECT_NE(bearing.find("between 0 and 500 mm"), std::string::npos) << bearing;
  const std::string unit = message(kShaft + "[[unbalance]]\nposition_mm = 100\nsize = 20\n");
  EXPECT_NE(unit.find("gmm"), std::string::npos) << unit;
  const std::string unknown = message(kShaft + "[[disc]]\nposition_mm = 1\nmass_kg = 1\nmas_kg = 2\n");
  EXPECT_NE(unknown.find("rotor.toml:7"), std::string::npos) << unknown;
  const std::string body = message(kShaft + "[[bearing]]\nposition_mm = 100\non = \"motor\"\n");
  EXPECT_NE(body.find("must be one of shaft, ground"), std::string::npos) << body;
  EXPECT_NE(message(kShaft + "[[bearing]]\nposition_mm = 1\nspeed_rpm = [1, 2]\nstiffness_N_m = [1]\n"), "");
  EXPECT_NE(message(kShaft + "[[bearing]]\nposition_mm = 1\nstiffness_x_N_m = 1\n"), "");
  EXPECT_NE(message("[rotor]\nname = \"empty\"\n"), "");
  EXPECT_NE(message("[rotor]\nshear = \"best\"\n" + kShaft), "");
  EXPECT_EQ(message(kShaft), "");
}

TEST(ShaftProperty, TemplatesMatchTheirSources) {
  // Two discs: frequencies of the book at 0 rpm, mesh errors of its six elements aside.
  const std::vector<Mode> two = modes(assemble(parse_rotor(rotor_template("two-disc"), "two-disc")), 0, 2);
  EXPECT_NEAR(std::abs(two[0].pole), 82.653, 0.05);
  EXPECT_NEAR(std::abs(two[1].pole), 86.658, 0.05);
  // A centrifuge like this one: forward criticals near 359, 1166 and 8121 rpm.
  const System centrifuge = assemble(parse_rotor(rotor_template("centrifuge"), "centrifuge"));
  std::vector<double> forward;
  for (const Critical& c : criticals(centrifuge, 20000 * testing::kRpm))
    if (c.direction > 0) forward.push_back(c.speed / testing::kRpm);
  ASSERT_EQ(forward.size(), 3u);
  EXPECT_NEAR(forward[0], 359, 0.05 * 359);
  EXPECT_NEAR(forward[1], 1166, 0.05 * 1166);
  EXPECT_NEAR(forward[2], 8121, 0.05 * 8121);
  // 1 N m s/rad in the fit of bowl and spindle: unstable near 9200 rpm.
  Rotor loose = parse_rotor(rotor_template("centrifuge"), "centrifuge");
  loose.joints[0].coefficient = 1;
  loose.elements = 4;
  const auto threshold = stability_threshold(assemble(loose), 600, 1200, 6, 6);
  ASSERT_TRUE(threshold);
  EXPECT_NEAR(threshold->speed / testing::kRpm, 9200, 0.05 * 9200);
  EXPECT_GT(threshold->direction, 0.9);
}

TEST(ShaftProperty, CriticalsAreWhereCampbellLinesMeetTheSpeed) {
  Rotor rotor = testing::friswell(testing::diagonal(1e6, 0.8e6));
  SupportLaw& law = rotor.supports[1].law;  // stiffens with speed
  law.speeds = {0, 400};
  law.stiffness = {testing::diagonal(0.6e6, 0.5e6), testing::diagonal(1.4e6, 1.2e6)};
  law.damping.clear();
  const System s = assemble(rotor);
  const std::vector<Critical> found = criticals(s, 400);
  ASSERT_GE(found.size(), 4u);
  for (const Critical& c : found) {
    double nearest = 1e9;
    for (const Mode& m : modes(s, c.speed, 8)) nearest = std::min(nearest, std::abs(m.frequency() - c.speed));
    EXPECT_LT(nearest, 1e-6 * c.speed);
  }
}

// A station makes an element end there, however near the next one is.
TEST(ShaftProperty, StationsNearToEachOtherChangeNothing) {
  for (const auto model : {ShearModel::cowper, ShearModel::none}) {
    for (const auto kind : {ElementKind::usual, ElementKind::internal_node}) {
      Rotor rotor = testing::friswell(testing::diagonal(1e5, 1.2e5), 100, 2, kind);
      rotor.shear.model = model;
      const std::vector<Critical> usual = criticals(assemble(rotor), 6000 * testing::kRpm);
      ASSERT_GE(usual.size(), 3U);
      for (const double apart : {1e-3, 1e-4, 1e-5, 1e-6}) {
        Rotor near = rotor;
        near.probes.push_back({"near", rotor.discs[0].position + apart, 0});
        const std::vector<Critical> found = criticals(assemble(near), 6000 * testing::kRpm);
        ASSERT_EQ(found.size(), usual.size()) << apart;
        for (std::size_t k = 0; k < usual.size(); ++k)
          EXPECT_NEAR(found[k].speed / usual[k].speed, 1, 2e-5) << apart << " " << static_cast<int>(kind);
      }
    }
  }
}

TEST(ShaftProperty, CampbellLinesKeepTheirDirection) {
  const System s = assemble(testing::friswell(testing::diagonal(1e6, 1e6), 10));
  std::vector<double> speeds;
  for (int k = 0; k <= 40; ++k) speeds.push_back(1 + 10.0 * k);
  const std::vector<CampbellPoint> points = campbell(s, speeds, 6);
  for (std::size_t m = 0; m < 6; ++m)
    for (const CampbellPoint& p : points) EXPECT_NEAR(p.modes[m].direction, points[0].modes[m].direction, 1e-6);
}

// Lines that are followed from speed to speed against all modes found anew at each: isotropic and not, damped, supports
// over speed, steps small and large. No mode is on two lines.
TEST(ShaftProperty, CampbellLinesAreTheModesOfEverySpeed) {
  Rotor over_speed = testing::friswell(testing::diagonal(1e6, 0.8e6), 20);
  over_speed.supports[0].law.speeds = {0, 400};
  over_speed.supports[0].law.stiffness = {testing::diagonal(0.6e6, 0.5e6), testing::diagonal(1.4e6, 1.2e6)};
  over_speed.supports[0].law.damping.assign(2, testing::diagonal(50, 10));
  for (const Rotor& rotor :
       {testing::friswell(testing::diagonal(1e6, 1e6), 10), testing::friswell(testing::diagonal(1e6, 0.5e6), 200),
        testing::overhung(4, 2), over_speed}) {
    const System s = assemble(rotor);
    for (const double step : {3.0, 40.0}) {
      std::vector<double> speeds;
      for (int k = 0; k * step <= 400; ++k) speeds.push_back(k * step);
      for (const CampbellPoint& p : campbell(s, speeds, 6)) {
        ASSERT_EQ(p.modes.size(), 6u);
        const std::vector<Mode> all = modes(s, p.speed, 12);
        std::vector<bool> used(all.size());
        for (const Mode& m : p.modes) {
          const auto distance = [&](const Mode& a) { return std::abs(a.pole - m.pole); };
          std::size_t best = all.size();
          for (std::size_t k = 0; k < all.size(); ++k)
            if (!used[k] && (best == all.size() || distance(all[k]) < distance(all[best]))) best = k;
          EXPECT_LT(distance(all[best]), 1e-6 * std::abs(m.pole)) << p.speed << " rad/s";
          EXPECT_NEAR(all[best].direction, m.direction, 1e-3) << p.speed << " rad/s";
          used[best] = true;
        }
      }
    }
  }
}

TEST(ShaftProperty, AMovedDiscIsOneElsewhereToFirstOrder) {
  using testing::friswell, testing::diagonal, testing::kRpm;
  const auto poles = [](double position, double moved) {
    Rotor r = friswell(diagonal(1e6, 1e6), 100, 8, ElementKind::internal_node);
    r.discs[0].position = position;
    r.discs[0].moved = moved;
    return modes(assemble(r), 3000 * kRpm, 6);
  };
  const auto largest = [&](double d) {
    const std::vector<Mode> there = poles(0.5 + d, 0), moved = poles(0.5, d), drawn = poles(0.5, 0);
    double off = 0, change = 0;
    for (std::size_t k = 0; k < there.size(); ++k) {
      off = std::max(off, std::abs(moved[k].frequency() / there[k].frequency() - 1));
      change = std::max(change, std::abs(drawn[k].frequency() / there[k].frequency() - 1));
    }
    EXPECT_LT(off, 0.05 * change) << d;
    return off;
  };
  for (const double side : {-1, 1}) EXPECT_NEAR(largest(4e-3 * side) / largest(2e-3 * side), 4, 0.8) << side;
}

TEST(ShaftProperty, OrbitAxesAndProbes) {
  const std::complex<double> x(3, 0), y(0, -2);  // x = 3 cos t, y = 2 sin t: forward
  const Orbit o = orbit(x, y);
  EXPECT_NEAR(o.major, 3, 1e-12);
  EXPECT_NEAR(o.minor, 2, 1e-12);
  EXPECT_NEAR(o.angle, 0, 1e-12);
  EXPECT_LT(orbit(x, -y).minor, 0);
  const Orbit turned = orbit({1, 0}, {1, 0});  // a line at 45 degrees
  EXPECT_NEAR(turned.angle, std::numbers::pi / 4, 1e-12);
  EXPECT_NEAR(turned.minor, 0, 1e-12);
  EXPECT_NEAR(std::abs(probe_reading({1, 0}, {1, 0}, std::numbers::pi / 4)), std::sqrt(2.0), 1e-12);
}

/// Twice the quality factor's width: amplification 1 / (2 zeta) of a lightly damped rotor.
TEST(ShaftProperty, AmplificationOfALightlyDampedMode) {
  Rotor rotor = testing::friswell(testing::diagonal(1e6, 1e6), 100);
  rotor.unbalances = {{0.5, 0.5, 1e-4, 0}};
  const System s = assemble(rotor);
  std::vector<double> speeds;
  for (int k = 0; k <= 4000; ++k) speeds.push_back(60 + 0.015 * k);
  const Response r = unbalance_response(s, speeds);
  const std::vector<Peak> found = peaks(speeds, r.x.row(s.node_at(0.5)).cwiseAbs().transpose());
  ASSERT_EQ(found.size(), 1u);
  const std::vector<Mode> at = modes(s, found[0].speed, 2);
  EXPECT_NEAR(found[0].amplification * 2 * at[1].damping(), 1, 0.06);
}

/// An even spread of unbalance over a symmetric rotor acts as its sum in the middle acts on rigid motion; a bow that is
/// a straight line needs no force.
TEST(ShaftProperty, SpreadUnbalanceAndStraightBow) {
  Rotor rotor = testing::friswell(testing::diagonal(1e3, 1e3), 0, 2, ElementKind::internal_node);
  rotor.discs.clear();
  rotor.unbalances = {{0, 1.5, 1e-4, 0.3}};
  const System s = assemble(rotor);
  EXPECT_NEAR(std::abs(s.weight.cast<std::complex<double>>().normalized().dot(s.unbalance.normalized())), 1, 1e-9);
  rotor.bow = {{0, 1e-3, 0}, {1.5, -1e-3, 0}};
  EXPECT_LT(assemble(rotor).bow.norm(), 1e-6);
}

/// Without load a bowed shaft in stiff bearings turns with its bow while slow.
TEST(ShaftProperty, SlowBowIsTheBow) {
  Rotor rotor = testing::friswell(testing::diagonal(1e9, 1e9), 0, 4, ElementKind::internal_node);
  rotor.bow = {{0, 0, 0}, {0.75, 1e-4, 0.5}, {1.5, 0, 0}};
  const System s = assemble(rotor);
  const Response r = unbalance_response(s, {0.01});
  EXPECT_NEAR(std::abs(r.x(s.node_at(0.75), 0) - std::polar(1e-4, 0.5)), 0, 1e-6);
}

/// A motor on soft mounts that carries the bearings: its heave is a mode near sqrt(k / m) of the whole.
TEST(ShaftProperty, BodyOnMountsCarriesTheRotor) {
  const Rotor rotor = parse_rotor(rotor_template("centrifuge"), "centrifuge");
  const System s = assemble(rotor);
  const Mode lowest = modes(s, 0, 2)[0];
  EXPECT_EQ(lowest.body_x.size(), 1);
  const double total = rotor.mass() + rotor.bodies[0].mass;
  EXPECT_LT(lowest.frequency(), std::sqrt(2 * 6e4 / total));
  EXPECT_GT(lowest.damping(), 0);
}

/// On the horizontal, supports carry the weight of shaft and discs.
TEST(ShaftProperty, ReactionsCarryTheWeight) {
  for (const char* name : {"jeffcott", "two-disc", "overhung", "kit"}) {
    const Rotor rotor = parse_rotor(rotor_template(name), name);
    double sum = 0;
    for (const Eigen::Vector2d& f : static_sag(assemble(rotor)).reactions) sum += f.y();
    EXPECT_NEAR(sum / (9.80665 * rotor.mass()), 1, 1e-6) << name;
  }
}

}  // namespace
}  // namespace whirl::shaft
