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

const IdentifiedModel& well_identified() {
  static const IdentifiedModel model = identify_rotor(recording(with_noise(motion(rotor_a(), {}), 40, 31), {}));
  return model;
}

ValidationReport at_gap(const RotorModel& truth, Complex gap, bool x_alone = false) {
  const Sweep sweep{38, 0, 15, 0.1, 1e-3};
  Recording record = recording(with_noise(motion(truth, sweep).array() + gap, 40, 32), sweep);
  if (x_alone) std::erase_if(record.channels, [](const Channel& c) { return c.name == "y"; });
  record.source = "down.csv";
  return validate(well_identified(), std::vector{record});
}

// The gap between probe and shaft belongs to a run, not to the rotor: every plant sets it anew.
TEST(ValidateProperty, AnotherGapOfTheProbesIsToldAndRefusesNoModel) {
  for (const Complex gap : {Complex(3e-6, 3e-6), Complex(-2e-4, 0), Complex(0, 5e-3)}) {
    const ValidationReport report = at_gap(rotor_a(), gap);
    EXPECT_EQ(report.summary.status, Status::ok) << gap;
    const Validation& v = *report.runs[0].rotor;
    EXPECT_NEAR(v.rmse_x, v.noise_x, 0.05 * v.noise_x) << gap;
    EXPECT_NEAR(v.rmse_y, v.noise_y, 0.05 * v.noise_y) << gap;
    for (const auto& [name, size] : {std::pair{"offset_x", gap.real()}, std::pair{"offset_y", gap.imag()}}) {
      const Finding* told = nullptr;
      for (const Finding& f : report.runs[0].summary.findings)
        if (f.code == FindingCode::parameter_differs && f.where == name) told = &f;
      ASSERT_EQ(told != nullptr, size != 0) << name << ' ' << gap;
      if (told == nullptr) continue;
      EXPECT_EQ(told->consequence, Consequence::note);
      EXPECT_NEAR(told->amount("record") - told->amount("model"), size, 1e-6 + 1e-3 * std::abs(size));
    }
    EXPECT_FALSE(report.summary.notes.empty());
  }
  EXPECT_EQ(at_gap(rotor_a(), 0).runs[0].summary.find(FindingCode::parameter_differs), nullptr);
  EXPECT_NE(at_gap(rotor_a(), 3e-5, true).summary.status, Status::unusable);
}

// A gap explains no other stiffness and no other unbalance.
TEST(ValidateProperty, AnotherGapHidesNoWrongModel) {
  RotorModel stiffer = rotor_a(), heavier = rotor_a();
  stiffer.k1 *= 1.01;
  heavier.eps *= 1.1;
  for (const RotorModel& other : {stiffer, heavier}) {
    EXPECT_EQ(at_gap(other, 0).summary.status, Status::unusable);
    EXPECT_EQ(at_gap(other, {2e-4, -1e-4}).summary.status, Status::unusable);
  }
}

TEST(Validate, ARunThatWasNotEvaluatedHasNoError) {
  const Validation v = validate(IdentifiedModel{}, recording(motion(rotor_a(), {}), {}));
  EXPECT_TRUE(std::isnan(v.rmse_x) && std::isnan(v.rmse_y) && std::isnan(v.nrmse));
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
