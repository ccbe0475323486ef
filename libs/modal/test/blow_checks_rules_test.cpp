// Checks of measured responses and shapes against their definitions, on numbers written down here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/modal/checks.hpp"

namespace whirl::modal {
namespace {

using Complex = std::complex<double>;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// Of the covariance of real and imaginary parts: its eigenvalues give the colinearity, its first eigenvector the line.
TEST(BlowCheckRules, ComplexityIsThatOfTheLineOfBestFit) {
  std::mt19937 random(4);
  std::normal_distribution<double> normal;
  for (int trial = 0; trial < 20; ++trial) {
    Eigen::VectorXcd shape(5);
    for (Complex& v : shape) v = {normal(random), 0.6 * normal(random)};
    shape *= std::polar(1.3, normal(random));
    Eigen::MatrixX2d parts(5, 2);
    parts << shape.real(), shape.imag();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> axes(Eigen::MatrixXd(parts.transpose() * parts));
    const double low = axes.eigenvalues()[0], high = axes.eigenvalues()[1];
    const ModeComplexity c = mode_complexity(shape);
    EXPECT_NEAR(c.mpc, std::pow((high - low) / (high + low), 2), 1e-12);
    const Eigen::Vector2d line = axes.eigenvectors().col(1);
    double off = 0;
    for (Eigen::Index i = 0; i < 5; ++i)
      off += std::abs(shape[i]) * std::acos(std::min(1.0, std::abs(parts.row(i).dot(line)) / parts.row(i).norm()));
    EXPECT_NEAR(c.mpd, off / shape.cwiseAbs().sum(), 1e-9);
  }
  EXPECT_EQ(mode_complexity(Eigen::VectorXcd::Ones(1)).mpd, ModeComplexity().mpd);
  EXPECT_EQ(mode_complexity(Eigen::VectorXcd::Zero(3)).mpc, ModeComplexity().mpc);
  EXPECT_NEAR(mode_complexity(Eigen::Vector2cd(Complex(0, 1), Complex(0, -2))).mpc, 1, 1e-12);
  EXPECT_NEAR(mode_complexity(Eigen::Vector2cd(1, -2)).mpc, 1, 1e-12);
}

/// Modes at these frequencies with these residues, over pairs of a response and a reference.
ModalModel model_of(std::vector<std::pair<std::string, std::string>> channels,
                    const std::vector<std::pair<double, Eigen::VectorXcd>>& modes) {
  ModalModel m;
  for (auto& [response, reference] : channels) m.responses.push_back(response), m.references.push_back(reference);
  for (const auto& [hertz, residues] : modes) {
    Mode mode;
    mode.frequency.value = hertz;
    mode.damping.value = 0.01;
    mode.residues = residues;
    m.modes.push_back(mode);
  }
  return m;
}

TEST(BlowCheckRules, AShapeIsReadAlongTheFirstReferenceOrTheFirstResponse) {
  const Eigen::VectorXcd four = (Eigen::VectorXcd(4) << 1, 2, 3, 4).finished();
  const ModeShapes by_reference =
      mode_shapes(model_of({{"a", "r"}, {"b", "s"}, {"b", "r"}, {"a", "r"}}, {{10, four}, {20, 2 * four}}));
  EXPECT_THAT(by_reference.points, ElementsAre("a", "b"));
  EXPECT_EQ(by_reference.value, (Eigen::Matrix2cd() << 1, 2, 3, 6).finished());
  const ModeShapes by_response = mode_shapes(model_of({{"a", "r"}, {"a", "s"}, {"b", "s"}, {"a", "t"}}, {{10, four}}));
  EXPECT_THAT(by_response.points, ElementsAre("r", "s", "t"));
  EXPECT_EQ(by_response.value, (Eigen::Vector3cd(1, 2, 4)));
  EXPECT_TRUE(mode_shapes(ModalModel()).points.empty());
}

TEST(BlowCheckRules, ModesAreMatchedByShapeLessTheirChangeWithinAFifth) {
  const std::vector<std::pair<std::string, std::string>> points = {{"a", "r"}, {"b", "r"}};
  const Eigen::VectorXcd one = Eigen::Vector2cd(1, 0.5), other = Eigen::Vector2cd(1, -0.8);
  const ModalModel first = model_of(points, {{10, one}, {11, other}, {50, one}});
  const auto matches = match_modes(first, model_of(points, {{11.9, one}, {9.5, other}, {61, one}}));
  ASSERT_EQ(matches.size(), 2u) << "61 Hz is more than a fifth from 50 Hz";
  EXPECT_EQ(matches[0].first, 0u);
  EXPECT_EQ(matches[0].second, 0u);
  EXPECT_NEAR(matches[0].frequency_change, 0.19, 1e-12);
  EXPECT_NEAR(matches[0].mac, 1, 1e-12);
  EXPECT_EQ(matches[1].second, 1u);
  EXPECT_EQ(match_modes(first, model_of(points, {{59.9, one}})).size(), 1u);
  EXPECT_EQ(match_modes(first, model_of(points, {{40.1, one}})).size(), 1u);
  EXPECT_EQ(match_modes(first, model_of(points, {{39.9, one}})).size(), 0u);
  // Of two alike the nearer one.
  EXPECT_EQ(match_modes(model_of(points, {{10, one}}), model_of(points, {{11, one}, {9.3, one}}))[0].second, 1u);
  const auto refused = [&](const ModalModel& a, const ModalModel& b) {
    try {
      match_modes(a, b);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const ModalModel renamed = model_of({{"a", "r"}, {"c", "r"}}, {{10, one}});
  EXPECT_THAT(refused(first, renamed), HasSubstr("modes over a, b cannot be compared with modes over a, c"));
  EXPECT_THAT(refused(first, ModalModel()), HasSubstr("with modes over unnamed points"));
  EXPECT_THAT(refused(ModalModel(), ModalModel()), HasSubstr("modes over unnamed points cannot"));
}

FrequencyResponse response_of(const std::vector<std::tuple<std::string, std::string, Complex>>& channels) {
  FrequencyResponse frf;
  frf.frequency = Eigen::Vector3d(1, 2, 3);
  for (const auto& [response, reference, value] : channels)
    frf.channels.push_back({response, reference, Eigen::VectorXcd::Constant(3, value), {}, {}});
  return frf;
}

TEST(BlowCheckRules, ReciprocityComparesTheTwoDirectionsOfAPair) {
  FrequencyResponse frf = response_of(
      {{"a", "a", 1}, {"a", "b", 2}, {"b", "a", 3}, {"b", "b", 5}, {"a", "c", 7}, {"c", "b", 8}, {"a", "a", 9}});
  auto found = check_reciprocity(frf);
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].first, "a");
  EXPECT_EQ(found[0].second, "b");
  EXPECT_NEAR(found[0].difference, 1 / 2.5, 1e-12);
  EXPECT_EQ(found[0].noise, 0);
  frf.channels[1].variance = Eigen::Vector3d(0.01, 0.02, 0.03);
  EXPECT_EQ(check_reciprocity(frf)[0].noise, 0) << "of one direction only";
  std::swap(frf.channels[1].variance, frf.channels[2].variance);
  EXPECT_EQ(check_reciprocity(frf)[0].noise, 0) << "of the other only";
  frf.channels[1].variance = Eigen::Vector3d(0.04, 0.05, 0.06);
  EXPECT_NEAR(check_reciprocity(frf)[0].noise, std::sqrt(2 * 0.21) / (2.5 * std::sqrt(3.0)), 1e-12);
  frf.channels[1].value.setZero(), frf.channels[2].value.setZero();
  EXPECT_TRUE(check_reciprocity(frf).empty()) << "nothing was measured";
}

TEST(BlowCheckRules, ADrivePointHasResiduesOfOneSign) {
  const auto residues = [](double a, double b, double c) {
    return Eigen::VectorXcd(Eigen::Vector3cd(Complex(0, a), Complex(0, b), Complex(0, c)));
  };
  const ModalModel m = model_of({{"a", "a"}, {"b", "a"}, {"b", "b"}},
                                {{10, residues(-1, 1, 2)}, {20, residues(-2, -1, -3)}, {30, residues(1, 0, 0)}});
  const auto found = check_drive_points(m);
  ASSERT_EQ(found.size(), 2u);
  EXPECT_EQ(found[0].point, "a");
  EXPECT_THAT(found[0].wrong_modes, ElementsAre(2u));
  EXPECT_EQ(found[1].point, "b");
  EXPECT_THAT(found[1].wrong_modes, ElementsAre(0u)) << "zero is no wrong sign";
}

TEST(BlowCheckRules, ContradictionsBeyondATenthAndThreeTimesTheNoiseAreSaid) {
  const auto said = [](double difference, double noise, const ModalModel& model = {}) {
    FrequencyResponse frf = response_of({{"a", "b", 1 - difference / 2}, {"b", "a", 1 + difference / 2}});
    for (FrfChannel& c : frf.channels) c.variance = Eigen::VectorXd::Constant(3, noise * noise / 4);
    ModalModel m = model;
    warn_of_contradictions(frf, m);
    std::string text;
    for (const std::string& warning : m.summary.warnings) text += warning + "\n";
    return text;
  };
  EXPECT_EQ(said(0.099, 0), "");
  EXPECT_THAT(said(0.101, 0), HasSubstr("a to b differs from b to a by 10 %: reciprocity does not hold"));
  EXPECT_EQ(said(0.29, 0.1), "");
  EXPECT_THAT(said(0.31, 0.1), HasSubstr("by 31 %"));
  const ModalModel turned = model_of({{"p", "p"}, {"q", "q"}}, {{10, Eigen::Vector2cd(Complex(0, 1), Complex(0, -1))},
                                                                {20, Eigen::Vector2cd(Complex(0, 2), Complex(0, -1))}});
  const std::string text = said(0, 0, turned);
  EXPECT_THAT(text, HasSubstr("p is hit and measured, but 2 of its residues have the wrong sign"));
  EXPECT_THAT(text, Not(HasSubstr("q is hit")));
}

}  // namespace
}  // namespace whirl::modal
