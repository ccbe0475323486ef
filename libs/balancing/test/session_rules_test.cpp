#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <filesystem>
#include <functional>
#include <numbers>

#include "whirl/balancing/session.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"

// What a guided job proposes, by hand.
namespace whirl::balancing {
namespace {

constexpr double kPi = std::numbers::pi;

class SessionRules : public ::testing::Test {
 protected:
  SessionRules() : path_(std::filesystem::temp_directory_path() / fmt::format("whirl_rules_{}.toml", ::getpid())) {}
  ~SessionRules() override { std::filesystem::remove(path_); }
  static NewJob fan() {
    NewJob job;
    job.planes = {"A"};
    job.probes = {"X"};
    job.speeds = {50 * kPi};
    job.convention = {"lag", "pp", "against"};
    job.trial = 4e-3;
    job.target = 4e-6;
    return job;
  }
  void begin(const NewJob& job) { io::write_text(path_, new_job_text(job, path_)); }
  RunTaken take(const std::string& readings) {
    RunMade run;
    run.readings = readings;
    return add_run(path_, run);
  }
  /// 120 um p-p found and 5 mm/kg 0-p, phases as lag.
  std::string reading() {
    const GuidedStep step = guided_step(path_);
    const std::complex<double> mass = step.next.masses.size() > 0 ? step.next.masses[0] : 0;
    const std::complex<double> v = std::polar(60e-6, 2.1) + std::polar(5e-3, -0.8) * mass;
    return fmt::format("{:.6f}@{:.6f}", 2e6 * std::abs(v), -std::arg(v) * 180 / kPi);
  }
  const std::string path_;
};

TEST_F(SessionRules, RunsAreNamedAfterTheirPurpose) {
  begin(fan());
  EXPECT_EQ(take(reading()).name, diagnosis::step_name(diagnosis::BalancingStep::as_found));
  EXPECT_EQ(take(reading()).name, std::string(diagnosis::step_name(diagnosis::BalancingStep::trial)) + " A");
  EXPECT_EQ(take(reading()).name, "correction");
  EXPECT_EQ(guided_step(path_).next.step, diagnosis::BalancingStep::done);
  EXPECT_EQ(take(reading()).name, "check");
  EXPECT_EQ(take(reading()).name, "check 2");
}

TEST_F(SessionRules, WithoutATrialMassItsForceIsATenthOfTheWeightOnABearing) {
  for (const int planes : {1, 2}) {
    NewJob job = fan();
    job.trial = 0;
    job.options.rotor.mass = 12;
    job.options.rotor.radius = 0.2;
    if (planes == 2) job.planes = {"A", "B"}, job.probes = {"X", "Y"};
    begin(job);
    take(planes == 1 ? "120@10" : "120@10 80@20");
    const GuidedStep step = guided_step(path_);
    ASSERT_EQ(step.next.step, diagnosis::BalancingStep::trial);
    const double expected = 0.1 * (planes == 1 ? 1 : 0.5) * 12 * 9.80665 / (0.2 * std::pow(50 * kPi, 2));
    EXPECT_NEAR(step.next.masses.cwiseAbs().maxCoeff(), expected, 0.02 * expected) << planes;
  }
}

TEST_F(SessionRules, TheHeavySpotIsSoughtOnTheSideThatTheCriticalSpeedTells) {
  const auto trial = [&](double critical) {
    NewJob job = fan();
    job.probe_angles = {0.4};
    job.critical_speed = critical;
    begin(job);
    take("120@10");
    return guided_step(path_).next.masses[0];
  };
  const std::complex<double> below = trial(100 * kPi), above = trial(25 * kPi), at = trial(50 * kPi);
  EXPECT_NEAR(std::abs(std::remainder(std::arg(above / below) - kPi, 2 * kPi)), 0, 1e-6);
  EXPECT_NEAR(std::abs(std::arg(at / below)), kPi / 2, 1e-6);
  EXPECT_NEAR(std::arg(trial(50 * kPi / 0.89) / below), 0, 1e-6);
  EXPECT_NEAR(std::abs(std::arg(trial(50 * kPi / 1.11) / above)), 0, 1e-6);
}

TEST_F(SessionRules, TheStepAsJsonHasMassesAndAnglesAsTheJobCountsThem) {
  begin(fan());
  take(reading());
  take(reading());
  const GuidedStep step = guided_step(path_);
  const io::JsonReader json(step.json, "step");
  const io::JsonReader mass = json.at("masses").items().at(0);
  EXPECT_NEAR(mass.at("mass_kg").number(), 12e-3, 1e-6);
  // Opposite to the found vector over the influence, counted against the rotation.
  const double angle = -std::arg(-std::polar(1.0, 2.1 + 0.8)) * 180 / kPi;
  EXPECT_NEAR(std::remainder(mass.at("angle_deg").number() - angle, 360), 0, 1e-3);
  EXPECT_EQ(json.at("runs").number(), 2);
  const auto plane = std::ranges::find(step.instructions, "plane A", &std::pair<std::string, std::string>::first);
  ASSERT_NE(plane, step.instructions.end());
  EXPECT_TRUE(plane->second.starts_with("12 g at ")) << plane->second;
  EXPECT_NE(plane->second.find("(in the last run: 4 g at "), std::string::npos) << plane->second;
  ASSERT_TRUE(step.solved);
  EXPECT_EQ(step.summary.status, std::max(step.next.summary.status, step.solved->sheet.summary.status));
  EXPECT_EQ(step.solved->sheet.summary.status, Status::warning) << "no run repeats another";
}

TEST_F(SessionRules, WhatIsAllowedCountsAsTheReadingsDo) {
  // Two probes, one plane: the correction leaves 40 um p-p at each.
  const auto warned = [&](double allowed) {
    NewJob job = fan();
    job.probes = {"X", "Y"};
    job.allowed = allowed;
    begin(job);
    for (int run = 0; run < 2; ++run) {
      const GuidedStep step = guided_step(path_);
      const std::complex<double> mass = step.next.masses.size() > 0 ? step.next.masses[0] : 0;
      std::string readings;
      for (const double size : {80e-6, 40e-6}) {
        const std::complex<double> v = std::polar(size, 2.1) + std::polar(5e-3, -0.8) * mass;
        readings += fmt::format("{:.6f}@{:.6f} ", 2e6 * std::abs(v), -std::arg(v) * 180 / kPi);
      }
      take(readings);
    }
    const GuidedStep step = guided_step(path_);
    EXPECT_EQ(step.next.step, diagnosis::BalancingStep::correction);
    EXPECT_EQ(io::JsonReader(step.json, "step").at("predicted_0p").items().size(), 2);
    return std::ranges::any_of(step.next.summary.warnings, [](const std::string& w) {
      return w.find("above what is allowed") != std::string::npos;
    });
  };
  EXPECT_TRUE(warned(30e-6));
  EXPECT_TRUE(warned(39e-6));
  EXPECT_FALSE(warned(41e-6));
  EXPECT_FALSE(warned(100e-6));
  EXPECT_FALSE(warned(0)) << "nothing is stated";
}

TEST_F(SessionRules, ARunThatTheOthersDoNotPredictIsNamed) {
  const auto warned = [&](double off) {
    NewJob job = fan();
    job.probes = {"X", "Y"};
    begin(job);
    std::complex<double> mass = 0;
    for (int run = 0; run < 6; ++run) {
      RunMade made;
      made.masses = fmt::format("{:.6f}@{:.6f}", 1e3 * std::abs(mass), -std::arg(mass) * 180 / kPi);
      for (const double angle : {2.1, 0.3}) {
        // A scatter of 0.2 um, and the last run elsewhere.
        const std::complex<double> v = std::polar(60e-6, angle) + std::polar(5e-3, -0.8) * mass +
                                       std::polar(0.2e-6, 2.4 * run + angle) + (run == 5 ? off : 0);
        made.readings += fmt::format("{:.6f}@{:.6f} ", 2e6 * std::abs(v), -std::arg(v) * 180 / kPi);
      }
      add_run(path_, made);
      mass = std::polar(4e-3, 1.3 * run);
    }
    const GuidedStep step = guided_step(path_);
    EXPECT_EQ(step.check.size(), 2);
    // The sheet has them in the job's own kind: peak to peak.
    EXPECT_TRUE(step.solved && step.solved->sheet.check.size() == step.check.size());
    for (std::size_t k = 0; k < step.check.size() && step.solved; ++k) {
      EXPECT_NEAR(step.solved->sheet.check[k].measured / step.check[k].measured, 2, 1e-9);
      EXPECT_NEAR(step.solved->sheet.check[k].predicted.value / step.check[k].predicted.value, 2, 1e-9);
    }
    return std::ranges::any_of(step.summary.warnings, [](const std::string& w) {
      return w.find("outside of what the earlier runs predict") != std::string::npos;
    });
  };
  EXPECT_FALSE(warned(0));
  EXPECT_TRUE(warned(30e-6));
}

}  // namespace
}  // namespace whirl::balancing
