#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <random>

#include "fmu_fixture.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/shaft/control/controller.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::deploy {
namespace {

using FmuRotorExport = FmuExport;

INSTANTIATE_TEST_SUITE_P(Versions, FmuRotorExport, ::testing::Values(2, 3),
                         [](const auto& v) { return fmt::format("Fmi{}", v.param); });

/// Drawn at random: the step needs no rotor.
const shaft::RotorController& controller() {
  static const shaft::RotorController made = [] {
    std::mt19937_64 random(11);
    std::normal_distribution<double> normal;
    const auto matrix = [&](int rows, int columns, double size) {
      return Eigen::MatrixXd(size * Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); }));
    };
    shaft::RotorController c;
    c.sample_time = 2e-4;
    c.adaptation = 2;
    c.probes = {{"a x", 0, 0}, {"a y", 0, 1.6}, {"b", 1, 0.3}};
    for (const char* const name : {"upper", "lower"}) {
      shaft::Actuator a;
      a.name = name;
      a.force_limit = 20;
      a.slew = 2e4;
      c.actuators.push_back(a);
    }
    for (const double speed : {50.0, 400.0, 900.0}) {
      c.gains.push_back({speed, 0.9 * Eigen::MatrixXd::Identity(4, 4) + matrix(4, 4, 0.02), matrix(4, 3, 1e-2),
                         matrix(4, 2, 1e-9), matrix(2, 4, 1e7)});
      shaft::SynchronousGains turning{speed, matrix(2, 3, 1e4).cast<std::complex<double>>(),
                                      Eigen::MatrixXcd::Zero(2, 2), Eigen::VectorXcd::Constant(2, {0.5, 1}),
                                      Eigen::VectorXd::Constant(2, 10)};
      turning.correction += std::complex<double>(0, 1) * matrix(2, 3, 1e4).cast<std::complex<double>>();
      c.synchronous.push_back(turning);
    }
    return c;
  }();
  return made;
}

std::vector<std::string> variables_of(const Importer& fmu, const std::string& causality) {
  std::vector<std::string> names;
  for (const pugi::xml_node& v : fmu.variables)
    if (v.attribute("causality").value() == causality) names.emplace_back(v.attribute("name").value());
  return names;
}

TEST_P(FmuRotorExport, StepsAreThoseOfTheProgram) {
  const Importer fmu = import(controller());
  void* const c = fmu.instantiate(false, fmu.token);
  ASSERT_NE(c, nullptr);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  const std::vector<std::string> inputs = variables_of(fmu, "input"), outputs = variables_of(fmu, "output");
  const auto probes = static_cast<Eigen::Index>(controller().probes.size());
  ASSERT_EQ(inputs.size(), controller().probes.size() + 2);
  ASSERT_EQ(outputs.size(), controller().actuators.size());
  shaft::RotorControl control(controller());
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Eigen::VectorXd readings = Eigen::VectorXd::Zero(probes);
  const double h = controller().sample_time;
  double size = 0, error = 0, angle = 0;
  for (int k = 0; k < 20000; ++k) {
    const double speed = 40 + 0.05 * k;
    angle += speed * h;
    for (Eigen::Index p = 0; p < probes; ++p) {
      readings[p] = 0.98 * readings[p] + 2e-6 * normal(random);
      ASSERT_EQ(fmu.set(c, inputs[static_cast<std::size_t>(p)], readings[p]), 0);
    }
    ASSERT_EQ(fmu.set(c, "angle", angle), 0);
    ASSERT_EQ(fmu.set(c, "speed", speed), 0);
    ASSERT_EQ(fmu.step(c, h * k, h), 0);
    const Eigen::VectorXd& force = control.step(readings, angle, speed);
    for (std::size_t j = 0; j < outputs.size(); ++j) {
      const double wanted = force[static_cast<Eigen::Index>(j)];
      size = std::max(size, std::abs(wanted));
      error = std::max(error, std::abs(fmu.get(c, outputs[j]) - wanted));
    }
  }
  RecordProperty("largest_difference_N", fmt::format("{:.2g} of {:.3g}", error, size));
  EXPECT_GT(size, 1);
  EXPECT_LE(error, 1e-9 * size);
  fmu.free(c);
}

TEST_P(FmuRotorExport, OtherStepsAndWhatIsNoNumberAreRefused) {
  const Importer fmu = import(controller());
  EXPECT_EQ(fmu.instantiate(true, fmu.token), nullptr);
  const double h = controller().sample_time;
  void* const other = fmu.instantiate(false, fmu.token);
  ASSERT_EQ(fmu.set(other, "sample_time", 2 * h), 0);
  ASSERT_EQ(fmu.enter_initialization(other, 0), 0);
  EXPECT_NE(fmu.call("ExitInitializationMode", other), 0);
  fmu.free(other);
  void* const c = fmu.instantiate(false, fmu.token);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  EXPECT_NE(fmu.step(c, 0, 2 * h), 0);
  ASSERT_EQ(fmu.step(c, 0, h), 0);
  EXPECT_NE(fmu.step(c, 5 * h, h), 0);
  ASSERT_EQ(fmu.set(c, "speed", std::numeric_limits<double>::quiet_NaN()), 0);
  EXPECT_NE(fmu.step(c, h, h), 0);
  ASSERT_EQ(fmu.set(c, "speed", 100), 0);
  EXPECT_EQ(fmu.step(c, h, h), 0);
  EXPECT_NE(fmu.set_boolean(c, variables_of(fmu, "output").front(), true), 0);
  fmu.free(c);
}

TEST(FmuRotor, NamesOfProbesThatAreAlikeStayApart) {
  shaft::RotorController c = controller();
  for (shaft::Probe& p : c.probes) p.name = "*/ speed";
  c.actuators.front().name = "angle";
  FmuOptions o;
  o.code.prefix = "alike";
  const std::string xml = fmu_files(c, o).front().text;
  EXPECT_NE(xml.find("name=\"___speed\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("name=\"___speed_2\""), std::string::npos) << xml;
  EXPECT_NE(xml.find("name=\"angle_2\""), std::string::npos) << xml;
  const std::string why = testing::error_of([&] { source_files(c, "matlab", o.code); });
  EXPECT_NE(why.find("c or fmu"), std::string::npos) << why;
}

}  // namespace
}  // namespace whirl::deploy
