// Problems of the literature with their printed answers (Goodman 1964, Darlow 1982, Foiles 1998, Pavelek, "Balance
// this!"), read from the measured data set; the numbers are not part of the tree.
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <complex>
#include <limits>
#include <numbers>

#include "whirl/diagnosis/influence.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;
constexpr double kDegree = std::numbers::pi / 180;

std::complex<double> vector_of(const YAML::Node& node) {
  const auto text = node.as<std::string>();
  const std::size_t at = text.find('@');
  if (at == std::string::npos) throw std::runtime_error("no vector: " + text);
  return std::polar(std::stod(text.substr(0, at)), std::stod(text.substr(at + 1)) * kDegree);
}

/// A matrix written as rows; a plain entry is a row of one.
Eigen::MatrixXcd matrix_of(const YAML::Node& node) {
  const auto rows = static_cast<Index>(node.size());
  const auto columns = static_cast<Index>(node[0].IsSequence() ? node[0].size() : 1);
  Eigen::MatrixXcd m(rows, columns);
  for (Index i = 0; i < rows; ++i)
    for (Index j = 0; j < columns; ++j) {
      const YAML::Node row = node[static_cast<std::size_t>(i)];
      m(i, j) = vector_of(row.IsSequence() ? row[static_cast<std::size_t>(j)] : row);
    }
  return m;
}

struct Case {
  std::string name;
  CorrectionProblem problem;
  Eigen::VectorXcd expected;
  InfluenceFit fit;
};

/// Runs of a case with B, U: as found, then one trial a plane, left on or removed.
BalancingJob job_of(const YAML::Node& in, bool keep = false) {
  const Eigen::MatrixXcd b = matrix_of(in["B"]), a = matrix_of(in["A"]), u = matrix_of(in["U"]);
  if (in["keep_trial"]) keep = in["keep_trial"].as<std::string>() == "True";
  BalancingJob job;
  for (Index p = 0; p < u.rows(); ++p) job.planes.push_back(std::to_string(p + 1));
  for (Index m = 0; m < a.rows(); ++m) job.rows.push_back(std::to_string(m + 1));
  job.runs.push_back({"as found", 0, Eigen::VectorXcd::Zero(u.rows()), a.col(0)});
  Eigen::VectorXcd on = Eigen::VectorXcd::Zero(u.rows());
  for (Index p = 0; p < u.rows(); ++p) {
    if (!keep) on.setZero();
    on[p] = u(p, 0);
    job.runs.push_back({"trial " + std::to_string(p + 1), static_cast<double>(p) + 1, on, b.col(p)});
  }
  if (in["A0"] && in["A0"].size() > 0) {
    // Slow roll: what the probes read of the surface alone, in every run.
    for (BalancingRun& run : job.runs) run.vibration -= matrix_of(in["A0"]).col(0);
  }
  return job;
}

std::vector<Case> cases_of(const std::string& section) {
  const YAML::Node root = YAML::LoadFile(testing::data_file("balancing/cases.yaml").string());
  std::vector<Case> cases;
  for (const auto& entry : root[section]["test_cases"]) {
    Case c;
    c.name = entry.first.as<std::string>();
    const YAML::Node in = entry.second[0][0];
    if (in["ALPHA"]) {
      c.problem.influence = matrix_of(in["ALPHA"]);
      c.problem.vibration = matrix_of(in["A"]).col(0);
    } else {
      c.fit = fit_influence(job_of(in));
      c.problem.influence = c.fit.influence;
      c.problem.vibration = c.fit.baseline;
    }
    c.expected = matrix_of(entry.second[1]).col(0);
    // The file quotes the author's own answer and takes it for a misprint; it is what his runs give.
    if (c.name == "Balanceit_Example_Two_Plane") c.expected[0] = std::polar(15.3, 3 * kDegree);
    if (in["weight_const"]) {
      c.problem.limit = Eigen::VectorXd::Constant(c.problem.planes(), std::numeric_limits<double>::infinity());
      for (const auto& limit : in["weight_const"]) c.problem.limit[limit.first.as<int>()] = limit.second.as<double>();
    }
    cases.push_back(std::move(c));
  }
  return cases;
}

