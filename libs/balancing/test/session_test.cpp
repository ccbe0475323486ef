#include "whirl/balancing/session.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <numbers>

#include "whirl/balancing/solve.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"

namespace whirl::balancing {
namespace {

using Complex = std::complex<double>;

/// A machine of one plane and one probe that answers to masses linearly; readings with phase lag and peak-to-peak.
struct Machine {
  Complex found = std::polar(60e-6, 2.1), influence = std::polar(5e-3, -0.8);  // m 0-p, m/kg
  std::string reading(Complex mass) const {
    const Complex v = found + influence * mass;
    return fmt::format("{:.6f}@{:.6f}", 2e6 * std::abs(v), -std::arg(v) * 180 / std::numbers::pi);
  }
};

NewJob fan() {
  NewJob job;
  job.planes = {"A"};
  job.probes = {"X"};
  job.speeds = {50 * std::numbers::pi};
  job.convention = {"lag", "pp", "against"};
  job.trial = 4e-3;
  job.target = 4e-6;
  return job;
}

class SessionFile : public ::testing::Test {
 protected:
  SessionFile() : path_(std::filesystem::temp_directory_path() / fmt::format("whirl_session_{}.toml", ::getpid())) {
    io::write_text(path_, new_job_text(fan(), path_));
  }
  ~SessionFile() override { std::filesystem::remove(path_); }
  /// Makes the run that is asked for; false when the job is done.
  bool follow(const Machine& machine, const JobOptions& options = {}) {
    const GuidedStep step = guided_step(path_, options);
    if (step.next.step == diagnosis::BalancingStep::done) return false;
    RunMade run;
    run.readings = machine.reading(step.next.masses.size() > 0 ? step.next.masses[0] : 0);
    add_run(path_, run, options);
    return true;
  }
  std::string path_;
};

// Two programs that each add a run would lose one of them.
TEST_F(SessionFile, AJobThatAnotherProgramWritesIsRefusedAndLeftAsItIs) {
  const std::string before = io::read_text(path_);
  {
    const io::WriterLock other(path_);
    EXPECT_THROW(follow(Machine()), Error);
    EXPECT_THROW(undo_run(path_), Error);
    EXPECT_EQ(io::read_text(path_), before);
  }
  EXPECT_TRUE(follow(Machine()));
  EXPECT_NE(io::read_text(path_), before);
}

TEST_F(SessionFile, AFollowedJobEndsAtTheMassThatNullsTheReading) {
  const Machine machine;
  int runs = 0;
  while (follow(machine)) ASSERT_LT(++runs, 6);
  EXPECT_EQ(runs, 3);  // as found, trial, check
  const GuidedStep end = guided_step(path_);
  EXPECT_TRUE(end.next.target_held);
  ASSERT_TRUE(end.solved.has_value());
  EXPECT_NEAR(std::abs(end.next.masses[0] + machine.found / machine.influence), 0, 1e-7);
  ASSERT_EQ(end.check.size(), 1U);
  EXPECT_LT(end.check[0].measured, 2e-6);
  // The sheet counts angles against the rotation and amplitudes peak to peak, as the job does.
  EXPECT_NEAR(end.solved->sheet.rows[0].before.value, 120e-6, 1e-9);
  const double written = end.solved->sheet.planes[0].angle.value;
  EXPECT_NEAR(std::remainder(written + std::arg(end.next.masses[0]), 2 * std::numbers::pi), 0, 1e-4);
}

TEST_F(SessionFile, WhatIsAskedComesBeforeWhatTheFileStates) {
  const Machine machine;
  while (follow(machine)) continue;
  JobOptions options;
  EXPECT_EQ(guided_step(path_).solved->sheet.criterion, "least-squares");
  options.criterion = diagnosis::Criterion::min_max;
  EXPECT_EQ(guided_step(path_, options).solved->sheet.criterion, "min-max");
}

TEST_F(SessionFile, ARefusedRunLeavesTheFileAsItWas) {
  const std::string before = io::read_text(path_);
  for (const char* readings : {"1@2 3@4", "one@2", "-5@10", ""}) {
    RunMade run;
    run.readings = readings;
    EXPECT_THROW(add_run(path_, run), Error) << readings;
    EXPECT_EQ(io::read_text(path_), before) << readings;
  }
  RunMade run;
  run.readings = "100@20";
  EXPECT_EQ(add_run(path_, run).number, 1U);
  undo_run(path_);
  EXPECT_EQ(guided_step(path_).file.job.runs.size(), 0U);
  EXPECT_THROW(undo_run(path_), Error);
}

TEST(Session, ANewJobSaysWhatItNeeds) {
  for (const auto& [spoil, word] : std::vector<std::pair<std::function<void(NewJob&)>, std::string>>{
           {[](NewJob& j) { j.planes.clear(); }, "--planes"},
           {[](NewJob& j) { j.convention.phase.clear(); }, "--phase"},
           {[](NewJob& j) { j.convention.angles = "left"; }, "left"},
           {[](NewJob& j) { j.trial = 0; }, "--trial-gram"},
           {[](NewJob& j) {
              j.probe_angles = {0, 1};
            },
            "2 angles for 1"}}) {
    NewJob job = fan();
    spoil(job);
    try {
      new_job_text(job, "fan.toml");
      FAIL() << word;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find(word), std::string::npos) << e.what();
    }
  }
}

// The same job as `whirl balance fan.toml` reads it, without leading.
TEST_F(SessionFile, RunUpsOfDifferingRatesAreSaidWhenTheJobIsSolvedAtOnce) {
  const auto said = [&](double second) {
    std::string text =
        "[job]\nplanes = [\"A\"]\nprobes = [\"X\"]\nspeeds_rpm = [1500]\nphase = \"lag\"\namplitude = \"pp\"\n"
        "angles = \"against\"\n";
    int run = 0;
    for (const double grams : {0.0, 4.0, 8.0}) {
      const Machine machine;
      const Complex v = machine.found + machine.influence * (grams * 1e-3);
      text += fmt::format(
          "[[run]]\nmasses_gram = [{}]\nangles_deg = [0]\namplitudes_um = [{:.9f}]\nphases_deg = [{:.9f}]\n"
          "sweep = {}\n",
          grams, 2e6 * std::abs(v), -std::arg(v) * 180 / std::numbers::pi, run++ == 1 ? second : 1e-3);
    }
    io::write_text(path_, text);
    const Summary summary = solve_job(path_, read_job(path_, {}, 0), {}).sheet.summary;
    return std::any_of(summary.warnings.begin(), summary.warnings.end(),
                       [](const std::string& w) { return w.find("differing rates") != std::string::npos; });
  };
  EXPECT_TRUE(said(2e-3));
  EXPECT_FALSE(said(1.05e-3));
}

}  // namespace
}  // namespace whirl::balancing
