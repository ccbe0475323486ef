// Runs through critical speeds, and reduced models.
#include "whirl/shaft/transient.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "rotors.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

/// z'' + 2 zeta z' + z = (W^2 - i W') e^{i theta}: units of the critical speed and the eccentricity.
System unit_jeffcott(double zeta) {
  System s;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(1, 1);
  s.nodes = {0};
  s.mass = s.stiffness = s.deflection = one;
  s.gyroscopic = s.rotating = s.slope = 0 * one;
  s.supports = {
      {"", Eigen::VectorXd::Ones(1), {}, {{}, {testing::diagonal(0, 0)}, {testing::diagonal(2 * zeta, 2 * zeta)}, {}}}};
  s.unbalance = Eigen::VectorXcd::Ones(1);
  s.bow = Eigen::VectorXcd::Zero(1);
  s.weight = Eigen::VectorXd::Ones(1);
  s.bodies.resize(0, 1);
  return s;
}

/// Peaks of Runge-Kutta solutions that do not depend on their step to 5 digits.
TEST(ShaftRunReference, PassagesThroughAResonance) {
  const struct {
    double zeta, rate, from, duration, peak, at;
  } rows[] = {{.02, .001, 0, 2500, 20.28373, 1.04919},
              {.02, -.001, 2.5, 2500, 19.36986, 0.95431},
              {.02, .004, 0, 600, 14.90538, 1.11540},
              {.02, -.004, 2.4, 600, 13.67685, 0.89269},
              {.005, .001, 0, 2500, 36.38690, 1.06184}};
  for (const auto& row : rows) {
    RunOptions o;
    o.from = row.from;
    o.to = std::max(0.0, row.from + row.rate * row.duration);
    o.duration = row.duration;
    o.sample_time = 0.1;
    o.from_rest = true;
    o.tolerance = 1e-5;
    const RotorRun run = simulate_run(unit_jeffcott(row.zeta), o);
    const RunPeak peak = run_peak(run, 0);
    EXPECT_NEAR(peak.size / row.peak, 1, 1e-4);
    EXPECT_NEAR(peak.speed, row.at, 1e-3);
    EXPECT_LT(run.step_error, 1e-5);
  }
}

Rotor run_down_rotor() {
  Rotor r = testing::friswell(testing::diagonal(1e6, 1e6), 100);
  r.shear.model = ShearModel::hutchinson;  // as the limit was computed
  r.unbalances = {{0.5, 0.5, 1e-4, 0}};
  return r;
}
RunOptions run_down() {
  RunOptions o;
  o.from = 450;
  o.to = 0;
  o.duration = 15;
  o.from_rest = true;
  return o;
}

/// 51.08 um is the limit of Newmark's method for steps to zero; at 1 kHz it gives 49.7 um.
TEST(ShaftRunReference, RunDownPeakAtTheDefaultStep) {
  const System s = assemble(run_down_rotor());
  const RotorRun run = simulate_run(s, run_down());
  const RunPeak peak = run_peak(run, s.node_at(0.5));
  std::printf("  peak %.4f um at %.2f rad/s, step %g s, its error %.1e\n", peak.size * 1e6, peak.speed, run.step,
              run.step_error);
  EXPECT_NEAR(peak.size * 1e6 / 51.08, 1, 2e-3);
  EXPECT_NEAR(peak.speed, 279.9, 0.5);
}

TEST(ShaftRunReference, ReducedRunDownWithinATenthOfAPercentOfTheFullOne) {
  const System full = assemble(run_down_rotor());
  ReductionOptions options;
  options.highest = 450;
  const Reduction r = reduce(full, options);
  EXPECT_LT(r.system.size(), full.size());
  EXPECT_LT(r.worst_error, 1e-3);
  const Eigen::Index disc = full.node_at(0.5);
  const double exact = run_peak(simulate_run(full, run_down()), disc).size;
  const double found = run_peak(simulate_run(r.system, run_down()), disc).size;
  std::printf("  full %.4f um, reduced to %d coordinates a plane %.4f um, printed error of the response %.1e\n",
              exact * 1e6, static_cast<int>(r.system.size()), found * 1e6, r.worst_error);
  EXPECT_NEAR(found / exact, 1, 1e-3);
}

TEST(ShaftRunConvergence, StepsOfOrderFour) {
  const System s = unit_jeffcott(0.02);
  RunOptions o;
  o.from = 0.8;
  o.to = 1.2;
  o.duration = 100;
  o.tolerance = 1;  // the step as given
  const auto end = [&](double step) {
    o.sample_time = step;
    const RotorRun run = simulate_run(s, o);
    return std::complex<double>(run.x(0, run.x.cols() - 1), run.y(0, run.y.cols() - 1));
  };
  const auto a = end(0.4), b = end(0.2), c = end(0.1);
  EXPECT_NEAR(std::log2(std::abs(a - b) / std::abs(b - c)), 4, 0.3);
}

