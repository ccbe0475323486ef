#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "rig_design.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/testing/sequential_rate.hpp"
#include "whirl/tuning/closed_loop.hpp"
#include "whirl/tuning/design.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {
namespace {

/// The default rig, whose actuators give 4 % less than their data sheet says, 2 degrees off, with one strong mode.
rig::RigParameters rig_with_mode(double hertz, double participation) {
  rig::RigParameters rig;
  rig.modes.front() = {hertz, 0.008, std::abs(participation), participation < 0 ? -1.0 : 1.0, 30e-6};
  return rig;
}

IdentifiedModel identified(const rig::RigParameters& rig) {
  IdentifiedModel m = true_model(rig);
  m.rotor->eps *= std::polar(0.99, 0.01);
  return m;
}

DesignOptions known_rig(const rig::RigParameters& rig, const char* law, const char* estimator) {
  DesignOptions o = options_of(data_sheet(rig), law, estimator);
  o.hardware.modes = rig.modes;
  for (rig::RigMode& mode : o.hardware.modes) mode.initial = 0;
  return o;
}

std::string all_warnings(const ControllerDesign& d) {
  std::string all;
  for (const std::string& warning : d.summary.warnings) all += warning + "\n";
  return all;
}

/// A certificate promises a sound run, with a peak near the one it states.
void expect_kept(const ControllerDesign& d, const rig::RigParameters& rig, const std::string& what) {
  ClosedLoopOptions options;
  options.run.seed = 4711;
  const ClosedLoopMetrics run = ClosedLoopPlant(rig, options).run(d);
  const bool certified = d.margins.at("certified") == 1;
  std::printf("%s: %s, %.1f um, stated %.1f um\n", what.c_str(), certified ? "certified" : "not certified",
              1e6 * run.closed.all, 1e6 * d.margins.at("peak_m"));
  if (!certified) return;
  EXPECT_TRUE(run.stable) << what << ": " << run.verdict.text();
  EXPECT_LE(run.closed.all, 1.5 * d.margins.at("peak_m")) << what;
}

// A loop of little stiffness, peak sensitivity 8: certified with 41 um before, 140 um on a rig whose only surprise is
// the tolerance of its actuators.
TEST(CertificateE2e, ALoopThatLivesOnExactActuatorsIsNotCertified) {
  const rig::RigParameters rig = rig_with_mode(46, -0.3);
  DesignOptions o = known_rig(rig, "lsmc", "kfe");
  o.fixed = {{"acceleration_noise", 3.30822},   {"boundary_layer", 0.691522}, {"cancel", 0.530323},
             {"eccentricity_walk", 1.45887e-5}, {"surface_gain", 5},          {"switching_gain", 2.07457}};
  o.evaluations = 1;
  const ControllerDesign d = design(identified(rig), o);
  EXPECT_EQ(d.margins.at("certified"), 0);
  EXPECT_NE(all_warnings(d).find("the peak rises"), std::string::npos) << all_warnings(d);
  EXPECT_GT(d.margins.at("peak_m"), 3 * d.margins.at("nominal_peak_m"));
}

struct ModeDesign {
  double hertz, participation;
  const char *law, *estimator;
};
/// Designs on rigs with strong modes: those that are certified, at least `least` of them, keep their peak.
void expect_certified_kept(const std::vector<ModeDesign>& designs, int least) {
  int certified = 0;
  for (const auto& [hertz, participation, law, estimator] : designs) {
    const rig::RigParameters rig = rig_with_mode(hertz, participation);
    DesignOptions o = known_rig(rig, law, estimator);
    o.evaluations = 8;
    const ControllerDesign d = design(identified(rig), o);
    certified += d.margins.at("certified") == 1;
    expect_kept(d, rig, std::string(law) + ", " + estimator);
  }
  EXPECT_GE(certified, least);
}

TEST(CertificateProperty, CertifiedDesignsKeepTheirPeakOnRigsWithStrongModes) {
  expect_certified_kept({{46.0, 0.03, "lqr", "eso"},
                         {46.0, 0.1, "smc_implicit", "kfe"},
                         {61.0, -0.1, "pd", "kfo"},
                         {46.0, -0.3, "pd_notch", "lpf"}},
                        3);
}
TEST(CertificateProperty, CertifiedSlidingAndInfluenceDesignsKeepTheirPeakOnRigsWithStrongModes) {
  expect_certified_kept({{46.0, 0.03, "sta", "eso"}, {46.0, 0.03, "pd_influence", "lpf"}}, 1);
}

/// A machine of the make: tolerances evenly spread, its own runout, a structure that rings or not, and one of three
/// courses: the profile, its reverse, the critical speed held.
rig::RigParameters drawn_machine(rig::RigParameters rig, std::mt19937_64& random, int course) {
  const auto within = [&](double size) { return size * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1); };
  constexpr double kHalfTurn = 3.14159265358979;
  rig.rotor.stiffness *= 1 + within(0.08);
  rig.rotor.damping *= 1 + within(0.3);
  rig.rotor.added_mass *= 1 + within(0.03);
  rig.rotor.added_phase += within(0.03);
  rig.actuator.gain_error = within(0.05);
  rig.actuator.axis_rotation = within(0.035);
  for (double* runout : {&rig.laser.runout_1x, &rig.laser.runout_2x, &rig.laser.runout_3x}) *runout *= 1 + within(0.4);
  for (double* phase : {&rig.laser.runout_phase_1x, &rig.laser.runout_phase_2x, &rig.laser.runout_phase_3x})
    *phase = within(kHalfTurn);
  for (rig::RigMode& mode : rig.modes) {
    mode.participation *= 1 + within(0.4);
    mode.initial *= 0.5 + within(0.5);
  }
  if (course == 1) return rig.run_up();
  if (course == 2) {
    rig.profile.ramp_time *= 1 - rig.natural_frequency() / rig.profile.omega_start;
    rig.profile.omega_end = rig.natural_frequency();
    rig.profile.dwell_end = 6;
  }
  return rig;
}

