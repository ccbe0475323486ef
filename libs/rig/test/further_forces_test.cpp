#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/rig/batch.hpp"
#include "whirl/rig/records.hpp"
#include "whirl/testing/control/controlled_machine.hpp"

namespace whirl::rig {
namespace {

using testing::Machine;
constexpr double kMass = 1.5, kSeconds = 8, kStartHz = 30;

struct Case {
  const char* name;
  void (*machine)(Machine&);
  void (*rig)(RigForces&);
};

// Each of them as the two programs write it: per unit mass, and in newtons.
const Case kCases[] = {
    {"quintic", [](Machine& m) { m.quintic = 3e13; }, [](RigForces& f) { f.quintic = 3e13 * kMass; }},
    {"per axis", [](Machine& m) { m.cubic_axis = 1.5e8; }, [](RigForces& f) { f.cubic_per_axis = 1.5e8 * kMass; }},
    {"leaning", [](Machine& m) { m.lean_x = 6e5, m.lean_y = -4e5; },
     [](RigForces& f) {
       f.quadratic_x = 1.5 * 6e5 * kMass, f.quadratic_y = -1.5 * 4e5 * kMass;
       f.quadratic_xxy = -0.5 * 4e5 * kMass, f.quadratic_xyy = 0.5 * 6e5 * kMass;
     }},
    {"quadratic", [](Machine& m) { m.quadratic = 20; }, [](RigForces& f) { f.quadratic_damping = 20 * kMass; }},
    {"dry", [](Machine& m) { m.dry = 0.15; },
     [](RigForces& f) { f.friction = 0.15 * kMass, f.friction_speed = 1e-4; }},  // 1e-4: that of testing/machines.hpp
    {"gyroscopic", [](Machine& m) { m.gyroscopic = 0.05; }, [](RigForces& f) { f.gyroscopic = 0.05 * kMass; }},
    {"rotating", [](Machine& m) { m.c_rotating = 0.8; }, [](RigForces& f) { f.rotating_damping = 0.8 * kMass; }},
    {"cross", [](Machine& m) { m.cross = 60; }, [](RigForces& f) { f.cross_coupling = 60 * kMass; }},
    {"stiffness with speed", [](Machine& m) { m.k_with_speed = 0.1, m.top_speed = 100; },
     [](RigForces& f) { f.stiffness_with_speed = 5.7 * kMass; }},
    {"damping with speed", [](Machine& m) { m.c_with_speed = 0.8, m.top_speed = 100; },
     [](RigForces& f) { f.damping_with_speed = 0.024 * kMass; }},
    {"stiffness in time", [](Machine& m) { m.k_in_time = -0.05, m.horizon = kSeconds; },
     [](RigForces& f) { f.stiffness_drift = -0.05 * 5700 / kSeconds * kMass; }},
    {"damping in time", [](Machine& m) { m.c_in_time = 1, m.horizon = kSeconds; },
     [](RigForces& f) { f.damping_drift = 3 / kSeconds * kMass; }},
};

Machine machine() {
  Machine m;
  m.k = 5700, m.cubic = 1.5e8, m.c = 3, m.e = 1e-4, m.e_phase = 0.7;
  return m;
}

RigParameters rig_of(const Machine& m) {
  RigParameters p = RigParameters::ideal_rotor_b();
  p.rotor.mass = kMass;
  p.rotor.stiffness = m.k * kMass, p.rotor.cubic = m.cubic * kMass, p.rotor.damping = m.c * kMass;
  p.rotor.residual_eccentricity = m.e, p.rotor.residual_phase = m.e_phase, p.rotor.added_mass = 0;
  p.profile = rotor::SpeedProfile::run_down(2 * std::numbers::pi * kStartHz, kSeconds);
  return p;
}

// The machine is integrated by a program of its own. Without the force the rig is off by more than ten times the bound.
TEST(FurtherForcesReference, EveryForceOfTheRigIsThatOfAMachineIntegratedApart) {
  for (const Case& c : kCases) {
    Machine m = machine();
    RigParameters plain = rig_of(m), p = plain;
    c.machine(m);
    c.rig(p.forces);
    p.timing.substeps = 8;
    const testing::Run run{.from_hz = kStartHz, .to_hz = 0, .seconds = kSeconds};
    const testing::ControlledRun apart =
        testing::controlled(m, run, kMass, 1, [](const Measurement&) { return std::optional<Command>(); });
    const auto worst = [&](const RigParameters& parameters) {
      VirtualRig rig(parameters);
      double most = 0;
      for (std::size_t k = 0; !rig.done() && k < apart.radii.size(); ++k, rig.advance()) {
        // What is left of the starts, which differ, has died out after two seconds.
        if (rig.time() > 2) most = std::max(most, std::abs(std::abs(RigTruth(rig).z()) - apart.radii[k]));
      }
      return most / apart.peak_x;
    };
    EXPECT_LT(worst(p), 2e-3) << c.name;
    EXPECT_GT(worst(plain), 2e-2) << c.name;
  }
}

TEST(FurtherForcesProperty, LanesEqualTheScalarRig) {
  std::array<std::shared_ptr<const RigTables>, 16> tables;
  std::array<std::uint64_t, 16> seeds;
  std::vector<VirtualRig> scalar;
  for (std::size_t i = 0; i < 16; ++i) {
    RigParameters p = rig_of(machine());
    // Every lane another sum of forces, the last ones none.
    for (std::size_t k = 0; k < std::size(kCases); ++k) {
      if (i < 12 && (i + k) % 3 == 0) kCases[k].rig(p.forces);
    }
    tables[i] = make_rig_tables(p, tables[0]);
    seeds[i] = i + 1;
    scalar.emplace_back(make_rig_tables(p), RigRun{.seed = seeds[i]});
  }
  BatchRig<16> batch(tables, seeds);
  double worst = 0;
  for (; !batch.done(); batch.advance()) {
    LaneArray<16> ux, uy;
    for (int lane = 0; lane < 16; ++lane) {
      VirtualRig& rig = scalar[static_cast<std::size_t>(lane)];
      worst = std::max(worst,
                       std::abs(std::complex<double>(batch.true_x()[lane], batch.true_y()[lane]) - RigTruth(rig).z()));
      const Measurement m = rig.read();
      ux[lane] = -200 * m.x, uy[lane] = 100 * m.x;
      rig.write({ux[lane], uy[lane]});
      rig.advance();
    }
    batch.write(ux, uy);
  }
  EXPECT_LT(worst, 1e-9);
}

TEST(FurtherForces, ThePullTestHasTheSpringsOfEveryOrder) {
  RigParameters p;
  StiffnessTestOptions o;
  o.force_noise = o.force_resolution = o.deflection_resolution = o.zero_offset = 0;
  const double d = o.max_deflection;
  const auto last = [&] { return simulate_stiffness_test(p, o).force[o.points - 1]; };
  const double before = last();
  p.forces.quintic = 3e11;
  EXPECT_NEAR(last() - before, 3e11 * std::pow(d, 5), 1e-9 * before);
  p.forces.quintic = 0, p.forces.cubic_per_axis = 4e6;
  EXPECT_NEAR(last() - before, 4e6 * std::pow(d, 3), 1e-9 * before);
  p.forces.cubic_per_axis = 0, p.forces.quadratic_x = 5e4;
  EXPECT_NEAR(last() - before, 5e4 * d * d, 1e-9 * before);
}

TEST(FurtherForces, FrictionThatTheStepsCannotFollowIsAnError) {
  RigParameters p;
  p.forces.friction = 1, p.forces.friction_speed = 1e-5;
  try {
    p.check();
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("forces.friction_speed"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("timing.substeps"), std::string::npos) << e.what();
  }
  p.timing.substeps = 64;
  EXPECT_NO_THROW(p.check());
  p.forces.friction = -1;
  EXPECT_THROW(p.check(), Error);
}

}  // namespace
}  // namespace whirl::rig
