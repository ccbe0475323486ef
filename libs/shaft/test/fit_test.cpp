#include "whirl/shaft/fit/fit.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "fit/fit_problem.hpp"
#include "rotors.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/shaft/rotor_population.hpp"

namespace whirl::shaft {
namespace {

using whirl::testing::make_rotor_case;
using whirl::testing::order_runs;
using whirl::testing::PopulationOptions;
using whirl::testing::RotorCase;

FitSetup setup_of(const RotorCase& c) {
  FitSetup setup;
  setup.trials = c.trials;
  setup.tolerance.probe_gain = 0.05;
  return setup;
}

/// A machine whose runs pass both critical speeds, and its fit; made once.
struct BothCriticals {
  RotorCase machine = make_rotor_case(1, {.start_stiffness = 1.2, .start_damping = 1.5, .duration = 24});
  RotorFit fit = fit_rotor(machine.drawing, setup_of(machine), order_runs(machine));
};
const BothCriticals& both_criticals() {
  static const BothCriticals made;
  return made;
}

TEST(RotorFitReference, BearingsFromRunsThroughBothCriticals) {
  const auto& [machine, fit] = both_criticals();
  EXPECT_TRUE(fit.misfit.explained) << fit.misfit.deviations << " " << fit.misfit.band_deviations;
  for (std::size_t k = 0; k < 2; ++k) {
    const whirl::testing::RigBearing& truth = machine.rig.bearings[k];
    const SupportLaw& law = fit.rotor.supports[k].law;
    EXPECT_NEAR(law.stiffness[0](0, 0) / truth.kx, 1, 0.006);
    EXPECT_NEAR(law.stiffness[0](1, 1) / truth.ky, 1, 0.006);
    EXPECT_NEAR(law.damping[0](0, 0) / truth.cx, 1, 0.06);
    EXPECT_NEAR(law.damping[0](1, 1) / truth.cy, 1, 0.06);
    EXPECT_NEAR(fit.rotor.unbalances[k].size / machine.rig.masses[k].size, 1, 0.01);
  }
  // The fitted rotor's probes have the runout of the machine's.
  for (std::size_t p = 0; p < machine.rig.probes.size(); ++p) {
    const Probe& probe = fit.rotor.probes[p];
    EXPECT_LT(std::abs(std::polar(probe.runout, probe.runout_angle) - machine.rig.probes[p].runout), 2e-7) << p;
  }
  EXPECT_TRUE(fit.weak.empty()) << fit.weak.front().words;
  EXPECT_FALSE(fit.next.empty());
  EXPECT_FALSE(fit.misfit.above_scatter());
}

/// Runs below the second critical speed say little of which bearing damps: the way to the solution is a long, bent
/// valley.
TEST(RotorFitReference, ADescentThroughAValleyGoesToItsEnd) {
  const RotorCase machine = make_rotor_case(7005, {.second_critical = false});
  const RotorFit fit = fit_rotor(machine.drawing, setup_of(machine), order_runs(machine));
  EXPECT_TRUE(fit.misfit.explained) << fit.misfit.deviations << " " << fit.misfit.band_deviations;
  EXPECT_EQ(fit.summary.find(FindingCode::work_limit), nullptr);
  for (std::size_t k = 0; k < 2; ++k) {
    const whirl::testing::RigBearing& truth = machine.rig.bearings[k];
    EXPECT_NEAR(fit.rotor.supports[k].law.stiffness[0](0, 0) / truth.kx, 1, 0.006);
    EXPECT_NEAR(fit.rotor.supports[k].law.damping[0](0, 0) / truth.cx, 1, 0.2);
  }
}

/// Without a trial mass only gain times unbalance is read: a descent that moved along their product ended halfway.
TEST(RotorFitReference, ARunAloneFindsTheBearings) {
  const RotorCase machine = make_rotor_case(15004, {.trial = false});
  const RotorFit fit = fit_rotor(machine.drawing, setup_of(machine), order_runs(machine));
  EXPECT_TRUE(fit.misfit.explained) << fit.misfit.deviations << " " << fit.misfit.band_deviations;
  for (std::size_t k = 0; k < 2; ++k) {
    const whirl::testing::RigBearing& truth = machine.rig.bearings[k];
    EXPECT_NEAR(fit.rotor.supports[k].law.stiffness[0](0, 0) / truth.kx, 1, 0.006);
    EXPECT_NEAR(fit.rotor.supports[k].law.damping[0](0, 0) / truth.cx, 1, 0.06);
  }
}

/// The machine differs from its drawing within what the file states.
TEST(RotorFitReference, TolerancesOfTheDrawingAreInTheIntervals) {
  const RotorCase machine = make_rotor_case(7001, {.errors = {0.01, 0.001, 2e-3, 0.005}});
  FitSetup setup = setup_of(machine);
  setup.tolerance.youngs_modulus = 0.01;
  setup.tolerance.diameter = 0.001;
  setup.tolerance.disc_position = 2e-3;
  setup.tolerance.disc_mass = 0.005;
  const RotorFit fit = fit_rotor(machine.drawing, setup, order_runs(machine));
  EXPECT_TRUE(fit.misfit.explained) << fit.misfit.deviations << " " << fit.misfit.band_deviations;
  for (std::size_t k = 0; k < 2; ++k) {
    const double truth = machine.rig.bearings[k].kx;
    const auto u = std::ranges::find_if(fit.unknowns, [k](const FitUnknown& x) {
      return x.kind == UnknownKind::stiffness && x.index == k && x.row == 0;
    });
    EXPECT_LT(std::abs(u->estimate.value - truth), 2.6 * u->estimate.sd);
    EXPECT_LT(u->estimate.sd, 0.003 * truth);
    EXPECT_NEAR(fit.rotor.discs[k].position, machine.rig.discs[k].position, 1e-3);
  }
}

/// The way from the file's values ends in a false minimum; what that leaves from block to block looks like noise.
TEST(RotorFitReference, AFalseMinimumIsLeft) {
  const RotorCase machine = make_rotor_case(10005, {.second_critical = false, .linear = true});
  FitSetup setup = setup_of(machine);
  setup.stiffness = setup.damping = OverSpeed::linear;
  const RotorFit fit = fit_rotor(machine.drawing, setup, order_runs(machine));
  EXPECT_TRUE(fit.misfit.explained) << fit.misfit.most();
  EXPECT_GT(fit.starts, 1);
  EXPECT_LT(fit.misfit.scatter_ratio, 1.2);
  for (std::size_t k = 0; k < 2; ++k) {
    const std::vector<Eigen::Matrix2d>& over_speed = fit.rotor.supports[k].law.stiffness;
    EXPECT_NEAR(0.5 * (over_speed.front() + over_speed.back())(0, 0) / machine.rig.bearings[k].kx, 1, 0.03);
  }
}

TEST(RotorFitReference, AFitThatRunsOutOfStepsIsNotTrusted) {
  const RotorCase machine =
      make_rotor_case(7005, {.second_critical = false, .start_stiffness = 1.2, .start_damping = 2});
  const RotorFit fit =
      fit_rotor(machine.drawing, setup_of(machine), order_runs(machine), {.max_iterations = 1, .restarts = 0});
  ASSERT_NE(fit.summary.find(FindingCode::work_limit), nullptr) << fit.misfit.chi_square << " " << fit.iterations;
  EXPECT_EQ(fit.summary.find(FindingCode::work_limit)->consequence, Consequence::no_trust);
}

/// What the model of a run lacks at the true bearings and material damping.
struct Lack {
  double residual = 0;  ///< mean square, in variances of a noise of 30 dB, of runs without noise
  double moved = 0;     ///< largest move of a structural unknown by it, in standard deviations of that noise
};
Lack lack_without_noise(unsigned seed, PopulationOptions options) {
  options.noise_db = std::numeric_limits<double>::infinity();
  options.start_stiffness = options.start_damping = 1;
  const RotorCase c = make_rotor_case(seed, options);
  const std::vector<OrderRun> runs = order_runs(c);
  double slowest = std::numeric_limits<double>::infinity(), fastest = 0;
  for (const OrderRun& run : runs) {
    slowest = std::min(slowest, run.speed.minCoeff());
    fastest = std::max(fastest, run.speed.maxCoeff());
  }
  const FitSetup setup = setup_of(c);
  const ParameterSet set = make_parameters(c.drawing, setup, slowest, fastest);
  FitPoint truth{set.start()};
  for (int k = 0; k < set.structural; ++k) {
    const auto& unknown = set.all[static_cast<std::size_t>(k)];
    if (unknown.kind == UnknownKind::material_damping) truth.t[k] = unknown.internal(c.rig.damping_time);
  }
  FitProblem problem(std::make_shared<FitModel>(c.drawing, set, setup.trials, truth.t, 5), runs);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    for (int k = 0; k < set.probes; ++k) {
      const auto& x = c.records[r].channels[static_cast<std::size_t>(k)].samples;
      problem.set_noise(r, k, x.norm() / std::sqrt(static_cast<double>(x.size())) * std::pow(10, -1.5));
    }
  }
  SquareSum sum;
  problem.linearise(truth, sum);
  const Eigen::MatrixXd covariance = sum.normal.inverse();
  const Eigen::VectorXd moved =
      (covariance * sum.gradient).cwiseQuotient(covariance.diagonal().cwiseSqrt()).head(set.structural);
  return {sum.cost / static_cast<double>(problem.equations()), moved.cwiseAbs().maxCoeff()};
}

// The model of a sweep itself must leave little of what the noise leaves, or its intervals are too narrow.
TEST(RotorFitProperty, TheModelOfASweepLeavesLittleOfARunWithoutNoise) {
  for (const unsigned seed : {5001U, 7101U}) {
    for (const bool second_critical : {true, false}) {
      const Lack lack = lack_without_noise(seed, {.second_critical = second_critical});
      EXPECT_LT(lack.residual, 0.005) << seed;
      EXPECT_LT(lack.moved, 0.6) << seed;
    }
  }
}

// A short, stiff shaft on soft supports, alike in x and y and about its disc, where the probes are: without a
// gyroscopic moment the modes in x and y are one pair of any two of their plane.
TEST(RotorFitReference, ModesInPairsAreFollowed) {
  RotorCase c;
  c.rig.length = 0.4;
  c.rig.diameter = 0.08;
  c.rig.damping_time = 0;
  c.rig.discs = {{0.2, 10, 0.10, 0.06}};
  for (const double z : {0.0, 0.4}) c.rig.bearings.push_back({.position = z, .kx = 2e5, .ky = 2e5, .cx = 60, .cy = 60});
  c.rig.masses = {{0.2, 3e-4, 1.22}};
  c.rig.probes = {{"x", 0.2, 0, 1, 0}, {"y", 0.2, std::numbers::pi / 2, 1, 0}};
  c.rig.lowest = 60;
  c.rig.highest = 320;
  Rotor& r = c.drawing;
  r.materials = {{"steel", c.rig.young, c.rig.shear, c.rig.density, 0}};
  r.shear.model = ShearModel::cowper;
  r.sections = {{0.4, 0.08, 0.08, 0, 0, 0, 0}};
  r.discs = {{"disc", 0.2, 10, 0.10, 0.06, 0}};
  r.unbalances = {{0.2, 0.2, 0, 0}};
  for (const whirl::testing::RigBearing& b : c.rig.bearings)
    r.supports.push_back({b.position == 0 ? "a" : "b",
                          {"shaft", b.position},
                          {"ground", b.position},
                          {{}, {testing::diagonal(2e5, 2e5)}, {testing::diagonal(60, 60)}, {}}});
  for (const whirl::testing::RigProbe& p : c.rig.probes) r.probes.push_back({p.name, p.position, p.angle});
  c.trials = {{"trial", 0.2, 5e-4, 2}};
  const whirl::testing::ShaftRigModel model(c.rig);
  for (const unsigned k : {0U, 1U}) {
    whirl::testing::RigRun run;
    run.from = k == 0 ? 63 : 314;
    run.to = k == 0 ? 314 : 63;
    run.duration = 40;
    run.noise_db = 30;
    run.seed = 90003 + k;
    if (k == 1) run.added = {{0.2, 5e-4, 2}};
    c.records.push_back(model.run(run));
  }
  FitSetup setup;
  setup.trials = c.trials;
  setup.axes_alike = true;
  setup.material_damping = false;
  setup.supports = {"a"};
  const RotorFit fit = fit_rotor(r, setup, order_runs(c), {.restarts = 0});
  EXPECT_TRUE(fit.misfit.explained) << fit.misfit.most();
  EXPECT_NEAR(fit.rotor.supports[0].law.stiffness[0](0, 0) / 2e5, 1, 1e-3);
  EXPECT_NEAR(fit.rotor.supports[0].law.damping[0](0, 0) / 60, 1, 1e-2);
}

TEST(RotorFitReference, MotionAtADiscFromProbesAtTheBearings) {
  const auto& [machine, fit] = both_criticals();
  const std::vector<double> speeds{60, 90, 120, 200, 260, 300};
  const double z = machine.rig.discs[1].position;
  const VirtualProbe v = virtual_probe(fit, z, speeds);
  const whirl::testing::ShaftRigModel model(machine.rig);
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    const Eigen::Vector2cd truth = model.steady(speeds[k], z);
    EXPECT_NEAR(std::abs(v.x[static_cast<Eigen::Index>(k)] / truth[0]), 1, 0.03) << speeds[k];
    EXPECT_GT(v.x_half[static_cast<Eigen::Index>(k)], 0);
  }
  // The force of a bearing on the shaft: its own stiffness and damping on the motion there.
  const VirtualForce force = virtual_force(fit, 0, speeds);
  const whirl::testing::RigBearing& b = machine.rig.bearings[0];
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    const std::complex<double> truth =
        -std::complex<double>(b.kx, speeds[k] * b.cx) * model.steady(speeds[k], b.position)[0];
    EXPECT_NEAR(std::abs(force.x[static_cast<Eigen::Index>(k)] / truth), 1, 0.03) << speeds[k];
  }
}

