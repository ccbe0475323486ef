#include "whirl/identify/second_order.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::identification {
namespace {

/// Rows first .. last of the Silverbox record (0-based, end excluded): u = V1, y = V2, V.
class Silverbox {
 public:
  explicit Silverbox(const std::filesystem::path& path) {
    std::ifstream file(path);
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
      if (line.find_first_of("0123456789") == std::string::npos) continue;
      char* end = nullptr;
      u_.push_back(std::strtod(line.c_str(), &end));
      y_.push_back(std::strtod(end + 1, nullptr));
    }
  }
  Recording rows(std::size_t first, std::size_t last) const {
    Recording r;
    r.dt = 16384e-7;
    r.source = "SNLS80mV.csv";
    const auto cut = [&](const std::vector<double>& v) {
      return Eigen::VectorXd(
          Eigen::Map<const Eigen::VectorXd>(v.data() + first, static_cast<Eigen::Index>(last - first)));
    };
    r.add("u", Quantity::voltage, cut(u_));
    r.add("y", Quantity::voltage, cut(y_));
    return r;
  }
  std::size_t size() const { return y_.size(); }

 private:
  std::vector<double> u_, y_;
};

double coefficient_of(const IdentifiedModel& m, const std::string& function) {
  for (const EquationTerm& t : m.equations[1].terms) {
    if (t.function == function) return t.coefficient.value;
  }
  return std::nan("");
}
void print(const char* name, const IdentifiedModel& m, double test, double arrow) {
  std::cout << name << ": free run multisine " << 1e3 * test << " mV, arrow " << 1e3 * arrow << " mV; y'' =";
  for (const EquationTerm& t : m.equations[1].terms) std::cout << " + " << t.coefficient.value << " " << t.function;
  std::cout << "; f0 " << m.parameter("f0")->value << " Hz, zeta " << m.parameter("zeta")->value << "\n";
}

TEST(SilverboxReference, CubicWithOffsetThenStructureFoundByTheTool) {
  const auto path = testing::data_file("silverbox/SNLS80mV.csv");
  WHIRL_REQUIRE_DATA(path);
  const Silverbox data(path);
  ASSERT_EQ(data.size(), 131072u);
  const Recording train = data.rows(40650, 40650 + 26076), test = data.rows(105712, 127400),
                  arrow = data.rows(100, 40575);
  const auto errors = [&](const IdentifiedModel& m) {
    return std::pair{free_run_error(m, test, "y"), free_run_error(m, arrow, "y")};
  };
  // Linear model, refined: bar 7.1 mV.
  SecondOrderOptions linear;
  linear.library = {"1", "y", "y'", "u"};
  linear.max_added = 0;
  const IdentifiedModel line = identify_second_order(train, linear);
  const auto [line_test, line_arrow] = errors(line);
  print("linear", line, line_test, line_arrow);
  EXPECT_LE(line_test, 7.1e-3);

  // Sparse regression alone finds the structure y', y, y^3, u, 1.
  SecondOrderOptions plain;
  plain.refine = false;
  const IdentifiedModel sparse = identify_second_order(train, plain);
  const auto [sparse_test, sparse_arrow] = errors(sparse);
  print("sparse", sparse, sparse_test, sparse_arrow);
  EXPECT_EQ(sparse.equations[1].terms.size(), 5u);
  EXPECT_TRUE(std::isnan(coefficient_of(sparse, "y^2")));

  SecondOrderOptions five;
  five.max_added = 0;
  const IdentifiedModel cubic = identify_second_order(train, five);
  const auto [cubic_test, cubic_arrow] = errors(cubic);
  print("cubic + offset", cubic, cubic_test, cubic_arrow);
  EXPECT_LE(cubic_test, 0.35e-3);
  EXPECT_LE(cubic_arrow, 0.42e-3);
  EXPECT_NEAR(coefficient_of(cubic, "y") / -1.8492e5, 1, 0.003);
  EXPECT_NEAR(coefficient_of(cubic, "y^3") / -7.44e5, 1, 0.03);
  EXPECT_NEAR(cubic.parameter("f0")->value, 68.44, 0.1);

  const IdentifiedModel found = identify_second_order(train);
  const auto [found_test, found_arrow] = errors(found);
  print("structure found", found, found_test, found_arrow);
  EXPECT_LE(found_test, 0.30e-3);
  EXPECT_LE(found_arrow, 0.36e-3);
  EXPECT_EQ(found.summary.status, Status::ok);
}

