#include "whirl/diagnosis/next_run.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/testing/balancing_jobs.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

/// A fitter who does what is proposed, on a rotor of the generator: warm, noise of 1 %.
struct Bench {
  testing::RandomJob rotor;
  std::mt19937_64 random;
  double noise = 0;
  BalancingJob job;

  Bench(int planes, unsigned seed) : random(seed) {
    testing::RandomJobOptions o;
    o.planes = planes;
    rotor = testing::random_job(o, seed);
    noise = 0.01 * rotor.vibration.norm() / std::sqrt(static_cast<double>(rotor.vibration.size()));
    job = rotor.job;
    job.runs.clear();
  }
  Eigen::VectorXcd read(const Eigen::VectorXcd& masses) {
    std::normal_distribution<double> normal;
    Eigen::VectorXcd v = rotor.vibration + rotor.influence * masses;
    for (Index m = 0; m < v.size(); ++m) v[m] += std::complex<double>(noise * normal(random), noise * normal(random));
    return v;
  }
  void measure(const NextRun& next) {
    const double t = static_cast<double>(job.runs.size());
    job.runs.push_back({"run " + std::to_string(job.runs.size() + 1), t, next.masses, read(next.masses)});
  }
  double left(const Eigen::VectorXcd& masses) const { return (rotor.vibration + rotor.influence * masses).norm(); }
};

// Whoever follows the proposals ends near the best that the planes can do, in few runs, and no trial is violent. The
// first trial mass is anything from a fifth to twice of what would be right.
TEST(NextRunProperty, FollowingTheProposalsBalancesTheRotor) {
  for (const int planes : {1, 2, 3}) {
    int near = 0, jobs = 100, violent = 0;
    double runs = 0;
    for (int k = 0; k < jobs; ++k) {
      Bench bench(planes, 83000 + static_cast<unsigned>(k));
      BalancingPlan plan;
      std::uniform_real_distribution<double> uniform(std::log(0.2), std::log(2.0));
      plan.trial =
          0.4 * bench.rotor.vibration.norm() / bench.rotor.influence.col(0).norm() * std::exp(uniform(bench.random));
      NextRun next;
      for (int r = 0; r < 20; ++r) {
        next = next_run(bench.job, plan);
        if (next.step == BalancingStep::done) break;
        violent += next.step == BalancingStep::trial && bench.left(next.masses) > 3 * bench.rotor.vibration.norm();
        bench.measure(next);
      }
      EXPECT_EQ(next.step, BalancingStep::done) << planes << " " << k;
      const double best =
          (bench.rotor.vibration -
           bench.rotor.influence * bench.rotor.influence.colPivHouseholderQr().solve(bench.rotor.vibration))
              .norm();
      near += bench.left(next.masses) <= 1.3 * best + 0.05 * bench.rotor.vibration.norm();
      runs += static_cast<double>(bench.job.runs.size());
    }
    std::cout << planes << " planes: near the best " << near << " of " << jobs << ", runs " << runs / jobs
              << ", violent trials " << violent << "\n";
    EXPECT_GE(near, 0.97 * jobs) << planes;
    EXPECT_LE(runs / jobs, planes + 5) << planes;
    EXPECT_LE(violent, 0.05 * jobs) << planes;
  }
}

// The check run stays within what was foretold in 93 to 97 % of the readings.
TEST(NextRunProperty, TheCheckIsForetoldHonestly) {
  int inside = 0, all = 0;
  for (unsigned k = 0; k < 200; ++k) {
    testing::RandomJobOptions o;
    o.drift = 0;
    testing::RandomJob j = testing::random_job(o, 91000 + k);
    for (const Foretold& f : check_last_run(j.job, {.drift = Drift::none})) inside += f.inside, ++all;
  }
  ASSERT_GT(all, 1000);
  EXPECT_GE(100.0 * inside / all, 93);
  EXPECT_LE(100.0 * inside / all, 97);
}

TEST(NextRun, ATrialStandsOppositeToTheHeavySpot) {
  BalancingJob job{{"A"}, {"X"}, {}, {}};
  BalancingPlan plan;
  plan.trial = 2;
  EXPECT_EQ(next_run(job, plan).step, BalancingStep::as_found);
  // Lag 30 deg, probe 45 deg after the keyphasor: high spot at 45 - 30 = 15 deg with rotation.
  const double degree = std::numbers::pi / 180;
  job.runs.push_back(
      {"as found", 0, Eigen::VectorXcd::Zero(1), Eigen::VectorXcd::Constant(1, std::polar(1.0, -30 * degree))});
  plan.high_spot = Eigen::VectorXd::Constant(1, 45 * degree);
  NextRun next = next_run(job, plan);
  EXPECT_EQ(next.step, BalancingStep::trial);
  EXPECT_NEAR(std::arg(next.masses[0]), (15 + 90) * degree, 1e-12);  // neither best nor worst on either side
  plan.heavy_ahead = Eigen::VectorXd::Constant(1, 0.0);
  next = next_run(job, plan);
  EXPECT_NEAR(std::abs(next.masses[0] - std::polar(2.0, (15 - 180) * degree)), 0, 1e-12);
}

TEST(NextRun, ATrialThatShowsNothingIsMadeLarger) {
  BalancingJob job{{"A"}, {"X"}, {}, {}};
  job.runs.push_back({"as found", 0, Eigen::VectorXcd::Zero(1), Eigen::VectorXcd::Constant(1, 10.0)});
  job.runs.push_back({"trial", 1, Eigen::VectorXcd::Ones(1), Eigen::VectorXcd::Constant(1, 10.4)});
  BalancingPlan plan;
  plan.trial = 1;
  const NextRun next = next_run(job, plan);
  EXPECT_EQ(next.step, BalancingStep::trial);
  EXPECT_GT(std::abs(next.masses[0]), 4);
  EXPECT_LT(next.masses[0].real(), 0);  // 0.4 per mass: the other side lowers it
  plan.limit = 1.2;
  const NextRun full = next_run(job, plan);  // no room for more, and so little is not worth a run
  EXPECT_EQ(full.step, BalancingStep::done);
  EXPECT_NE(full.why.find("cannot bring"), std::string::npos);
}

TEST(NextRun, AnUndecidedContradictionIsMeasuredAgain) {
  BalancingJob job{{"A"}, {"X", "Y"}, {}, {}};
  const Eigen::Vector2cd a(1, std::complex<double>(0, 1)), v(5, 3);
  const auto run = [&](std::complex<double> w, std::complex<double> off) {
    const double t = static_cast<double>(job.runs.size());
    const Eigen::Vector2cd jitter(0.01 * std::sin(7 * t), std::complex<double>(0, 0.01 * std::cos(5 * t)));
    job.runs.push_back({"r" + std::to_string(job.runs.size()), t, Eigen::VectorXcd::Constant(1, w),
                        Eigen::VectorXcd(v + a * w + jitter + Eigen::Vector2cd(off, 0.7 * off))});
  };
  run(0, 0);
  run(0, 0);
  run(2, 0);
  run(std::complex<double>(0, 2), 0);
  run(-4, std::complex<double>(1.3, 0.8));  // the last one is off by no usual slip
  BalancingPlan plan;
  plan.trial = 1;
  const NextRun next = next_run(job, plan, {.drift = Drift::none});
  EXPECT_EQ(next.step, BalancingStep::repeat);
  EXPECT_EQ(next.masses, job.runs.back().masses);
}

}  // namespace
}  // namespace whirl::diagnosis
