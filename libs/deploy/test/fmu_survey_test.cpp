#include "whirl/deploy/fmu_survey.hpp"

#include <gtest/gtest.h>

#include <random>

#include "fmu_models.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::deploy {
namespace {

using testing::error_of;

std::filesystem::path packed_model(const testing::TemporaryFolder& folder, const RotorModel& rotor, int version) {
  IdentifiedModel m;
  m.rotor = rotor;
  FmuOptions options;
  options.version = version;
  options.code.prefix = "rotor";
  const auto path = folder.path() / "rotor.fmu";
  pack_fmu(fmu_files(m, options), options, path);
  return path;
}

// Rotors drawn at random, packed_model as FMU: what the survey finds is what was put in.
TEST(FmuSurveyExport, FindsTheRotorThatIsInTheFmu) {
  std::mt19937_64 random(11);
  const auto between = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (const int version : {2, 3}) {
    const testing::TemporaryFolder folder;
    RotorModel r;
    const double w = between(60, 110);
    r.k1 = w * w, r.c = between(0.01, 0.03) * w, r.k2 = between(0, 2e8);
    r.eps = std::polar(between(5e-5, 3e-4), between(-3, 3));
    r.gain = 1 / between(0.5, 20);
    const FmuPlantOptions options{rotor::SpeedProfile::run_down(188.5, 8), 1e-3, {}};
    const FmuSurvey survey = survey_fmu(packed_model(folder, r, version), options);
    const RotorModel& found = *survey.model.rotor;
    EXPECT_NEAR(found.k1, r.k1, 2e-3 * r.k1);
    EXPECT_NEAR(found.c, r.c, 0.02 * r.c);
    EXPECT_NEAR(found.gain, r.gain, 5e-3 * r.gain);
    EXPECT_LT(std::abs(found.eps - r.eps), 5e-3 * std::abs(r.eps));
    EXPECT_EQ(survey.blow.channels.size(), 2U);
  }
}

TEST(FmuSurveyExport, AnFmuThatNoForceMovesIsRefused) {
  const testing::TemporaryFolder folder;
  RotorModel r = *rotor_model().rotor;
  r.gain = 0;
  EXPECT_NE(error_of([&] {
              survey_fmu(packed_model(folder, r, 2), {rotor::SpeedProfile::run_down(188.5, 12), 1e-3, {}});
            }).find("must push it"),
            std::string::npos);
}

TEST(FmuSurveyExport, ADelayOfTheLoopHoldsCommandsBack) {
  const testing::TemporaryFolder folder;
  const auto path = packed_model(folder, *rotor_model().rotor, 2);
  FmuPlantOptions options{rotor::SpeedProfile::run_down(100, 1), 1e-3, {}};
  FmuPlant now(path, options);
  options.delay_samples = 3;
  FmuPlant late(path, options);
  FmuPlant later(path, options);
  for (int k = 0; k < 20; ++k) {
    const Command u{k == 5 ? 10.0 : 0.0, 0};
    later.write(u);
    late.write(k == 2 ? Command{10, 0} : Command{});
    now.write(u);
    EXPECT_EQ(late.read().x, now.read().x) << k;
    if (k == 8) {
      EXPECT_NE(later.read().x, now.read().x);
    }
    now.advance(), late.advance(), later.advance();
  }
}

}  // namespace
}  // namespace whirl::deploy
