#include "whirl/identify/validate.hpp"

#include <gtest/gtest.h>

#include "rotor_synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify_rotor.hpp"

namespace whirl::identification {
namespace {

using namespace testing;

const IdentifiedModel& identified() {
  static const IdentifiedModel model = identify_rotor(recording(with_noise(motion(rotor_a(), {}), 20, 21), {}));
  return model;
}

Validation held_out(const RotorModel& truth, const Sweep& sweep, ValidateOptions options = {}) {
  const Eigen::VectorXcd clean = motion(truth, sweep);
  options.clean = recording(clean, sweep);
  return validate(identified(), recording(with_noise(clean, 20, 5), sweep), options);
}

TEST(ValidateReference, RunsNotUsedArePredictedToTenMicrometres) {
  const RotorModel truth = rotor_a();
  for (const Sweep& sweep : {Sweep{0, 30, 12, 0.5, 1e-3}, Sweep{38, 0, 15, 0.1, 1e-3}}) {
    const Validation v = held_out(truth, sweep);
    EXPECT_EQ(v.summary.status, Status::ok);
    EXPECT_LT(v.clean_rmse_x, 8e-6);
    EXPECT_LT(v.clean_rmse_y, 8e-6);
    // Against measured the error is the noise.
    EXPECT_NEAR(v.rmse_x, v.noise_x, 0.05 * v.noise_x);
    EXPECT_NEAR(v.nrmse, 0.1, 0.01);
  }
}

TEST(ValidateReference, AddedMassIsPredictedFromItsEccentricityVector) {
  for (const double grams : {2.5, 5.0}) {
    RotorModel truth = rotor_a();
    truth.eps += added_mass(grams);
    ValidateOptions options;
    options.unbalance = UnbalanceSource::added;
    options.added = added_mass(grams);
    const Validation v = held_out(truth, {}, options);
    EXPECT_LT(v.clean_rmse_x, 10e-6) << grams;
    EXPECT_GT(v.peak_simulated, 2e-3);

    options.unbalance = UnbalanceSource::refitted;
    const Validation refitted = held_out(truth, {}, options);
    EXPECT_LT(std::abs(refitted.eps - truth.eps), 0.003 * std::abs(truth.eps));

    options.unbalance = UnbalanceSource::identified;  // wrong on purpose: the run holds another mass
    EXPECT_GT(held_out(truth, {}, options).nrmse, 0.3);
  }
}

// A run-up rides the hardening branch: near the unbalance of the model no other one follows it better.
TEST(ValidateReference, AnUnbalanceFarFromTheModelsIsFoundThroughTheFold) {
  ValidateOptions options;
  options.unbalance = UnbalanceSource::refitted;
  for (const double times : {0.7, 1.4, 3.0}) {
    for (const double turned : {1.0, 2.0, 3.0}) {
      RotorModel truth = rotor_a();
      truth.eps *= std::polar(times, turned);
      const Validation v = held_out(truth, {5, 25, 25, 0, 1e-3}, options);
      EXPECT_LT(std::abs(v.eps - truth.eps), 0.01 * std::abs(truth.eps)) << times << ' ' << turned;
    }
  }
}

TEST(ValidateReference, RunUpAtTheEdgeOfTheFoldIsFlagged) {
  RotorModel truth = rotor_a();
  truth.eps += added_mass(2.5);
  const Sweep up{0, 30, 12, 0, 1e-3};
  int flagged = 0;
  // Somewhere between little unbalance and this one the rotor begins to ride the hardening branch.
  for (int k = 0; k <= 12; ++k) {
    RotorModel m = rotor_a();
    m.eps *= 1 + 0.25 * k;
    ValidateOptions options;
    options.unbalance = UnbalanceSource::added;
    options.added = m.eps - rotor_a().eps;
    const Validation v = held_out(m, up, options);
    flagged += v.fold_sensitive;
    EXPECT_EQ(v.fold_sensitive, v.summary.status != Status::ok);
    EXPECT_TRUE(v.fold_sensitive || v.clean_rmse_x < 8e-6) << k << " " << v.clean_rmse_x;
  }
  EXPECT_GE(flagged, 1);
  EXPECT_LE(flagged, 10);
}

TEST(Validate, AnUnusableModelGivesAReason) {
  IdentifiedModel none;
  const Validation v = validate(none, recording(motion(rotor_a(), {}), {}));
  EXPECT_EQ(v.summary.status, Status::unusable);
  EXPECT_FALSE(v.summary.warnings.empty());
}

TEST(Validate, CleanRecordMustBeAsLong) {
  const Sweep sweep;
  ValidateOptions options;
  options.clean = recording(motion(rotor_a(), Sweep{30, 0, 6, 0, 1e-3}), Sweep{30, 0, 6, 0, 1e-3});
  EXPECT_THROW(validate(identified(), recording(with_noise(motion(rotor_a(), sweep), 20, 5), sweep), options), Error);
}

}  // namespace
}  // namespace whirl::identification
