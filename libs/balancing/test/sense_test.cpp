// Vectors and masses counted in opposite senses mirror the answer: where nobody stated the sense, both answers are
// said.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <complex>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

#include "whirl/balancing/solve.hpp"
#include "whirl/io/file.hpp"

namespace whirl::balancing {
namespace {

using Complex = std::complex<double>;
constexpr double kDegree = std::numbers::pi / 180;

struct Mass {
  double gram, degrees;
};

/// Runs of a machine with 20 um at 40 deg as found and 2 um/g at -70 deg, phases as lag, mass angles with the rotation.
/// `sense`: -1 writes the mass angles against it.
SolvedJob solved(const std::vector<Mass>& masses, bool stated, int sense = 1) {
  const Complex found = std::polar(20.0, -40 * kDegree), influence = std::polar(2.0, 70 * kDegree);
  std::string text = "run_1,speed_rpm,A_amp_um,A_phase_deg,P_mass_gram,P_angle_deg\n";
  int run = 0;
  for (const Mass& m : masses) {
    const Complex v = found + influence * std::polar(m.gram, m.degrees * kDegree);
    text += fmt::format("{},1500,{:.12g},{:.12g},{},{}\n", ++run, std::abs(v), -std::arg(v) / kDegree, m.gram,
                        sense * m.degrees);
  }
  const auto path = std::filesystem::temp_directory_path() / fmt::format("whirl_sense_{}.csv", ::getpid());
  io::write_text(path, text);
  VectorConvention convention;
  convention.sense_stated = stated;
  const JobFile file = read_job(path, convention, 0);
  std::filesystem::remove(path);
  return solve_job("fan", file, {});
}

double angle_of(const SolvedJob& job) { return job.sheet.planes[0].angle.value / kDegree; }

TEST(BalancingSense, UnstatedIsSaidWithTheOtherAnswer) {
  // -20 e^{-40 i} / (2 e^{70 i}) is 10 g at 70 deg. The trial at 30 deg moved the vector by 10 e^{100 i}: read as -30
  // deg the influence is 2 e^{130 i}, and the mass is at 10 deg with the rotation, written against it 350.
  const SolvedJob job = solved({{0, 0}, {5, 30}}, false), stated = solved({{0, 0}, {5, 30}}, true);
  EXPECT_NEAR(std::remainder(angle_of(job) - 70, 360), 0, 1e-6);
  EXPECT_NEAR(std::remainder(angle_of(stated) - 70, 360), 0, 1e-6);
  const Finding* said = job.sheet.summary.find(FindingCode::sense_not_stated);
  ASSERT_NE(said, nullptr);
  EXPECT_EQ(said->where, "10 g at 350 deg on P");
  EXPECT_EQ(job.sheet.summary.status, Status::unusable);
  EXPECT_EQ(stated.sheet.summary.find(FindingCode::sense_not_stated), nullptr);
}

TEST(BalancingSense, RunsThatTellNeedNoStatement) {
  const SolvedJob job = solved({{0, 0}, {5, 30}, {5, 150}, {4, 250}, {6, 90}, {0, 0}}, false);
  EXPECT_EQ(job.sheet.summary.find(FindingCode::sense_not_stated), nullptr);
}

// The runs agree only with mass angles counted the other way: masses by the statement would be wrong.
TEST(BalancingSense, AStatementThatAllRunsContradictGivesNoMasses) {
  std::vector<Mass> mirrored{{0, 0}, {5, 30}, {5, 150}, {4, 250}, {6, 90}, {0, 0}};
  const SolvedJob job = solved(mirrored, true, -1);
  EXPECT_NE(job.sheet.summary.find(FindingCode::angles_reversed), nullptr);
  EXPECT_EQ(job.sheet.summary.status, Status::unusable);
  EXPECT_EQ(solved(mirrored, true).sheet.summary.find(FindingCode::angles_reversed), nullptr);
}

TEST(BalancingSense, ASolvedEquationLeavesNothing) {
  EXPECT_EQ(solved({{0, 0}, {5, 30}}, true).sheet.rows[0].after.value, 0);
}

}  // namespace
}  // namespace whirl::balancing
