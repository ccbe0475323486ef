// Promise: an answer at the bench feels immediate: a job of ten runs on three planes with its search for
// contradictions, the next run, and min-max over many readings in well under a tenth of a second.
#include <benchmark/benchmark.h>

#include <random>

#include "whirl/diagnosis/influence_prior.hpp"
#include "whirl/diagnosis/next_run.hpp"
#include "whirl/testing/balancing_jobs.hpp"

namespace {

using namespace whirl;

testing::RandomJob job(bool wrong) {
  testing::RandomJobOptions o;
  o.planes = 3;
  o.wrong_run = wrong;
  return testing::random_job(o, 5);
}

void FitWithContradictions(benchmark::State& state) {
  const testing::RandomJob j = job(true);
  for (auto _ : state) benchmark::DoNotOptimize(diagnosis::fit_influence(j.job).contradictions.size());
}
BENCHMARK(FitWithContradictions)->Unit(benchmark::kMicrosecond);

void NextRun(benchmark::State& state) {
  const testing::RandomJob j = job(false);
  diagnosis::BalancingPlan plan;
  plan.trial = 1;
  for (auto _ : state) benchmark::DoNotOptimize(diagnosis::next_run(j.job, plan).masses.norm());
}
BENCHMARK(NextRun)->Unit(benchmark::kMicrosecond);

void MinMaxOfHundredReadingsOnSixPlanes(benchmark::State& state) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  diagnosis::CorrectionProblem p;
  p.influence =
      Eigen::MatrixXcd::NullaryExpr(100, 6, [&] { return std::complex<double>(normal(random), normal(random)); });
  p.vibration =
      Eigen::VectorXcd::NullaryExpr(100, [&] { return std::complex<double>(normal(random), normal(random)); });
  p.limit = Eigen::VectorXd::Constant(6, 0.2);
  for (auto _ : state)
    benchmark::DoNotOptimize(diagnosis::solve_correction(p, diagnosis::Criterion::min_max).objective);
}
BENCHMARK(MinMaxOfHundredReadingsOnSixPlanes)->Unit(benchmark::kMillisecond);

void WithPrior(benchmark::State& state) {
  const testing::RandomJob j = job(false);
  const diagnosis::InfluencePrior prior = diagnosis::relative_prior(j.influence, 0.3, 0.1, j.job.speed);
  for (auto _ : state) benchmark::DoNotOptimize(diagnosis::balance_with_prior(j.job, prior, 0.01).masses.norm());
}
BENCHMARK(WithPrior)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