TEST(RotorFitReference, WithoutATrialMassTheScaleOfUnbalanceIsOpen) {
  RotorCase c = make_rotor_case(2, {.start_stiffness = 1.2, .start_damping = 1.5, .duration = 24});
  c.records.pop_back();
  c.names.pop_back();
  c.trials.clear();
  const RotorFit fit = fit_rotor(c.drawing, setup_of(c), order_runs(c));
  ASSERT_FALSE(fit.weak.empty());
  const auto says = [&](const char* words) {
    return std::ranges::any_of(fit.weak,
                               [&](const WeakDirection& w) { return w.words.find(words) != std::string::npos; });
  };
  EXPECT_TRUE(says("unbalance scale") && says("common gain")) << fit.weak.front().words;
  for (const FitUnknown& u : fit.unknowns) {
    if (u.kind == UnknownKind::stiffness) {
      EXPECT_TRUE(u.identifiable) << u.name;
    }
  }
  ASSERT_FALSE(fit.next.empty());
  EXPECT_NE(fit.next.front().words.find("trial mass"), std::string::npos) << fit.next.front().words;
}

TEST(RotorFitReference, AWrongDrawingIsContradicted) {
  RotorCase c = make_rotor_case(4, {.start_stiffness = 1.2, .start_damping = 1.5, .duration = 24});
  for (shaft::Disc& d : c.drawing.discs) d.position += 0.03;
  for (shaft::Unbalance& u : c.drawing.unbalances) u.position = u.end = u.position + 0.03;
  const RotorFit fit = fit_rotor(c.drawing, setup_of(c), order_runs(c), {.restarts = 0});
  EXPECT_FALSE(fit.misfit.explained);
  ASSERT_NE(fit.summary.find(FindingCode::model_error), nullptr);
  EXPECT_NE(fit.summary.distrust(), nullptr);
}

