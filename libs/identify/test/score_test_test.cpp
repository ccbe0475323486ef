#include "whirl/identify/score_test.hpp"

#include <gtest/gtest.h>

#include "rotor_synthetic.hpp"
#include "whirl/identify/weak_rotor.hpp"

namespace whirl::identification {
namespace {

using namespace testing;

ScoreTest run(const RotorModel& truth, double snr, unsigned seed, OutputErrorOptions active = {},
              ScoreTestOptions options = {}) {
  const std::vector<RotorRecord> records = {record(with_noise(motion(truth, {}), snr, seed), {})};
  WeakRotorOptions weak;
  weak.conj_stiffness = active.conj_stiffness;
  const OutputErrorFit fit = fit_output_error_rotor(records, fit_weak_rotor(records, weak).model, active);
  EXPECT_NE(fit.summary.status, Status::unusable);
  return score_rotor_terms(records, fit, active, options);
}

TEST(ScoreTestReference, NothingIsAddedToAnIsotropicRotor) {
  for (const double snr : {10.0, 20.0, 40.0}) {
    for (unsigned seed = 1; seed <= 3; ++seed) {
      const ScoreTest test = run(rotor_a(), snr, seed);
      EXPECT_LT(test.candidates.front().score, 16) << test.candidates.front().term->label << " at " << snr << " dB";
      EXPECT_GT(test.chi_square, 0.8);
      EXPECT_LT(test.chi_square, 1.3);
    }
  }
}

TEST(ScoreTestReference, StiffnessDifferenceIsFoundAndRepairedByOneTerm) {
  RotorModel truth = rotor_a();
  truth.k1_conj = 0.01 * truth.k1;  // Kx and Ky differ by 2 %
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const ScoreTest before = run(truth, 20, seed);
    EXPECT_EQ(before.candidates.front().term->label, "anisotropic stiffness");
    EXPECT_GT(before.candidates.front().score, 100);
    EXPECT_GT(before.chi_square, 1.3);
    OutputErrorOptions active;
    active.conj_stiffness = true;
    const ScoreTest after = run(truth, 20, seed, active);
    EXPECT_LT(after.candidates.front().score, 16) << after.candidates.front().term->label;
    EXPECT_LT(after.chi_square, 1.3);
  }
}

TEST(ScoreTestReference, ForcedModesAreToldFromDecoys) {
  RotorModel truth = rotor_a();
  truth.modes = {{kTurn * 21, 0.02, 0.05 * truth.eps}};
  ScoreTestOptions options;
  options.modes = {{kTurn * 12.4, 0.02, 0}, {kTurn * 21, 0.02, 0}, {kTurn * 44, 0.01, 0}};
  const ScoreTest test = run(truth, 20, 4, {}, options);
  EXPECT_EQ(test.candidates.front().term->label, "mode");
  EXPECT_EQ(test.candidates.front().place, 2);
}

}  // namespace
}  // namespace whirl::identification