/// A run at constant speed stays in the steady response; one in unlike supports and with weight as well.
TEST(ShaftRunProperty, SteadyResponseStays) {
  Rotor rotor = parse_rotor(rotor_template("two-disc"), "two-disc");
  rotor.bow = {{0, 0, 0}, {0.75, 2e-5, 1}, {1.5, 0, 0}};
  const System s = assemble(rotor);
  RunOptions o;
  o.from = o.to = 95;
  o.duration = 1;
  o.weight = true;
  o.tolerance = 1e-6;
  const RotorRun run = simulate_run(s, o);
  const Response r = unbalance_response(s, {95});
  const Sag sag = static_sag(s);
  const Eigen::Index disc = s.node_at(0.5), last = run.time.size() - 1;
  const std::complex<double> turn = std::polar(1.0, run.angle[last]);
  const double size = std::abs(r.x(disc, 0));
  EXPECT_NEAR(run.x(disc, last), (r.x(disc, 0) * turn).real() + sag.x[disc], 2e-4 * size);
  EXPECT_NEAR(run.y(disc, last), (r.y(disc, 0) * turn).real() + sag.y[disc], 2e-4 * size);
}

/// The stated error against that of a run in eighths of the step, also where the first comparison is the only one.
TEST(ShaftRunProperty, TheStatedErrorOfTheStepsIsNotTooSmall) {
  for (const char* name : {"two-disc", "overhung", "centrifuge"}) {
    const System s = reduce(assemble(parse_rotor(rotor_template(name), name))).system;
    for (const double sample : {5e-4, 1e-3, 2e-3, 4e-3}) {
      RunOptions o;
      o.from = 250;
      o.to = 20;
      o.duration = 4;
      o.sample_time = sample;
      o.tolerance = 1;
      RunOptions eighth = o;
      eighth.sample_time = sample / 8;
      const RotorRun run = simulate_run(s, o), exact = simulate_run(s, eighth);
      double error = 0;
      for (Eigen::Index k = 0; k < run.x.cols(); ++k)
        error = std::max(error, (run.x.col(k) - exact.x.col(8 * k)).cwiseAbs().maxCoeff());
      error /= exact.x.cwiseAbs().maxCoeff();
      // Rounding leaves 1e-7; steps of a radian and more are beyond the estimate, which then is beyond any tolerance.
      EXPECT_GT(run.step_error, 0.5 * std::min(error, 2e-3) - 1e-6) << name << sample;
    }
  }
}

/// A run of a few samples says what its steps are worth, too.
TEST(ShaftRunProperty, AShortRunHasAStepError) {
  const System s = reduce(assemble(parse_rotor(rotor_template("two-disc"), "two-disc"))).system;
  for (const int samples : {1, 3, 7}) {
    RunOptions o;
    o.from = o.to = 200;
    o.sample_time = 5e-3;
    o.duration = samples * o.sample_time;
    o.from_rest = true;
    o.tolerance = 1;
    EXPECT_GT(simulate_run(s, o).step_error, 0) << samples;
  }
}

/// The complex equation of an isotropic rotor and the real ones of two planes are the same motion.
TEST(ShaftRunProperty, CircularAndPlaneEquationsAgree) {
  Rotor rotor = parse_rotor(rotor_template("overhung"), "overhung");
  rotor.elements = 4;
  const System joined = assemble(rotor);
  System apart = joined;
  apart.supports[0].law.stiffness[0](0, 0) *= 1 + 1e-9;
  ASSERT_TRUE(joined.isotropic(0));
  ASSERT_FALSE(apart.isotropic(0));
  const std::vector<Mode> a = modes(joined, 300, 6), b = modes(apart, 300, 6);
  for (std::size_t k = 0; k < 6; ++k) {
    EXPECT_NEAR(std::abs(a[k].pole - b[k].pole), 0, 1e-6 * std::abs(a[k].pole));
    EXPECT_NEAR(a[k].direction, b[k].direction, 1e-3);
  }
  const Response one = unbalance_response(joined, {70, 200}), two = unbalance_response(apart, {70, 200});
  EXPECT_LT((one.x - two.x).norm() + (one.y - two.y).norm(), 1e-5 * one.x.norm());
  RunOptions o;
  o.from = 60;
  o.to = 120;
  o.duration = 2;
  o.tolerance = 1e-3;
  const RotorRun x = simulate_run(reduce(joined).system, o), y = simulate_run(reduce(apart).system, o);
  EXPECT_LT((x.x - y.x).norm() + (x.y - y.y).norm(), 1e-2 * x.x.norm());
}

}  // namespace
}  // namespace whirl::shaft
