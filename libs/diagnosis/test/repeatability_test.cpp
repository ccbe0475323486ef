// Machines that do not come back to the same state. Seeds: 3000 on served for choices, 81000 on judge here, 71000 on
// judge in bench/diagnosis_repeatability.cpp.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/diagnosis/influence.hpp"
#include "whirl/diagnosis/left_out.hpp"
#include "whirl/testing/unrepeatable_jobs.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;

struct Held {
  int inside = 0, all = 0, dropped = 0, sound = 0, named = 0, wrong = 0;
};

Held count(double unrepeatable, bool slip, unsigned seed, int jobs) {
  Held h;
  for (int k = 0; k < jobs; ++k) {
    testing::UnrepeatableJobOptions o;
    o.planes = 1 + k % 2;
    o.probes = 1 + (k / 2) % 4;
    o.runs = o.planes + 4 + k % 5;
    o.unrepeatable = unrepeatable;
    o.slip = slip;
    const testing::UnrepeatableJob j = testing::unrepeatable_job(o, seed + static_cast<unsigned>(k));
    const InfluenceFit fit = fit_influence(j.job);
    CorrectionProblem found, truth;
    found.influence = fit.influence, found.vibration = fit.baseline;
    truth.influence = j.influence, truth.vibration = j.vibration;
    const Eigen::VectorXcd w = solve_correction(found, Criterion::least_squares).masses,
                           best = solve_correction(truth, Criterion::least_squares).masses;
    bool undecided = false, named = false;
    for (const Contradiction& c : fit.contradictions) {
      undecided = undecided || !c.or_run.empty();
      h.dropped += c.left_out && c.run != j.wrong;
      named = named || c.run == j.wrong || std::count(c.or_run.begin(), c.or_run.end(), j.wrong) > 0;
    }
    h.sound += o.runs - (slip ? 1 : 0);
    h.wrong += j.visible;
    h.named += j.visible && named;
    if (undecided) continue;
    const CorrectionUncertainty u = correction_uncertainty(fit, found, w);
    for (Index p = 0; p < w.size(); ++p) {
      h.inside += u.magnitude(p, w).covers(std::abs(best[p]));
      h.all += 1;
    }
  }
  return h;
}

// Binomial bounds of 95 % at four deviations for some 180 intervals: 88.5 to 100 %.
TEST(RepeatabilityProperty, IntervalsHoldAndNoSoundRunGoesOutWhateverTheMachineDoes) {
  int dropped = 0, sound = 0;
  for (const double unrepeatable : {0.0, 0.1, 0.3, 0.5}) {
    const Held h = count(unrepeatable, false, 81000 + static_cast<unsigned>(unrepeatable * 1e4), 120);
    EXPECT_GE(h.inside, 0.885 * h.all) << unrepeatable;
    dropped += h.dropped;
    sound += h.sound;
  }
  EXPECT_LE(dropped, 0.01 * sound);
}

TEST(RepeatabilityProperty, ASlipIsNamedWhereTheMachineRepeats) {
  const Held h = count(0.005, true, 86000, 120);
  EXPECT_GE(h.named, 0.9 * h.wrong);
  EXPECT_GE(h.wrong, 90);
  EXPECT_LE(h.dropped, 0.01 * h.sound);
}

/// Two planes, two probes: as found, trials, as found again, both; the second probe of run 3 read 180 degrees off.
BalancingJob job_with_a_turned_probe(int runs) {
  BalancingJob job{{"A", "B"}, {"X", "Y"}, {0, 0}, {}};
  Eigen::Matrix2cd a;
  a << Complex(3, 1), Complex(-1, 2), Complex(0.5, -2), Complex(4, 0.3);
  const Eigen::Vector2cd b(Complex(30, 10), Complex(-20, 25));
  const std::vector<Eigen::Vector2cd> on = {{0.0, 0.0}, {8.0, 0.0},  {0.0, Complex(0, 7)},
                                            {0.0, 0.0}, {-5.0, 6.0}, {4.0, Complex(0, 4)}};
  const Complex off[] = {{0.2, -0.1}, {-0.3, 0.2}, {0.1, 0.2}, {-0.2, -0.2}, {0.2, 0.3}, {0.1, -0.3}};
  for (int r = 0; r < runs; ++r) {
    Eigen::Vector2cd v = b + a * on[static_cast<std::size_t>(r)];
    v += Eigen::Vector2cd(off[r], off[(r + 2) % 6]);
    if (r == 4) v[1] = -v[1];
    job.runs.push_back({std::to_string(r + 1), static_cast<double>(r), on[static_cast<std::size_t>(r)], v});
  }
  return job;
}

// The fifth run is the only check. With a drift fitted to five runs its turned probe fitted, and 0 g to any mass held.
TEST(Repeatability, AnAutomaticDriftDoesNotTakeTheLastFreedomAndHideATurnedProbe) {
  const InfluenceFit fit = fit_influence(job_with_a_turned_probe(5));
  EXPECT_FALSE(fit.with_drift);
  ASSERT_EQ(fit.contradictions.size(), 1U);
  EXPECT_EQ(fit.contradictions[0].run, 4);
  EXPECT_THAT(fit.contradictions[0].slip, ::testing::HasSubstr("phase of Y is 180 deg off"));
  ASSERT_NE(fit.summary.find(FindingCode::run_contradicted), nullptr);
  ASSERT_NE(fit.summary.find(FindingCode::freedom_spent), nullptr);
  EXPECT_EQ(fit.summary.find(FindingCode::freedom_spent)->amount("spare"), 1);
}

