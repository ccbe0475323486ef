#include <gtest/gtest.h>

#include <cmath>

#include "whirl/rig/records.hpp"
#include "whirl/rig/segments.hpp"
#include "whirl/rig/virtual_rig.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::rig {
namespace {

RigParameters with_added_mass(double grams) {
  RigParameters p;
  p.rotor.added_mass = grams * 1e-3;
  return p;
}

SegmentPeaks open_loop_peaks(const RigParameters& p) {
  const OpenLoopRecord r = record_open_loop(p);
  return segment_peaks(r.truth["x"], segments(r.truth["omega"], p.natural_frequency()), 500);
}

// Paper Fig. 18 (balanced) and Table 4 (5 g), read as zero-to-peak millimetres; 2.5 g is a prediction of the
// calibrated rig.
TEST(RigLevelsReference, PeaksOfThePaper) {
  EXPECT_NEAR(open_loop_peaks(with_added_mass(0)).all, 1.242e-3, 0.002e-3);
  EXPECT_NEAR(open_loop_peaks(with_added_mass(2.5)).all, 4.13e-3, 0.02e-3);
  const SegmentPeaks five = open_loop_peaks(with_added_mass(5));
  EXPECT_NEAR(five.all, 6.45e-3, 0.005e-3);
  const double table4[] = {0.41e-3, 2.25e-3, 6.45e-3, 2.59e-3};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NEAR(five.segment[i] / table4[i], 1.0, 0.10) << "segment " << i + 1;
}

TEST(RigLevelsReference, PeakToPeakReadingHalvesTheLevels) {
  // All of the paper's levels read as peak-to-peak: half the unbalance, an easier plant.
  RigParameters p;
  p.rotor.residual_eccentricity = 25.53e-6;
  p.rotor.added_radius = 34.957e-3;
  EXPECT_NEAR(2 * open_loop_peaks(p).all, 6.45e-3, 0.01e-3);
  p.rotor.added_mass = 0;
  EXPECT_NEAR(2 * open_loop_peaks(p).all, 1.242e-3, 0.003e-3);
}

TEST(RigLevelsConvergence, SubstepsAgreeToFiveDigits) {
  double peak[4];
  int i = 0;
  for (int n : {4, 8, 16, 32}) {
    RigParameters p;
    p.timing.substeps = n;
    peak[i++] = open_loop_peaks(p).all;
  }
  for (double value : peak) EXPECT_NEAR(value / peak[3], 1.0, 5e-7);
}

TEST(RigLevelsReference, IdealRotorsOfTheIdentificationTests) {
  RigParameters a = RigParameters::ideal_rotor_a();
  EXPECT_NEAR(open_loop_peaks(a).all, 3.14e-3, 0.01e-3);
  a.rotor.added_mass = 0;
  EXPECT_NEAR(open_loop_peaks(a).all, 1.19e-3, 0.005e-3);
  EXPECT_NEAR(open_loop_peaks(a.run_up()).all, 1.38e-3, 0.005e-3);
  const RigParameters b = RigParameters::ideal_rotor_b();
  const OpenLoopRecord r = record_open_loop(b);
  EXPECT_EQ(r.truth.size(), 15000);
  EXPECT_NEAR(r.truth["x"].cwiseAbs().maxCoeff(), 3.1e-3, 0.02e-3);
  EXPECT_NEAR(std::sqrt(r.truth["x"].squaredNorm() / 15000), 0.547e-3, 0.001e-3);
  // Exact sensors: the record is the truth.
  EXPECT_EQ((r.measured["x"] - r.truth["x"]).cwiseAbs().maxCoeff(), 0);
  EXPECT_EQ((r.measured["beta"] - r.truth["beta"]).cwiseAbs().maxCoeff(), 0);
}

TEST(RigLevelsProperty, TrueMotionIsThatOfTheTrueModel) {
  const RigParameters p;
  const OpenLoopRecord r = record_open_loop(p);
  const AngleSignal angle = rotor::angle_signal(p.profile, 1e-3);
  const rotor::Response s =
      simulate(p.true_model(), angle, rotor::steady_whirl(p.true_model(), angle.omega[0], angle.beta[0]), 4);
  // Up to the jump of beta'' at the end of the ramp, where the refined angle of `simulate` is not smooth.
  EXPECT_NEAR((s.z.real() - r.truth["x"]).head(13000).cwiseAbs().maxCoeff(), 0, 1e-11);
  EXPECT_NEAR((s.z.imag() - r.truth["y"]).head(13000).cwiseAbs().maxCoeff(), 0, 1e-11);
}

TEST(RigLevelsReference, UnbalanceDrivesTheModesAsInTheTrueModel) {
  // Three modes at 7.5, 21 and 33 Hz, two of them passed through, with exact sensors: the record is the
  // model's response.
  RigParameters p = RigParameters::ideal_rotor_b();
  p.modes = {{7.5, 0.02, 0, 1, 0, 0.05}, {21, 0.01, 0, -1, 0, 0.03}, {33, 0.01, 0, 1, 0, 0.03}};
  const OpenLoopRecord r = record_open_loop(p);
  const AngleSignal angle = rotor::angle_signal(p.profile, 1e-3);
  const RotorModel model = p.true_model();
  ASSERT_EQ(model.modes.size(), 3u);
  const rotor::Response s = simulate(model, angle, rotor::steady_whirl(model, angle.omega[0], angle.beta[0]), 4);
  EXPECT_NEAR((s.z.real() - r.measured["x"]).cwiseAbs().maxCoeff(), 0, 1e-9);
  EXPECT_NEAR((s.z.imag() - r.measured["y"]).cwiseAbs().maxCoeff(), 0, 1e-9);
  EXPECT_GT((r.truth["x"] - r.measured["x"]).cwiseAbs().maxCoeff(), 50e-6);
}

TEST(OpenLoopProperty, SeedReproducesTheRecord) {
  const OpenLoopRecord a = record_open_loop({}, {.seed = 3}), b = record_open_loop({}, {.seed = 3}),
                       c = record_open_loop({}, {.seed = 4});
  EXPECT_EQ(a.measured["x"], b.measured["x"]);
  EXPECT_NE(a.measured["x"], c.measured["x"]);
  EXPECT_EQ(a.truth["x"], c.truth["x"]);
}

TEST(OpenLoopProperty, NoiseHasTheRatioAskedFor) {
  const OpenLoopRecord noisy = record_open_loop(RigParameters::ideal_rotor_b(), {.seed = 5}, 20.0);
  for (const char* axis : {"x", "y"}) {
    const Eigen::ArrayXd clean = noisy.truth[axis].array(), noise = noisy.measured[axis].array() - clean;
    const double ratio = 10 * std::log10((clean - clean.mean()).square().sum() / noise.square().sum());
    EXPECT_NEAR(ratio, 20, 0.15);  // 15 000 samples: 0.05 dB standard error
  }
}

TEST(OpenLoopReference, StandstillShowsNoiseAndQuantisationOnly) {
  // Noise 0.7 um rms, step 0.38 um -> 0.71 um; shaft and structure ring down before the last 50 ms only in
  // part, so look at differences of successive samples: sqrt(2) times as much.
  RigParameters p;
  p.rotor.added_mass = p.rotor.residual_eccentricity = 0;
  const Eigen::VectorXd x = record_open_loop(p).measured["x"].tail(900);
  const Eigen::VectorXd d = x.tail(899) - x.head(899);
  const double lsb = 25e-3 / 65536;
  EXPECT_NEAR(std::sqrt(d.squaredNorm() / 899 / 2), std::sqrt(0.49e-12 + lsb * lsb / 12), 0.05e-6);
  const double steps = d[10] / lsb;
  EXPECT_NEAR(steps, std::round(steps), 1e-6);
}

TEST(OpenLoopReference, RunoutIsSeenAtSlowRollAndTurnsWithTheRotor) {
  // No unbalance, no noise, 1 rev/s: the reading is the surface error alone.
  RigParameters p;
  p.rotor.added_mass = p.rotor.residual_eccentricity = 0;
  p.modes.clear();
  p.laser.noise = 0;
  p.laser.bits = 0;
  p.laser.latency = 0;
  p.profile = rotor::SpeedProfile{};
  p.profile.omega_start = p.profile.omega_end = 2 * M_PI;
  const Eigen::VectorXd x = record_open_loop(p).measured["x"], y = record_open_loop(p).measured["y"];
  for (int order = 1; order <= 3; ++order) {
    std::complex<double> sum = 0;
    for (int i = 0; i < 1000; ++i) sum += x[i] * std::polar(2.0 / 1000, -2 * M_PI * order * i / 1000);
    const double amplitude[] = {12e-6, 5e-6, 3e-6}, phase[] = {0.4, 1.3, 2.1};
    EXPECT_NEAR(std::abs(sum), amplitude[order - 1], 1e-9);
    EXPECT_NEAR(std::arg(sum), phase[order - 1], 1e-3);
  }
  // The y laser meets each mark of the shaft a quarter turn later.
  for (int i = 250; i < 1000; ++i) EXPECT_NEAR(y[i], x[i - 250], 1e-9);
}

TEST(OpenLoopReference, LatencyDelaysTheReading) {
  RigParameters p = RigParameters::ideal_rotor_b();
  p.laser.latency = 0.75e-3;
  const OpenLoopRecord late = record_open_loop(p);
  // x(t - 0.75 ms) by Taylor from the truth.
  const double v = late.truth["dx"][5000], ahead = late.truth["x"][5000] - late.measured["x"][5000];
  const double a = (late.truth["dx"][5001] - late.truth["dx"][4999]) / 2e-3;
  EXPECT_NEAR(ahead, v * 0.75e-3 - 0.5 * a * 0.75e-3 * 0.75e-3, 0.01 * std::abs(ahead));
}

TEST(OpenLoopReference, TenMillimetreLaserClipsAtFiveGrams) {
  RigParameters p;
  p.laser.range = 10e-3;
  VirtualRig rig(p);
  int invalid = 0;
  double largest = 0;
  for (; !rig.done(); rig.advance()) {
    invalid += !rig.read().valid;
    largest = std::max(largest, std::abs(rig.read().x));
  }
  EXPECT_GT(invalid, 50);
  EXPECT_NEAR(largest, 5e-3, 1e-6);
}

}  // namespace
}  // namespace whirl::rig