/// Elasticity, diameter, discs off their drawing: what the bearings cannot take up alternates from block to block.
TEST(RotorFitReference, AMisfitAsRoughAsNoiseIsContradicted) {
  const RotorCase machine = make_rotor_case(10001, {.errors = {0.01, 0.001, 2e-3, 0.005}});
  const RotorFit fit = fit_rotor(machine.drawing, setup_of(machine), order_runs(machine), {.restarts = 0});
  EXPECT_LT(std::abs(fit.misfit.deviations), kMisfitLimit);
  EXPECT_LT(fit.misfit.band_deviations, kBandLimit);
  EXPECT_TRUE(fit.misfit.above_scatter()) << fit.misfit.scatter_ratio;
  EXPECT_FALSE(fit.misfit.explained);
  EXPECT_NE(fit.summary.find(FindingCode::model_error), nullptr);
  EXPECT_EQ(fit.rotor.not_trusted, "model_error");
}

TEST(RotorFit, ErrorsNameWhatIsAllowed) {
  const RotorCase c = make_rotor_case(1, {.duration = 4});
  std::vector<OrderRun> runs = order_runs(c);
  FitSetup setup = setup_of(c);
  setup.trials[0].run = "trail";
  EXPECT_NE(whirl::testing::error_of([&] { fit_rotor(c.drawing, setup, runs); }).find("up, trial"), std::string::npos);
  setup = setup_of(c);
  setup.supports = {"C"};
  EXPECT_NE(whirl::testing::error_of([&] { fit_rotor(c.drawing, setup, runs); }).find("A, B"), std::string::npos);
  setup = setup_of(c);
  setup.stiffness = OverSpeed::table;
  EXPECT_NE(whirl::testing::error_of([&] { fit_rotor(c.drawing, setup, runs); }).find("speed_rpm"), std::string::npos);
  Rotor none = c.drawing;
  none.unbalances.clear();
  EXPECT_NE(whirl::testing::error_of([&] { fit_rotor(none, setup_of(c), runs); }).find("[[unbalance]]"),
            std::string::npos);
}