IdentifiedModel duffing() {
  IdentifiedModel m;
  m.states = {"y", "y'"};
  m.inputs = {"u"};
  m.equations = {
      {"y'", {{"y'", {1, 0, 1, 1}, ""}}},
      {"y''",
       {{"y", {-90, 1, 0, 0}, ""}, {"y'", {-0.9, 1, 0, 0}, ""}, {"y^3", {-40, 1, 0, 0}, ""}, {"u", {5, 1, 0, 0}, ""}}}};
  return m;
}
Recording drive(double dt, Eigen::Index n) {
  Recording r;
  r.dt = dt;
  Eigen::VectorXd u(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double t = dt * static_cast<double>(i);
    u[i] = 6 * (std::sin(7 * t) + std::sin(11.3 * t + 1) + std::cos(4.1 * t));
  }
  r.add("u", Quantity::dimensionless, u);
  return r;
}

TEST(RefineProperty, FreeRunOfTheTruthIsRecoveredFromAPoorStart) {
  const IdentifiedModel truth = duffing();
  const CompiledModel compiled(truth);
  Recording r = drive(0.02, 2000);
  FreeRun run;
  run.inputs = half_grid_inputs(compiled, r);
  run.start = (Eigen::VectorXd(2) << 0.3, -1.0).finished();
  const ModelRun exact = simulate(compiled, run.inputs, run.start, r.dt, r.size());
  run.measured = exact.state("y");
  run.start += (Eigen::VectorXd(2) << 0.05, 0.4).finished();
  IdentifiedModel guess = truth;
  guess.equations[1].terms[0].coefficient.value = -88;
  guess.equations[1].terms[1].coefficient.value = -1.5;
  guess.equations[1].terms[2].coefficient.value = -30;
  const Refined refined = refine_free_run(guess, {run}, r.dt, {.outputs = {"y"}, .output_sd = {}},
                                          {{"y''", {{"y^2", {}, ""}, {"y^5", {}, ""}}}});
  EXPECT_TRUE(refined.converged);
  EXPECT_NEAR(coefficient_of(refined.model, "y"), -90, 1e-5);
  EXPECT_NEAR(coefficient_of(refined.model, "y'"), -0.9, 1e-6);
  EXPECT_NEAR(coefficient_of(refined.model, "y^3"), -40, 1e-4);
  EXPECT_NEAR(refined.starts[0][1], -1.0, 1e-6);
  EXPECT_EQ(coefficient_of(refined.model, "u") > 0, true);
  EXPECT_EQ(refined.model.equations[0].terms[0].coefficient.value, 1);  // known: sd is 0
}

TEST(RefineProperty, SensitivitiesAreTheDerivativeOfTheFreeRun) {
  // The score's first-order step of a term missing from the model finds its coefficient_of when that is small.
  IdentifiedModel truth = duffing();
  truth.equations[1].terms.push_back({"y^2", {0.01, 1, 0, 0}, ""});
  const CompiledModel compiled(truth);
  Recording r = drive(0.02, 1500);
  FreeRun run;
  run.inputs = half_grid_inputs(compiled, r);
  run.start = Eigen::VectorXd::Zero(2);
  run.measured = simulate(compiled, run.inputs, run.start, r.dt, r.size()).state("y");
  const Refined refined = refine_free_run(duffing(), {run}, r.dt, {.outputs = {"y"}, .output_sd = {}},
                                          {{"y''", {{"y^2", {}, ""}, {"y*y'", {}, ""}}}});
  ASSERT_EQ(refined.scores.size(), 2u);
  EXPECT_EQ(refined.scores[0].function, "y^2");
  EXPECT_NEAR(refined.scores[0].coefficient, 0.01, 1e-4);
  EXPECT_GT(refined.scores[0].score, 100 * refined.scores[1].score);
}

TEST(SecondOrder, BadInputIsToldByName) {
  Recording r = drive(0.01, 1000);
  EXPECT_THROW(identify_second_order(r), Error);
  r.add("y", Quantity::displacement, Eigen::VectorXd::Random(1000));
  EXPECT_THROW(identify_second_order(r, {.library = {"1", "q"}, .solver = {}, .candidates = {}}), Error);
}

}  // namespace
}  // namespace whirl::identification
