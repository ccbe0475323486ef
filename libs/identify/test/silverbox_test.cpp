#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iostream>
#include <sstream>
#include <string>

#include "whirl/core/angles.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/sindy.hpp"
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
/// rms of the free run over the record, V.
double free_run(const IdentifiedModel& m, const Recording& record) { return score(m, record).front().rmse; }

IdentifiedModel fit(const Recording& record, std::vector<std::string> library) {
  SindyOptions options;
  options.states = {"y"};
  options.inputs = {"u"};
  options.order = 2;
  options.library = std::move(library);
  return fit_sindy({record}, options);
}

TEST(SilverboxReference, CubicWithOffsetThenStructureFoundByTheTool) {
  const auto path = testing::data_file("silverbox/SNLS80mV.csv");
  WHIRL_REQUIRE_DATA(path);
  const Silverbox data(path);
  ASSERT_EQ(data.size(), 131072u);
  const Recording train = data.rows(40650, 40650 + 26076), test = data.rows(105712, 127400),
                  arrow = data.rows(100, 40575);
  const auto said = [&](const char* name, const IdentifiedModel& m) {
    std::cout << name << ": multisine " << 1e3 * free_run(m, test) << " mV, arrow " << 1e3 * free_run(m, arrow)
              << " mV; y'' =";
    for (const EquationTerm& t : m.equations[1].terms) std::cout << " + " << t.coefficient.value << " " << t.function;
    std::cout << std::endl;
  };
  // Linear model: bar 7.1 mV.
  const IdentifiedModel line = fit(train, {"1", "y", "y'", "u"});
  said("linear", line);
  EXPECT_LE(free_run(line, test), 7.1e-3);

  const IdentifiedModel cubic = fit(train, {"1", "y", "y^3", "y'", "u"});
  said("cubic + offset", cubic);
  EXPECT_LE(free_run(cubic, test), 0.35e-3);
  EXPECT_LE(free_run(cubic, arrow), 0.42e-3);
  EXPECT_NEAR(coefficient_of(cubic, "y") / -1.8492e5, 1, 0.003);
  EXPECT_NEAR(coefficient_of(cubic, "y^3") / -7.44e5, 1, 0.03);
  EXPECT_NEAR(kHzPerRadPerSec * std::sqrt(-coefficient_of(cubic, "y")), 68.44, 0.1);

  const IdentifiedModel found = fit(train, {});
  said("structure found", found);
  EXPECT_LE(free_run(found, test), 0.30e-3);
  EXPECT_LE(free_run(found, arrow), 0.36e-3);
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

}  // namespace
}  // namespace whirl::identification
