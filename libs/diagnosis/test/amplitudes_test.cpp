// Balancing from amplitudes alone. Seeds: 95000 on; none served for choices.
#include "whirl/diagnosis/amplitudes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <numbers>

#include "whirl/testing/error_of.hpp"
#include "whirl/testing/unrepeatable_jobs.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;

Complex at(double size, double degree) { return std::polar(size, degree * std::numbers::pi / 180); }

/// Lengths of baseline + influence mass.
BalancingJob job_of(const std::vector<Complex>& masses, const std::vector<Complex>& baseline,
                    const std::vector<Complex>& influence) {
  BalancingJob job{{"P"}, {}, {}, {}, false};
  for (std::size_t m = 0; m < baseline.size(); ++m) {
    job.rows.push_back("probe " + std::to_string(m + 1));
    job.speed.push_back(0);
  }
  for (const Complex& w : masses) {
    Eigen::VectorXcd v(static_cast<Index>(baseline.size()));
    for (std::size_t m = 0; m < baseline.size(); ++m)
      v[static_cast<Index>(m)] = std::abs(baseline[m] + influence[m] * w);
    job.runs.push_back({std::to_string(job.runs.size() + 1), static_cast<double>(job.runs.size()),
                        Eigen::VectorXcd::Constant(1, w), v});
  }
  return job;
}

Complex mass_of(const AmplitudeFit& f) {
  return f.fit.influence.col(0).dot(-f.fit.baseline) / f.fit.influence.col(0).squaredNorm();
}

// The classical construction with three circles: 4.2 mm/s as found; 10 g at 0, 120 and 240 deg: 1.720, 5.569, 6.778.
// By hand: (mean of the squares - 4.2^2) is the square of the effect, 3.0; the mass is 10 g times 4.2 / 3, at 20 deg.
TEST(AmplitudesReference, FourRunsAtThreeAnglesGiveTheMassOfTheConstruction) {
  BalancingJob job{{"P"}, {"DE"}, {0}, {}, false};
  const double read[] = {4.200, 1.720, 5.569, 6.778};
  const Complex on[] = {0, at(10, 0), at(10, 120), at(10, 240)};
  for (int r = 0; r < 4; ++r)
    job.runs.push_back(
        {std::to_string(r + 1), 1.0 * r, Eigen::VectorXcd::Constant(1, on[r]), Eigen::VectorXcd::Constant(1, read[r])});
  const AmplitudeFit f = fit_amplitudes(job);
  EXPECT_TRUE(f.or_influence.empty());
  EXPECT_NEAR(std::abs(mass_of(f)), 14, 0.03);
  EXPECT_NEAR(std::arg(mass_of(f)) * 180 / std::numbers::pi, 20, 0.2);
  EXPECT_EQ(f.fit.spare, 1);
}

TEST(Amplitudes, ThreeRunsLeaveTwoAnswersAndBothAreGiven) {
  const Complex truth = at(14, 20);
  const AmplitudeFit f = fit_amplitudes(job_of({0, at(10, 0), at(10, 120)}, {at(4, 70)}, {-at(4, 70) / truth}));
  ASSERT_EQ(f.or_influence.size(), 1U);
  const Complex other = -f.or_baseline[0][0] / f.or_influence[0](0, 0);
  EXPECT_LT(std::min(std::abs(mass_of(f) - truth), std::abs(other - truth)), 1e-4);
  EXPECT_GT(std::abs(mass_of(f) - other), 1);
  ASSERT_NE(f.fit.summary.find(FindingCode::scatter_unknown), nullptr);
}

TEST(Amplitudes, TrialsOnOneLineLeaveTheMirrorImage) {
  const Complex truth = at(14, 65);
  const AmplitudeFit f =
      fit_amplitudes(job_of({0, at(10, 0), at(10, 180), at(5, 0), at(7, 180)}, {at(4, 70)}, {-at(4, 70) / truth}));
  ASSERT_EQ(f.or_influence.size(), 1U);
  const Complex other = -f.or_baseline[0][0] / f.or_influence[0](0, 0);
  EXPECT_NEAR(std::abs(other - std::conj(mass_of(f))), 0, 1e-3);
}

TEST(Amplitudes, TooFewRunsAreRefusedWithTheNumberNeeded) {
  const std::string error = testing::error_of([] {
    fit_amplitudes(job_of({0, at(10, 0)}, {at(4, 70)}, {at(0.3, 10)}));
  });
  EXPECT_THAT(error, ::testing::HasSubstr("2 runs read it"));
  EXPECT_THAT(error, ::testing::HasSubstr("3 at least"));
}

// Lengths of jobs of one and two planes with 1 % of scatter: the masses of the true vectors, within the interval.
TEST(AmplitudesProperty, IntervalsHoldWithoutPhases) {
  int inside = 0, all = 0, ambiguous = 0;
  constexpr int kJobs = 60;
  for (int k = 0; k < kJobs; ++k) {
    testing::UnrepeatableJobOptions o;
    o.planes = 1;
    o.probes = 2;
    o.runs = 7;
    o.phases = false;
    testing::UnrepeatableJob j = testing::unrepeatable_job(o, 95000 + static_cast<unsigned>(k));
    AmplitudeFit f;
    // Runs that are all nearly repeats of two states tell no mass.
    if (testing::error_of([&] { f = fit_amplitudes(j.job); }) != "no error" || !f.or_influence.empty()) {
      ++ambiguous;
      continue;
    }
    CorrectionProblem found, truth;
    found.influence = f.fit.influence, found.vibration = f.fit.baseline;
    truth.influence = j.influence, truth.vibration = j.vibration;
    const Eigen::VectorXcd w = solve_correction(found, Criterion::least_squares).masses,
                           best = solve_correction(truth, Criterion::least_squares).masses;
    const CorrectionUncertainty u = amplitude_uncertainty(f, found, {0}, Criterion::least_squares, w);
    inside += u.real(0, w).covers(best[0].real()) + u.imag(0, w).covers(best[0].imag());
    all += 2;
  }
  EXPECT_GE(inside, 0.85 * all);
  EXPECT_LE(ambiguous, kJobs / 2);
  std::cout << "intervals " << inside << " of " << all << ", ambiguous " << ambiguous << " of " << kJobs << "\n";
}

TEST(AmplitudesProperty, TwoPlanesAreToldByEightRuns) {
  int right = 0, decided = 0;
  for (int k = 0; k < 12; ++k) {
    testing::UnrepeatableJobOptions o;
    o.planes = 2;
    o.probes = 2;
    o.runs = 9;
    o.noise = 1e-4;
    o.phases = false;
    const testing::UnrepeatableJob j = testing::unrepeatable_job(o, 96000 + static_cast<unsigned>(k));
    InfluenceOptions options;
    options.noise = 1e-3 * j.vibration.norm();
    AmplitudeFit f;
    if (testing::error_of([&] { f = fit_amplitudes(j.job, options); }) != "no error") continue;
    CorrectionProblem found, truth;
    found.influence = f.fit.influence, found.vibration = f.fit.baseline;
    truth.influence = j.influence, truth.vibration = j.vibration;
    const Eigen::VectorXcd w = solve_correction(found, Criterion::least_squares).masses;
    decided += f.or_influence.empty();
    right += f.or_influence.empty() && objective(truth, Criterion::least_squares, w) < 0.1 * j.vibration.norm();
  }
  EXPECT_GE(right, 0.9 * decided);
  EXPECT_GE(decided, 4);
}

}  // namespace
}  // namespace whirl::diagnosis
