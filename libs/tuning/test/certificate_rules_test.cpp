// Which of its plants a certificate is refused for, by a peak that is stated too small or large enough.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "certificate/certificate_runs.hpp"
#include "certificate/design_peak.hpp"
#include "rig_design.hpp"

namespace whirl::tuning {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

int count(const std::string& text, const std::string& word) {
  int found = 0;
  for (std::size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) ++found;
  return found;
}

// Of the tolerances of the actuators alone, twice the nominal peak and 30 um: what stands on exact forces.
TEST(CertificateRules, OnlyTheActuatorsMakeALoopFragile) {
  const rig::RigParameters rig;
  IdentifiedModel model = true_model(rig);
  model.rotor->eps *= 10;  // beyond the 30 um, with forces for it
  DesignOptions o = options_of(data_sheet(rig));
  o.hardware.modes.clear();
  o.hardware.actuator.voltage_limit = 200;
  const ControllerDesign d = untuned_design(model, o);
  const auto runs = [&](double nominal) { return certificate_runs(d, {}, nominal, *model.rotor, o.hardware, 1, 1); };
  const CertificateRuns large = runs(1);
  EXPECT_EQ(large.refused, "");
  ASSERT_GT(large.peak, 30e-6);
  const CertificateRuns none = runs(0);
  EXPECT_EQ(none.peak, large.peak);
  EXPECT_EQ(count(none.refused, "the peak rises from 0.000 to"), 4) << none.refused;
  EXPECT_EQ(count(none.refused, "with forces 5 % "), 4) << none.refused;
  EXPECT_THAT(none.refused, Not(HasSubstr("the profile reversed")));
}

// A table said "met: no" of the vibration beside exit code 0.
TEST(CertificateRules, MachinesThatVibrateAsMuchAsWithoutControlRefuse) {
  const rig::RigParameters rig;
  const IdentifiedModel model = true_model(rig);
  DesignOptions o = options_of(data_sheet(rig));
  o.hardware.modes.clear();
  ControllerDesign d = untuned_design(model, o);
  const auto certified = [&](double open) {
    d.summary = {};
    d.margins = {{"certified", 1}, {"peak_m", 0}, {"open_peak_m", open}};
    bound_peak(d, model, o);
    return d.margins.at("certified") == 1;
  };
  EXPECT_TRUE(certified(1));
  const double peak = d.margins.at("peak_m");
  EXPECT_TRUE(certified(1.001 * peak));
  EXPECT_EQ(d.summary.distrust(), nullptr);
  EXPECT_FALSE(certified(peak));
  const Finding* refused = d.summary.find(FindingCode::requirement_missed);
  ASSERT_NE(refused, nullptr);
  EXPECT_EQ(refused->consequence, Consequence::unusable);
  EXPECT_THAT(refused->where, HasSubstr("against the run without control"));
}

}  // namespace
}  // namespace whirl::tuning