// What a certificate states holds on machines drawn apart, run down, run up and held at their critical speed: none
// diverges or is worse than without control, and few exceed its peak, of which at most 5 % may. WHIRL_CERTIFIED=30
// draws the machines of docs/validation-control.md.
TEST(CertificateE2e, ThePeakHoldsOnMachinesDrawnApartThroughEveryCourse) {
  const char* asked = std::getenv("WHIRL_CERTIFIED");
  const std::uint64_t least = asked != nullptr ? std::strtoull(asked, nullptr, 10) : 0;
  const rig::RigParameters rig = rig_with_mode(46, 0.03);
  std::vector<std::pair<ControllerDesign, double>> designs;  // and the largest peak, m
  for (const auto& [law, estimator] :
       {std::pair{"tsmc", "kfe"}, std::pair{"pd", "kfo"}, std::pair{"pd_influence", "lpf"}}) {
    DesignOptions o = known_rig(rig, law, estimator);
    o.evaluations = asked != nullptr ? 24 : 12;
    designs.emplace_back(design(identified(rig), o), 0);
    ASSERT_EQ(designs.back().first.margins.at("certified"), 1) << law;
  }
  std::mt19937_64 random(4747);
  testing::SequentialRate kept(0.98, 0.9);
  for (std::uint64_t n = 0; n < least || kept.open(); ++n) {
    for (auto& [d, largest] : designs) {
      for (const int course : {0, 1, 2}) {
        SCOPED_TRACE(d.law + " machine " + std::to_string(n) + " course " + std::to_string(course));
        ClosedLoopOptions options;
        options.run.seed = 9000 + n;
        const ClosedLoopMetrics run = ClosedLoopPlant(drawn_machine(rig, random, course), options).run(d);
        EXPECT_EQ(run.survived, 1);
        EXPECT_EQ(run.supervision & control::kUnheld, 0u);
        EXPECT_LE(run.closed.all, 1.05 * run.open.all);
        kept.add(run.closed.all <= d.margins.at("peak_m"));
        largest = std::max(largest, run.closed.all);
      }
    }
  }
  for (const auto& [d, largest] : designs)
    std::printf("%s, %s: stated %.1f um (typical %.1f), largest %.1f um\n", d.law.c_str(), d.estimator.c_str(),
                1e6 * d.margins.at("peak_m"), 1e6 * d.margins.at("typical_peak_m"), 1e6 * largest);
  std::printf("%d of %d runs above the peak that is stated\n", kept.draws() - kept.successes(), kept.draws());
  EXPECT_TRUE(kept.sound());
}

// The delay that a certificate states is held by what is delivered, its supervision included: half a sample inside it
// nothing steps in.
TEST(CertificateE2e, TheStatedDelayIsHeldWithSupervision) {
  const rig::RigParameters rig = rig_with_mode(46, 0.03);
  for (const auto& [law, estimator] : {std::pair{"pd", "lpf"}, std::pair{"tsmc", "kfe"}}) {
    DesignOptions o = known_rig(rig, law, estimator);
    o.evaluations = 4;
    const ControllerDesign d = design(identified(rig), o);
    rig::RigParameters late = tuning_plant(d.model, o.hardware);
    late.actuator.extra_delay_samples = static_cast<int>(d.margins.at("delay_margin_s") / d.sample_time);
    const ClosedLoopMetrics run = ClosedLoopPlant(late).run(d);
    std::printf("%s, %s: %d samples later: %s\n", law, estimator, late.actuator.extra_delay_samples,
                control::supervision_text(run.supervision).c_str());
    EXPECT_EQ(run.supervision & control::kUnheld, 0u) << law;
    EXPECT_EQ(run.survived, 1) << law;
  }
}

// The watch takes a rotor back that whirls more than it would without control: a design that does so on its own tuning
// plant may not be certified.
TEST(CertificateE2e, ADesignThatItsOwnWatchTakesBackIsNotCertified) {
  const rig::RigParameters rig = rig_with_mode(46, 0.03);
  DesignOptions o = known_rig(rig, "pd", "lpf");
  o.evaluations = 1;
  o.fixed = {{"watch_level", 2e-6}};
  const ControllerDesign d = design(identified(rig), o);
  EXPECT_EQ(d.margins.at("certified"), 0);
  EXPECT_NE(all_warnings(d).find("supervision steps in"), std::string::npos) << all_warnings(d);
}

}  // namespace
}  // namespace whirl::tuning