TEST(Repeatability, ADriftThatIsAskedForSaysThatItTakesTheLastFreedom) {
  InfluenceOptions options;
  options.drift = Drift::linear;
  const InfluenceFit fit = fit_influence(job_with_a_turned_probe(5), options);
  EXPECT_TRUE(fit.with_drift);
  ASSERT_NE(fit.summary.find(FindingCode::freedom_spent), nullptr);
  EXPECT_EQ(fit.summary.find(FindingCode::freedom_spent)->amount("spare"), 1);
}

/// Six runs of one plane and one probe; the second and third as at a hydro-generator: 36.4 kg reads 120 um at 191 deg,
/// 36.5 kg at the same angle 199 um at 166 deg.
BalancingJob hydro_generator(double spread) {
  BalancingJob job{{"rotor"}, {"guide bearing"}, {0}, {}};
  const auto reading = [](double um, double degree) { return std::polar(um * 1e-6, -degree * std::numbers::pi / 180); };
  const Complex middle = 0.5 * (reading(120, 191) + reading(199, 166));
  const auto run = [&](double kg, double degree, Complex v) {
    job.runs.push_back({std::to_string(job.runs.size() + 1), static_cast<double>(job.runs.size()),
                        Eigen::VectorXcd::Constant(1, std::polar(kg, degree * std::numbers::pi / 180)),
                        Eigen::VectorXcd::Constant(1, v)});
  };
  const Complex influence = reading(3.2, 40), found = middle - influence * std::polar(36.4, 0.5);
  run(0, 0, found);
  run(36.4, 0.5 * 180 / std::numbers::pi, middle + spread * (reading(120, 191) - middle));
  run(36.5, 0.5 * 180 / std::numbers::pi, middle + spread * (reading(199, 166) - middle));
  run(25, 150, found + influence * std::polar(25.0, 150 * std::numbers::pi / 180) + spread * reading(30, 20));
  run(30, 260, found + influence * std::polar(30.0, 260 * std::numbers::pi / 180) + spread * reading(25, 250));
  run(0, 0, found + spread * reading(28, 120));
  return job;
}

TEST(Repeatability, AMachineThatDoesNotRepeatKeepsAllRunsAndGetsWideIntervals) {
  const InfluenceFit fit = fit_influence(hydro_generator(1)), calm = fit_influence(hydro_generator(0.02));
  for (const Contradiction& c : fit.contradictions) EXPECT_FALSE(c.left_out) << c.run;
  EXPECT_EQ(std::count(fit.used.begin(), fit.used.end(), true), 6);
  const Finding* finding = fit.summary.find(FindingCode::not_repeatable);
  ASSERT_NE(finding, nullptr);
  EXPECT_GT(finding->amount("share"), kRepeats);
  EXPECT_EQ(finding->where, "'2', '3'");
  EXPECT_EQ(calm.summary.find(FindingCode::not_repeatable), nullptr);
  const auto width = [](const InfluenceFit& f) {
    CorrectionProblem p;
    p.influence = f.influence, p.vibration = f.baseline;
    const Eigen::VectorXcd w = solve_correction(p, Criterion::least_squares).masses;
    const Estimate e = correction_uncertainty(f, p, w).magnitude(0, w);
    return e.high - e.low;
  };
  EXPECT_GT(width(fit), 10 * width(calm));
}

TEST(Repeatability, NearRepeatsAreThoseWithinThreePercentAndFiveDegrees) {
  const auto share = [](double mass, double degree) {
    BalancingJob job{{"A"}, {"X"}, {0}, {}};
    const auto run = [&](Complex w, Complex v) {
      job.runs.push_back(
          {std::to_string(job.runs.size()), 0, Eigen::VectorXcd::Constant(1, w), Eigen::VectorXcd::Constant(1, v)});
    };
    run(0, 10);
    run(10, 20);
    run(std::polar(10 * mass, degree * std::numbers::pi / 180), 22);
    return fit_influence(job, {.drift = Drift::none}).repeat_share;
  };
  EXPECT_GT(share(1, 0), 0);
  EXPECT_GT(share(1.029, 4.9), 0);
  EXPECT_TRUE(std::isnan(share(1.035, 0)));
  EXPECT_TRUE(std::isnan(share(1, 5.1)));
}

TEST(LeaveStatesOut, ForetellsEachStateByTheOthersAndSaysWhichTheyDoNotTell) {
  BalancingJob job{{"A"}, {"X"}, {0}, {}};
  const auto run = [&](Complex w, Complex v) {
    job.runs.push_back(
        {std::to_string(job.runs.size() + 1), 0, Eigen::VectorXcd::Constant(1, w), Eigen::VectorXcd::Constant(1, v)});
  };
  run(0, 10);
  run(0, 10);
  run(2, 14);
  run(4, Complex(18, 3));
  const LeaveStatesOut out = leave_states_out(job, fit_influence(job, {.drift = Drift::none}));
  ASSERT_EQ(out.states.size(), 3U);
  EXPECT_EQ(out.states[0].runs, (std::vector<int>{0, 1}));
  EXPECT_NEAR(std::abs(out.states[0].foretold[0] - Complex(10, -3)), 0, 1e-12);
  EXPECT_NEAR(std::abs(out.states[1].foretold[0] - Complex(14, 1.5)), 0, 1e-12);
  EXPECT_NEAR(std::abs(out.states[2].foretold[0] - Complex(18, 0)), 0, 1e-12);
  EXPECT_NEAR(out.states[2].error, 3, 1e-12);
  EXPECT_NEAR(out.error, std::sqrt((9 + 2.25 + 9) / 3), 1e-12);
  job.runs.pop_back();
  const LeaveStatesOut two = leave_states_out(job, fit_influence(job, {.drift = Drift::none}));
  EXPECT_FALSE(two.states[0].told);
  EXPECT_FALSE(two.states[1].told);
  EXPECT_TRUE(std::isnan(two.error));
}

}  // namespace
}  // namespace whirl::diagnosis