std::string show(const Eigen::VectorXcd& w) {
  std::string text;
  for (const std::complex<double>& x : w)
    text += std::to_string(std::abs(x)) + "@" + std::to_string(std::arg(x) / kDegree) + " ";
  return text;
}

class PublishedBalancingReference : public ::testing::Test {
 protected:
  void SetUp() override { WHIRL_REQUIRE_DATA(testing::data_file("balancing/cases.yaml")); }
};

TEST_F(PublishedBalancingReference, LeastSquaresGivesThePrintedMasses) {
  const std::vector<Case> cases = cases_of("least_squares");
  ASSERT_EQ(cases.size(), 9U);
  for (const Case& c : cases) {
    const Correction w = solve_correction(c.problem, Criterion::least_squares);
    // Never worse than the printed masses, and the same within the rounding of the data.
    EXPECT_LE(w.objective, objective(c.problem, Criterion::least_squares, c.expected) * (1 + 1e-12)) << c.name;
    EXPECT_LE((w.masses - c.expected).norm(), 0.05 * c.expected.norm())
        << c.name << ": " << show(w.masses) << "printed " << show(c.expected);
  }
}

TEST_F(PublishedBalancingReference, MinMaxIsCertifiedAndNotAboveThePrintedOptimum) {
  for (const char* section : {"Min_max", "LMI"}) {
    for (const Case& c : cases_of(section)) {
      const Correction w = solve_correction(c.problem, Criterion::min_max);
      const double printed = objective(c.problem, Criterion::min_max, c.expected);
      EXPECT_LE(w.objective, printed * (1 + 1e-3)) << c.name;
      EXPECT_LE(w.objective - w.bound, 1e-6 * w.objective) << c.name;
      for (Index p = 0; p < c.problem.planes(); ++p)
        EXPECT_LE(std::abs(w.masses[p]), c.problem.limit[p] * (1 + 1e-9)) << c.name;
      std::cout << c.name << ": largest " << w.objective << " (bound " << w.bound << "), printed masses give "
                << printed << "; " << show(w.masses) << "printed " << show(c.expected) << "\n";
    }
  }
}

TEST_F(PublishedBalancingReference, DarlowsPlanesThatAreNotIndependentAreNamedAndLeftOut) {
  for (const Case& c : cases_of("ill_condition_test")) {
    const PlaneIndependence planes = plane_independence(c.problem.influence);
    const std::vector<int> kept = planes.independent(0.2);
    ASSERT_EQ(kept, (std::vector<int>{0, 2}));
    EXPECT_EQ(planes.twin[1], 2);
    CorrectionProblem reduced;
    reduced.influence.resize(c.problem.rows(), 2);
    reduced.influence << c.problem.influence.col(0), c.problem.influence.col(2);
    reduced.vibration = c.problem.vibration;
    const Correction w = solve_correction(reduced, Criterion::least_squares);
    EXPECT_LE((w.masses - c.expected).norm(), 0.05 * c.expected.norm()) << show(w.masses);
  }
  for (const Case& c : cases_of("least_squares")) {
    if (c.name != "Darlow_1") continue;
    EXPECT_EQ(plane_independence(c.problem.influence).independent(0.2).size(), 3U) << "independent planes stay";
  }
}

TEST_F(PublishedBalancingReference, TrialRunsGiveThePrintedInfluenceCoefficients) {
  const YAML::Node root = YAML::LoadFile(testing::data_file("balancing/cases.yaml").string());
  int seen = 0;
  // In this section a trial mass stays on unless the case says otherwise.
  for (const auto& entry : root["ALPHA_from_matrices"]["test_cases"]) {
    const InfluenceFit fit = fit_influence(job_of(entry.second[0][0], true));
    const Eigen::MatrixXcd expected = matrix_of(entry.second[1]);
    EXPECT_LE((fit.influence - expected).norm(), 0.02 * expected.norm()) << entry.first << "\n" << fit.influence;
    ++seen;
  }
  EXPECT_EQ(seen, 4);
}

}  // namespace
}  // namespace whirl::diagnosis
