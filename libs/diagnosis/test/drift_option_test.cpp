#include <gtest/gtest.h>

#include <complex>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {
namespace {

/// One plane, one probe, `runs` runs; as found it grows by 1 um a run.
BalancingJob warming(int runs) {
  BalancingJob job;
  job.planes = {"A"};
  job.rows = {"X"};
  for (int k = 0; k < runs; ++k) {
    BalancingRun run;
    run.name = std::to_string(k + 1);
    run.time = k;
    run.masses = Eigen::VectorXcd::Constant(1, k % 2 == 1 ? 0.01 : 0.0);
    run.vibration = Eigen::VectorXcd::Constant(1, 50e-6 + 1e-6 * k) + std::complex<double>(0, 5e-3) * run.masses;
    job.runs.push_back(run);
  }
  return job;
}

TEST(DriftOption, IsFittedWhenAskedForAndByItselfWhereRunsAreSpare) {
  for (const int runs : {4, 7}) {
    InfluenceOptions options;
    options.noise = 1e-7;
    options.drift = Drift::none;
    const InfluenceFit none = fit_influence(warming(runs), options);
    EXPECT_FALSE(none.with_drift);
    EXPECT_EQ(none.drift.norm(), 0);
    options.drift = Drift::linear;
    const InfluenceFit linear = fit_influence(warming(runs), options);
    EXPECT_TRUE(linear.with_drift);
    EXPECT_NEAR(std::abs(linear.drift[0] - 1e-6), 0, 1e-12);
    EXPECT_NEAR(std::abs(linear.influence(0, 0) - std::complex<double>(0, 5e-3)), 0, 1e-9);
    EXPECT_NEAR(std::abs(linear.baseline[0]), 50e-6 + 1e-6 * (runs - 1), 1e-11) << "at the time of the last run";
  }
  EXPECT_TRUE(fit_influence(warming(7)).with_drift);
  EXPECT_FALSE(fit_influence(warming(3)).with_drift);
}

}  // namespace
}  // namespace whirl::diagnosis