TEST(RotorFile, WhatIsWrittenReadsBackTheSame) {
  for (const std::string& name : rotor_templates()) {
    const Rotor rotor = parse_rotor(rotor_template(name), name);
    const Rotor again = parse_rotor(rotor_text(rotor), name);
    EXPECT_EQ(rotor_text(again), rotor_text(rotor)) << name;
    const System one = assemble(rotor), two = assemble(again);
    EXPECT_LT((one.mass - two.mass).norm(), 1e-12 * one.mass.norm()) << name;
    EXPECT_LT((one.stiffness - two.stiffness).norm(), 1e-12 * one.stiffness.norm()) << name;
    EXPECT_LT((one.unbalance - two.unbalance).norm(), 1e-12 * (1e-12 + one.unbalance.norm())) << name;
    ASSERT_EQ(one.supports.size(), two.supports.size());
    for (std::size_t k = 0; k < one.supports.size(); ++k)
      EXPECT_LT((one.supports[k].law.at(100).stiffness - two.supports[k].law.at(100).stiffness).norm(),
                1e-12 * one.supports[k].law.at(100).stiffness.norm())
          << name;
  }
}

TEST(RotorFile, WhatAFitIsToFind) {
  const std::string text = rotor_template("jeffcott") +
                           "[fit]\nstiffness = \"linear\"\ndamping = \"known\"\n[fit.tolerance]\n"
                           "youngs_modulus_percent = 1\ndisc_position_mm = 2\n[[trial]]\nrun = \"trial\"\n"
                           "position_mm = 250\nmass_gram = 2\nradius_mm = 40\nangle_deg = 90\n";
  const RotorJob job = parse_rotor_job(text, "job.toml");
  EXPECT_EQ(job.fit.stiffness, OverSpeed::linear);
  EXPECT_EQ(job.fit.damping, OverSpeed::known);
  EXPECT_DOUBLE_EQ(job.fit.tolerance.youngs_modulus, 0.01);
  EXPECT_DOUBLE_EQ(job.fit.tolerance.disc_position, 0.002);
  ASSERT_EQ(job.fit.trials.size(), 1u);
  EXPECT_NEAR(job.fit.trials[0].size, 8e-5, 1e-15);
  const std::string wrong = rotor_template("jeffcott") + "[fit]\nstiffness = \"cubic\"\n";
  const std::string error = whirl::testing::error_of([&] { parse_rotor_job(wrong, "job.toml"); });
  EXPECT_NE(error.find("linear"), std::string::npos) << error;
}

}  // namespace
}  // namespace whirl::shaft
