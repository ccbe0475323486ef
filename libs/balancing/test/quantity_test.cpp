// The quantity of the readings travels: no velocity is shown as a displacement, or judged by limits of one.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <string>

#include "whirl/balancing/solve.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"

namespace whirl::balancing {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

/// 3.3 mm/s as found, the trial of 10 g adds 2 mm/s at a right angle; a third run repeats the first.
std::string table_of(const std::string& unit, double size) {
  return "run_1,speed_rpm,A_amp_" + unit + ",A_phase_deg,P_mass_gram,P_angle_deg\n" +
         fmt::format("1,1500,{:.6g},0,0,0\n2,1500,{:.6g},31.218,10,0\n3,1500,{:.6g},0,0,0\n", 3.3 * size, 3.8588 * size,
                     3.3 * size);
}

JobFile job_of(const std::string& text) {
  const auto path = std::filesystem::temp_directory_path() / fmt::format("whirl_quantity_{}.csv", ::getpid());
  io::write_text(path, text);
  VectorConvention convention;
  convention.amplitude = "rms";
  const JobFile file = read_job(path, convention, 0);
  std::filesystem::remove(path);
  return file;
}

TEST(BalancingQuantityUnit, VelocityStaysVelocityOnTheSheetAndInTheFile) {
  const SolvedJob solved = solve_job("fan", job_of(table_of("mm_s", 1)), {});
  const std::string html = report::to_html(balancing_sheet(solved.sheet)), json = solved.json.dump();
  EXPECT_THAT(html, HasSubstr("mm/s rms"));
  EXPECT_THAT(html, Not(HasSubstr("µm")));
  EXPECT_THAT(html, Not(HasSubstr("D → ")));
  EXPECT_THAT(html, HasSubstr("no zones"));
  EXPECT_THAT(json, HasSubstr("\"quantity\": \"velocity\""));
  EXPECT_THAT(json, HasSubstr("m_s_per_kg"));
  EXPECT_THAT(json, Not(HasSubstr("\"m_per_kg\"")));
  EXPECT_NEAR(solved.sheet.rows[0].before.value, 3.3e-3, 1e-6);
}

TEST(BalancingQuantityUnit, TheMassesAreThoseOfTheSameReadingsInMicrometres) {
  const SolvedJob velocity = solve_job("fan", job_of(table_of("mm_s", 1)), {}),
                  displacement = solve_job("fan", job_of(table_of("um", 10)), {});
  EXPECT_NEAR(velocity.sheet.planes[0].mass.value, displacement.sheet.planes[0].mass.value, 1e-6);
  EXPECT_THAT(report::to_html(balancing_sheet(displacement.sheet)), HasSubstr("µm rms"));
}

TEST(BalancingQuantityUnit, MixedQuantitiesAndLimitsOfAnotherAreRefusedByName) {
  EXPECT_THROW(job_of("run_1,speed_rpm,A_amp_mm_s,A_phase_deg,B_amp_um,B_phase_deg,P_mass_gram,P_angle_deg\n"
                      "1,1500,3,0,20,0,0,0\n2,1500,4,30,25,20,10,0\n"),
               Error);
  EXPECT_THROW(job_of(table_of("N", 1)), Error);
  JobOptions zones;
  zones.zones = {1e-6, 2e-6, 3e-6};
  EXPECT_THROW(solve_job("fan", job_of(table_of("mm_s", 1)), zones), Error);
}

// What was written in g or mil stands on the sheet in g or mil.
TEST(BalancingQuantityUnit, AColumnWithoutUnitAndANegativeSpeedAreNamed) {
  const auto error = [](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    try {
      (void)job_of(text);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("no error");
  };
  const std::string table = table_of("um", 1);
  EXPECT_THAT(error(table, "A_amp_um", "A_amp"), HasSubstr(":1: column 'A_amp' needs a unit: A_amp_um"));
  EXPECT_THAT(error(table, "P_mass_gram", "P_mass"), HasSubstr("column 'P_mass' needs a unit: P_mass_gram"));
  EXPECT_THAT(error(table, "A_phase_deg", "A_phase"), HasSubstr("column 'A_phase' needs a unit: A_phase_deg"));
  EXPECT_THAT(error(table, "2,1500", "2,-1500"), HasSubstr(":3: the speed is negative"));
}

TEST(BalancingQuantityUnit, ANegativeSpeedOfAJobIsNamed) {
  const auto path = std::filesystem::temp_directory_path() / fmt::format("whirl_speed_{}.toml", ::getpid());
  io::write_text(path,
                 "[job]\nplanes = [\"P\"]\nprobes = [\"A\"]\nspeeds_rpm = [-1490]\n"
                 "[[run]]\nmasses_gram = [0]\nangles_deg = [0]\namplitudes_um = [80]\nphases_deg = [40]\n");
  VectorConvention convention;
  std::string error = "no error";
  try {
    (void)read_job(path, convention, 0);
  } catch (const Error& e) {
    error = e.what();
  }
  std::filesystem::remove(path);
  EXPECT_THAT(error, HasSubstr("a speed is negative"));
  EXPECT_THAT(error, HasSubstr(":4"));
}

TEST(BalancingQuantityUnit, TheSheetKeepsTheUnitOfTheReadings) {
  const SolvedJob g = solve_job("fan", job_of(table_of("g", 0.1)), {}),
                  mil = solve_job("fan", job_of(table_of("mil", 1)), {});
  EXPECT_THAT(report::to_text(balancing_sheet(g.sheet)), HasSubstr("g rms"));
  EXPECT_NEAR(g.sheet.rows[0].before.value, 0.33 * 9.80665, 1e-6);
  EXPECT_THAT(report::to_text(balancing_sheet(mil.sheet)), HasSubstr("mil rms"));
  EXPECT_THAT(report::to_text(balancing_sheet(mil.sheet)), Not(HasSubstr("µm")));
  EXPECT_NEAR(mil.sheet.rows[0].before.value, 3.3 * 25.4e-6, 1e-9);
}

// Four runs without phase: as found 4.2 mm/s, 10 g at 0, 120, 240 deg. The construction with circles: 14 g at 20 deg.
TEST(BalancingAmplitudesUnit, FourRunsWithoutPhaseGiveTheMassAndLeavePhasesOpen) {
  JobOptions options;
  options.noise_written = 0.02;
  const JobFile file = job_of(
      "run_1,speed_rpm,DE_amp_mm_s,P_mass_gram,P_angle_deg\n1,1480,4.200,0,0\n2,1480,1.720,10,0\n"
      "3,1480,5.569,10,120\n4,1480,6.778,10,240\n");
  EXPECT_FALSE(file.job.phases);
  const SolvedJob solved = solve_job("fan", file, options);
  EXPECT_EQ(solved.sheet.summary.status, Status::ok);
  const Estimate& mass = solved.sheet.planes[0].mass;
  EXPECT_NEAR(mass.value, 14e-3, 0.05e-3);
  EXPECT_LT(mass.low, 14e-3);
  EXPECT_GT(mass.high, 14e-3);
  EXPECT_LT(mass.high - mass.low, 2e-3);
  EXPECT_NEAR(solved.sheet.planes[0].angle.value * 180 / 3.14159265358979, 20, 0.3);
  EXPECT_TRUE(std::isnan(solved.sheet.rows[0].before_phase));
  EXPECT_TRUE(solved.sheet.other_answers.empty());
  const SolvedJob unstated = solve_job("fan", file, {});
  EXPECT_GT(unstated.sheet.planes[0].mass.high - unstated.sheet.planes[0].mass.low, 0);
}

TEST(BalancingAmplitudesUnit, ThreeRunsWithoutPhaseGiveBothMassesAndAreNotToBeUsed) {
  const SolvedJob solved =
      solve_job("fan",
                job_of("run_1,speed_rpm,DE_amp_mm_s,P_mass_gram,P_angle_deg\n1,1480,4.200,0,0\n2,1480,1.720,10,0\n"
                       "3,1480,5.569,10,120\n"),
                {});
  EXPECT_EQ(solved.sheet.summary.status, Status::unusable);
  ASSERT_NE(solved.sheet.summary.find(FindingCode::answer_ambiguous), nullptr);
  EXPECT_EQ(solved.sheet.summary.find(FindingCode::answer_ambiguous)->amount("answers"), 2);
  ASSERT_EQ(solved.sheet.other_answers.size(), 1U);
  EXPECT_THAT(solved.json.dump(), HasSubstr("other_answers"));
}

TEST(BalancingLeftOutUnit, TheSheetForetellsEachStateByTheOthers) {
  const SolvedJob solved = solve_job("fan", job_of(table_of("um", 10) + "4,1500,55,50,15,10\n"), {});
  ASSERT_EQ(solved.sheet.left_out.size(), 3U);
  EXPECT_EQ(solved.sheet.left_out[0].runs, "1, 3");
  EXPECT_TRUE(solved.sheet.left_out[0].told);
  EXPECT_GT(solved.sheet.left_out_error, 0);
  EXPECT_THAT(report::to_text(balancing_sheet(solved.sheet)), HasSubstr("Leave-one-state-out"));
  EXPECT_THAT(solved.json.dump(), HasSubstr("leave_one_state_out"));
}

}  // namespace
}  // namespace whirl::balancing
