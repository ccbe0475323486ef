#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "../program.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/json.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/control/identified_machine.hpp"

namespace whirl::testing {
namespace {

constexpr double kRpm = std::numbers::pi / 30;

void write_model(const Folder& folder, const Machine& m) { io::save(folder / "model.json", identified(m)); }

double peak(const Eigen::VectorXd& x, const Eigen::VectorXd& y) {
  return (x.array().square() + y.array().square()).sqrt().maxCoeff();
}

std::vector<std::pair<const char*, Machine>> machines() {
  std::vector<std::pair<const char*, Machine>> all(6, {"quintic", machine()});
  all[0].second.quintic = 8e12;
  all[1] = {"quadratic damping", machine()};
  all[1].second.quadratic = 20;
  all[2] = {"dry friction", machine()};
  all[2].second.dry = 0.15;
  all[3] = {"gyroscopic", machine()};
  all[3].second.gyroscopic = 0.05;
  all[4] = {"rotating damping", machine()};
  all[4].second.c_rotating = 0.8;
  all[5] = {"cross-coupled", machine()};
  all[5].second.cross = 60;
  return all;
}

// The machine is integrated by a program of its own (testing/machines.hpp). Without the force the peak is 7 to 40 % off
// for the first five.
TEST(FurtherForcesE2e, ARunHasEveryForceOfTheModelAtEverySamplingRate) {
  for (const auto& [name, m] : machines()) {
    const Folder folder;
    write_model(folder, m);
    whirl::testing::Run run;
    run.from_hz = 5;
    run.to_hz = 30;
    run.seconds = 8;
    const Eigen::MatrixX2d truth = readings(m, run);
    const double expected = peak(truth.col(0), truth.col(1));
    for (const double rate : {150.0, 1000.0}) {
      const Outcome sim = folder.whirl(fmt::format(
          "simulate model.json --from-rpm 300 --to-rpm 1800 --seconds 8 --rate-hz {} --out run.csv --force", rate));
      ASSERT_EQ(sim.exit_code, 0) << name << sim.err;
      const io::Table out = io::read_table(folder / "run.csv");
      // Seven samples a turn miss the top of a circle by nothing.
      EXPECT_NEAR(peak(out["x"], out["y"]), expected, 0.004 * expected) << name << " " << rate;
    }
  }
}

// Above the fold there is one steady whirl: the machine turning at that speed ends in it.
TEST(FurtherForcesE2e, TheSteadyResponseHasEveryForceOfTheModel) {
  for (const auto& [name, m] : machines()) {
    const Folder folder;
    write_model(folder, m);
    whirl::testing::Run run;
    run.from_hz = run.to_hz = 10.5;
    run.seconds = 8;
    const Eigen::MatrixX2d truth = readings(m, run).bottomRows(500);
    const double expected = peak(truth.col(0), truth.col(1));
    const Outcome curve = folder.whirl("response model.json --from-rpm 400 --to-rpm 640 --json");
    ASSERT_EQ(curve.exit_code, 0) << name << curve.err;
    const io::Json json = io::parse_json(curve.out, "stdout");
    double below = 0, above = std::numeric_limits<double>::infinity(), low = 0, high = 0;
    for (const io::JsonReader& p : io::JsonReader(json, "stdout").at("points").items()) {
      const double w = p.at("omega").number() / (2 * std::numbers::pi);
      if (w <= 10.5 && w > below) below = w, low = p.at("amplitude").number();
      if (w >= 10.5 && w < above) above = w, high = p.at("amplitude").number();
    }
    const double found = low + (high - low) * (10.5 - below) / std::max(1e-12, above - below);
    EXPECT_NEAR(found, expected, 0.01 * expected) << name;
  }
}

// Rotating damping: small motion grows from sqrt(k1) (1 + c / c_rotating) on. A design has that force and holds it.
TEST(FurtherForcesE2e, ARotorThatWhirlsByItselfIsHeldByADesignAndRefusedByAPlan) {
  Machine m = machine();
  m.c_rotating = 5;
  const double onset = std::sqrt(m.k) * (1 + m.c / m.c_rotating) / kRpm;
  const Folder folder;
  write_model(folder, m);
  const Outcome design =
      folder.whirl("design model.json --mass-kg 1.5 --law pd --estimator kfe --evaluations 40 --out c.json");
  EXPECT_EQ(design.exit_code, 0) << design.err;
  const std::size_t at = design.err.find("by itself from ");
  ASSERT_NE(at, std::string::npos) << design.err;
  EXPECT_NEAR(std::stod(design.err.substr(at + 15)), onset, 3) << design.err;
  for (const char* command : {"margins c.json model.json --mass-kg 1.5 --speeds 3",
                              "robustness c.json model.json --mass-kg 1.5 --samples 16"}) {
    const Outcome judged = folder.whirl(command);
    EXPECT_EQ(judged.exit_code, 0) << command << judged.err;
    EXPECT_NE(judged.err.find("rotating damping"), std::string::npos) << judged.err;
    EXPECT_EQ(judged.err.find("without the model's"), std::string::npos) << judged.err;
  }
  const Outcome plan = folder.whirl("runup model.json --from-rpm 300 --to-rpm 1800 --limit-mm 20");
  EXPECT_EQ(plan.exit_code, 1) << plan.err;
  EXPECT_EQ(folder.whirl("runup model.json --from-rpm 300 --to-rpm 1000 --limit-mm 20").exit_code, 0);

  m.c_rotating = 0;
  m.quadratic = 20;
  write_model(folder, m);
  const Outcome plain = folder.whirl("runup model.json --from-rpm 300 --to-rpm 1000 --limit-mm 20");
  EXPECT_EQ(plain.exit_code, 0) << plain.err;
  EXPECT_NE(plain.err.find("left out: further forces of the model (c2 20 1/m)"), std::string::npos) << plain.err;
}

}  // namespace
}  // namespace whirl::testing
