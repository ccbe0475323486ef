// Scatter of a fit of influences in closed form.
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <string>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;

/// One plane, three probes whose influences and readings as found differ; a run for every mass.
BalancingJob job_of(const std::vector<Complex>& masses) {
  BalancingJob job;
  job.planes = {"A"};
  job.rows = {"X", "Y", "Z"};
  for (const Complex mass : masses) {
    BalancingRun run;
    run.name = std::to_string(job.runs.size() + 1);
    run.masses = Eigen::VectorXcd::Constant(1, mass);
    run.vibration = Eigen::Vector3cd(Complex(50e-6, 10e-6) + Complex(1e-3, 5e-3) * mass,
                                     Complex(-20e-6, 30e-6) + Complex(-4e-3, 2e-3) * mass,
                                     Complex(5e-6, -60e-6) + Complex(2e-3, 3e-3) * mass);
    job.runs.push_back(run);
  }
  return job;
}

// Twice as found, once with a trial mass w: the influence is the difference of both over w.
TEST(InfluenceReference, DeviationOfAnInfluenceFollowsFromTheRuns) {
  const Complex w = std::polar(0.01, 0.8);
  InfluenceOptions options;
  options.noise = 1e-7;
  options.drift = Drift::none;
  const InfluenceFit fit = fit_influence(job_of({0, 0, w}), options);
  ASSERT_TRUE(fit.contradictions.empty());
  for (Eigen::Index row = 0; row < 3; ++row) {
    EXPECT_GT(fit.noise[row], 0);
    EXPECT_NEAR(fit.sd(row, 0), fit.noise[row] * std::sqrt(0.5 + 1) / std::abs(w), 1e-9 * fit.sd(row, 0));
  }
}

// A phase read half a turn off: the run goes out, no spare run is left, and none is invented.
TEST(InfluenceReference, ARunLeftOutTakesTheOnlySpareOne) {
  BalancingJob job = job_of({0, std::polar(0.01, 0.3), std::polar(0.017, 1.9)});
  InfluenceOptions options;
  options.drift = Drift::none;
  EXPECT_EQ(fit_influence(job, options).spare, 1);
  job.runs[2].vibration *= -1;
  const InfluenceFit fit = fit_influence(job, options);
  ASSERT_EQ(fit.contradictions.size(), 1u);
  EXPECT_EQ(fit.contradictions[0].run, 2);
  EXPECT_TRUE(fit.contradictions[0].left_out) << fit.contradictions[0].slip;
  EXPECT_EQ(fit.spare, 0);
}

}  // namespace
}  // namespace whirl::diagnosis
