// Controllers of flexible rotors: closed forms, stability over random machines, refusals, the step in C.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <random>

#include "control/closed_loop.hpp"
#include "control/sampled_plant.hpp"
#include "rotors.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/control/control_json.hpp"
#include "whirl/shaft/control/controller.hpp"
#include "whirl/shaft/control/design.hpp"
#include "whirl/shaft/control/export_c.hpp"
#include "whirl/shaft/control/passages.hpp"
#include "whirl/shaft/fit/fit.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/testing/compiled.hpp"

namespace whirl::shaft {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::kRpm;

Rotor levitated_rotor() { return parse_rotor(rotor_template("levitated"), "levitated"); }

/// A mass without damping on a spring, held force: (1 - cos w T) / k and sin(w T) / (m w) after a step.
TEST(ShaftControlReference, SampledPlantOfOneMass) {
  Rotor rotor = levitated_rotor();
  const PlantFamily plants(rotor, assemble(rotor), 1);  // the rigid motion that the magnets push apart
  const SampledPlant one = plants.at(0, 1e-3), two = plants.at(0, 2e-3);
  EXPECT_LT((one.a * one.a - two.a).norm(), 1e-10 * two.a.norm());
  EXPECT_LT((one.a * one.b + one.b - two.b).norm(), 1e-10 * two.b.norm());
  double growth = 0;
  for (const auto pole : plants.poles(0)) growth = std::max(growth, pole.real());
  EXPECT_NEAR(std::log(one.a.eigenvalues().cwiseAbs().maxCoeff()) / 1e-3, growth, 1e-6 * growth);
}

ControlOptions levitated_options(double to = 9000 * kRpm) {
  ControlOptions o;
  o.to = to;
  o.sample_time = 1e-4;
  o.schedule = 3;
  o.checked = 5;
  return o;
}
RotorController levitated_controller(const Rotor& rotor, const ControlOptions& o = levitated_options()) {
  const ControlDesign d = design_rotor_control(rotor, o);
  EXPECT_TRUE(d.refused.empty());
  EXPECT_LT(d.worst_sensitivity, 3);
  return d.controller;
}
/// Of that rotor, designed once.
const RotorController& levitated() {
  static const RotorController c = levitated_controller(levitated_rotor());
  return c;
}

/// One actuator, one probe: 1 / (1 + L), L from plant and controller apart.
TEST(ShaftControlReference, SensitivityOfOneLoop) {
  Rotor rotor = parse_rotor(rotor_template("jeffcott"), "jeffcott");
  rotor.actuators = {{"x", {"shaft", 250e-3}, {"ground", 250e-3}, 0, 100, 0, 0}};
  rotor.probes.resize(1);
  ControlOptions o;
  o.to = 3000 * kRpm;
  o.modes = 2;
  o.schedule = 1;
  const ControlDesign d = design_rotor_control(rotor, o);
  const SampledPlant p = PlantFamily(rotor, assemble(rotor), 2).at(100, o.sample_time);
  const ClosedLoop loop(p, d.controller, 100, {.synchronous = false});
  const ControlGains& g = d.controller.gains.front();
  const auto one = [](Eigen::Index n) { return Eigen::MatrixXcd::Identity(n, n); };
  for (const double w : {50.0, 300.0, 2000.0, 9000.0}) {
    const std::complex<double> z = std::polar(1.0, w * o.sample_time);
    const auto cast = [](const MatrixXd& m) { return Eigen::MatrixXcd(m.cast<std::complex<double>>()); };
    const Eigen::MatrixXcd plant = cast(p.c) * (z * one(p.a.rows()) - cast(p.a)).inverse() * cast(p.b);
    // z s = advance s + readings y + forces a, z a = -feedback z s.
    const Eigen::MatrixXcd state = (z * one(g.advance.rows()) - cast(g.advance)).inverse();
    const auto by_reading = (cast(g.feedback) * state * cast(g.readings))(0, 0);
    const auto by_force = (cast(g.feedback) * state * cast(g.forces))(0, 0);
    const auto control = -by_reading / (1.0 + by_force);
    EXPECT_NEAR(loop.sensitivity(w)[0], std::abs(1.0 / (1.0 - plant(0, 0) * control)), 1e-7) << w;
  }
}

/// A turning part that learned faster than a lightly damped loop settles would be unstable: it is slowed down.
TEST(ShaftControlProperty, TurningPartLearnsNoFasterThanTheLoopSettles) {
  Rotor rotor = parse_rotor(rotor_template("jeffcott"), "jeffcott");
  rotor.actuators = {{"x", {"shaft", 0.1}, {"ground", 0.1}, 0, 20, 0, 0}};
  ControlOptions o;
  o.from = o.to = 1000 * kRpm;
  o.modes = 1;
  o.checked = 1;
  const ControlDesign d = design_rotor_control(rotor, o);
  EXPECT_TRUE(d.refused.empty());
  EXPECT_LT(d.controller.adaptation, o.adaptation);
}

/// The peak is that of the loop at single frequencies, and a loop decays where its growth is below zero.
TEST(ShaftControlReference, PeakAndDecayOfTheLoopOfTheMagnets) {
  const Rotor rotor = levitated_rotor();
  const SampledPlant p = PlantFamily(rotor, assemble(rotor), levitated_options().modes).at(500, 1e-4);
  const ClosedLoop loop(p, levitated(), 500, {.synchronous = false});
  VectorXd largest = VectorXd::Zero(4);
  for (double w = 3; w < 31400; w *= 1.002) largest = largest.cwiseMax(loop.sensitivity(w)).eval();
  const VectorXd peak = loop.sensitivity_peak();
  for (Eigen::Index k = 0; k < 4; ++k) EXPECT_NEAR(peak[k] / largest[k], 1, 0.01) << k;
  int decaying = 0, growing = 0;
  for (double gain = 0.05; gain < 20; gain *= 1.2) {
    const ClosedLoop changed(p, levitated(), 500, {.gain = gain, .synchronous = false});
    EXPECT_EQ(changed.decays(), changed.growth() < 0) << gain;
    ++(changed.decays() ? decaying : growing);
  }
  EXPECT_GT(decaying, 3);
  EXPECT_GT(growing, 3);
}

std::vector<ControlCase> refused(const Rotor& rotor, const RotorController& c, const ControlOptions& o) {
  std::vector<ControlCase> list;
  const ControlDesign d = check_rotor_control(rotor, c, o);
  for (const ControlRefusal& r : d.refused) list.push_back(r.with);
  EXPECT_EQ(d.summary.status == Status::unusable, !list.empty() || d.worst_sensitivity >= 5);
  return list;
}
/// The gain of the loop, without the turning part.
RotorController scaled(RotorController c, double factor) {
  for (ControlGains& g : c.gains) g.readings *= factor;
  for (SynchronousGains& g : c.synchronous) {
    g.correction.setZero();
    g.relief.setZero();
  }
  return c;
}
bool has(const std::vector<ControlCase>& list, ControlCase c) { return std::ranges::find(list, c) != list.end(); }

/// Gains are lowered and raised until the loop is unstable: one of the changes is refused before the design itself is.
TEST(ShaftControlRefusal, GainBeforeTheDesignItself) {
  const Rotor rotor = levitated_rotor();
  const ControlOptions o = levitated_options();
  const RotorController c = levitated();
  bool low = false, high = false;
  // Steps below the 20 % of a change: none passes over the factors at which it alone is unstable.
  for (double factor = 0.95; factor > 0.05; factor *= 0.85) {
    const auto list = refused(rotor, scaled(c, factor), o);
    if (has(list, ControlCase::nominal)) break;
    low = low || has(list, ControlCase::gain_low);
  }
  for (double factor = 1.05; factor < 50; factor *= 1.18) {
    const auto list = refused(rotor, scaled(c, factor), o);
    if (has(list, ControlCase::nominal)) break;
    high = high || has(list, ControlCase::gain_high);
  }
  EXPECT_TRUE(low);
  EXPECT_TRUE(high);
}

/// The slower the samples, the more one of them costs: some rate is too slow for one more and not yet by itself.
TEST(ShaftControlRefusal, OneSampleMoreDelay) {
  const Rotor rotor = levitated_rotor();
  bool delay = false;
  for (double rate = 2000; rate > 100 && !delay; rate *= 0.7) {
    ControlOptions o = levitated_options(2000 * kRpm);
    o.sample_time = 1 / rate;
    o.sensitivity = 50;
    std::vector<ControlCase> list;
    for (const ControlRefusal& r : design_rotor_control(rotor, o).refused) list.push_back(r.with);
    delay = has(list, ControlCase::delay) && !has(list, ControlCase::nominal);
  }
  EXPECT_TRUE(delay);
}

TEST(ShaftControlRefusal, UnstableAsDesigned) {
  Rotor rotor = levitated_rotor();
  const RotorController c = levitated();
  rotor.actuators[0].angle += 3.14159265;  // connected the wrong way round
  EXPECT_TRUE(has(refused(rotor, c, levitated_options()), ControlCase::nominal));
}

/// Without feedback the loop is the rotor: below its threshold, above that with twice the damping that turns.
TEST(ShaftControlRefusal, TwiceTheRotatingDamping) {
  Rotor rotor = parse_rotor(rotor_template("active-centrifuge"), "active");
  rotor.joints = {{0.2, 0.38, 0.5}};
  const auto threshold = stability_threshold(assemble(rotor), 10, 3000);
  ASSERT_TRUE(threshold);
  ControlOptions o;
  o.from = 10;
  o.to = 0.95 * threshold->speed;
  o.schedule = 2;
  o.checked = 12;
  RotorController c = design_rotor_control(rotor, o).controller;
  c = scaled(c, 0);
  EXPECT_EQ(refused(rotor, c, o), std::vector<ControlCase>{ControlCase::rotating_damping});
}

/// A controller that knows one mode too few drives the next one: stable on the reduced model alone.
TEST(ShaftControlRefusal, ModesThatTheControllerDoesNotKnow) {
  const Rotor rotor = levitated_rotor();
  ControlOptions o = levitated_options();
  o.modes = 2;
  const ControlDesign d = design_rotor_control(rotor, o);
  bool spilled = false;
  for (double factor = 1; factor < 30 && !spilled; factor *= 1.2) {
    const auto list = refused(rotor, scaled(d.controller, factor), o);
    if (has(list, ControlCase::nominal)) break;
    spilled = has(list, ControlCase::full_model);
  }
  EXPECT_TRUE(spilled);
}

/// A controller of other probes or actuators is no controller of this rotor.
TEST(ShaftControlRefusal, ProbesOfAnotherMachine) {
  const Rotor other = parse_rotor(rotor_template("active-centrifuge"), "active");
  try {
    check_rotor_control(other, levitated(), levitated_options());
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("bowl x"), std::string::npos) << e.what();
  }
}

/// A force that turns above the limit is cut: said where it is, and only there.
TEST(ShaftControlRefusal, TurningForceAboveTheLimitIsNamed) {
  Rotor rotor = levitated_rotor();
  const ControlOptions o = levitated_options();
  RotorController c = levitated();
  EXPECT_EQ(check_rotor_control(rotor, c, o).summary.find(FindingCode::requirement_missed), nullptr);
  for (Actuator& a : c.actuators) a.force_limit = 0.1;
  const ControlDesign d = check_rotor_control(rotor, c, o);
  const Finding* f = d.summary.find(FindingCode::requirement_missed);
  ASSERT_NE(f, nullptr);
  EXPECT_GT(f->amount("value"), f->amount("most"));
  EXPECT_NE(f->where.find("turning force"), std::string::npos) << f->where;
}

/// The limits of the machine hold in a run, whatever the controller was designed for.
TEST(ShaftControlRefusal, TheMachinesOwnLimitsHoldInARun) {
  Rotor rotor = levitated_rotor();
  const System many = reduce(assemble(rotor), {.modes = 8}).system;
  for (Actuator& a : rotor.actuators) a.force_limit = 0.5, a.slew = 100;
  RunOptions run;
  run.from = run.to = 3000 * kRpm;
  run.duration = 0.05;
  run.sample_time = levitated().sample_time;
  run.tolerance = 1;
  run.from_rest = true;
  run.control = sampled_forces(rotor, many, levitated());
  const RotorRun r = simulate_run(many, run);
  EXPECT_LE(r.forces.cwiseAbs().maxCoeff(), 0.5);
  const auto steps = r.forces.rightCols(r.forces.cols() - 1) - r.forces.leftCols(r.forces.cols() - 1);
  EXPECT_LE(steps.cwiseAbs().maxCoeff(), 100 * run.sample_time * (1 + 1e-9));
}

TEST(ShaftControlRefusal, SensitivityAboveTheLimitIsNamed) {
  const Rotor rotor = levitated_rotor();
  ControlOptions o = levitated_options();
  const RotorController& c = levitated();
  o.sensitivity = 1.1;
  const ControlDesign d = check_rotor_control(rotor, c, o);
  const Finding* f = d.summary.find(FindingCode::requirement_missed);
  ASSERT_NE(f, nullptr);
  EXPECT_GT(f->amount("value"), 1.1);
}

TEST(ShaftControlFile, RoundTripAndRefusal) {
  RotorController c = levitated();
  c.probes[1].runout = 3e-6;
  c.probes[1].runout_angle = 1.2;
  const io::Json document = io::parse_json(controller_json(c).dump(), "c.json");
  const RotorController again = read_controller(io::JsonReader(document, "c.json"));
  RotorControl one(c), two(again);
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal(0, 1e-5);
  for (int k = 0; k < 500; ++k) {
    const VectorXd y = VectorXd::NullaryExpr(4, [&] { return normal(random); });
    EXPECT_EQ(one.step(y, 0.05 * k, 500), two.step(y, 0.05 * k, 500));
  }
  RotorController broken = c;
  broken.gains.back().feedback.conservativeResize(3, Eigen::NoChange);
  EXPECT_THROW(read_controller(io::JsonReader(controller_json(broken), "c.json")), Error);
  broken = c;
  broken.gains.back().speed = -1;
  EXPECT_THROW(check(broken), Error);
}

/// The C code, compiled and run, takes the same steps. (A controller that is unstable by itself would let the last
/// digits grow without its rotor: so not that of the magnets.)
TEST(ShaftControlCode, StepOfTheCompiledCode) {
  Rotor rotor = parse_rotor(rotor_template("kit"), "kit");
  rotor.actuators = {{"x", {"shaft", 0.48}, {"ground", 0.48}, 0, 20, 4e4, 0},
                     {"y", {"shaft", 0.48}, {"ground", 0.48}, 1.5707963, 20, 4e4, 0}};
  ControlOptions o = levitated_options(5000 * kRpm);
  RotorController c = design_rotor_control(rotor, o).controller;
  c.adaptation = 20;
  c.probes[1].runout = 2e-7;
  c.probes[1].runout_angle = 0.7;
  const ControllerCode code = controller_code(c, "machine");
  const whirl::testing::TemporaryFolder folder;
  folder.write("machine.h", code.header);
  folder.write("machine.c", code.source);
  folder.write("main.c", R"(#include <stdio.h>
#include "machine.h"
int main(void) {
  machine_state s;
  double y[4], f[2], angle, speed;
  machine_start(&s);
  while (scanf("%lf %lf %lf %lf %lf %lf", &angle, &speed, y, y + 1, y + 2, y + 3) == 6) {
    machine_step(&s, y, angle, speed, f);
    printf("%.17g %.17g\n", f[0], f[1]);
  }
  return 0;
}
)");
  RotorControl control(c);
  std::mt19937_64 random(9);
  std::normal_distribution<double> normal(0, 1e-7);
  std::string input;
  std::vector<VectorXd> expected;
  double angle = 0;
  for (int k = 0; k < 3000; ++k) {
    const double speed = 550.0 * k / 2500;  // beyond the last speed of the tables as well
    angle += speed * c.sample_time;
    const VectorXd y = VectorXd::NullaryExpr(4, [&] { return normal(random) + 1e-6 * std::cos(angle); });
    input += fmt::format("{:.17g} {:.17g} {:.17g}\n", angle, speed, fmt::join(y.begin(), y.end(), " "));
    expected.push_back(control.step(y, angle, speed));
  }
  folder.write("input", input);
  const auto made = whirl::testing::shell(folder.path(), "cc " + std::string(whirl::testing::kStrictC99) +
                                                             " machine.c main.c -o run -lm && ./run < input > output");
  ASSERT_EQ(made.exit_code, 0) << made.text;
  std::ifstream output(folder.path() / "output");
  double worst = 0, largest = 0;
  for (const VectorXd& force : expected)
    for (const double f : force) {
      double read = 1e9;
      output >> read;
      worst = std::max(worst, std::abs(read - f));
      largest = std::max(largest, std::abs(f));
    }
  std::printf("  forces up to %.3g N, largest difference %.1e N\n", largest, worst);
  EXPECT_LT(worst, 1e-9 * largest);
  EXPECT_THROW(controller_code(c, "9 lives"), Error);
}

TEST(ShaftControlFile, ForcesStayWithinSizeAndRate) {
  Rotor rotor = levitated_rotor();
  for (Actuator& a : rotor.actuators) a.slew = 1e5;
  RotorControl control(levitated_controller(rotor));
  VectorXd before = VectorXd::Zero(4);
  for (int k = 0; k < 400; ++k) {
    const VectorXd force = control.step(VectorXd::Constant(4, k % 100 < 50 ? 1 : -1), 0.1 * k, 900);
    EXPECT_LE(force.cwiseAbs().maxCoeff(), 200);
    EXPECT_LE((force - before).cwiseAbs().maxCoeff(), 1e5 * 1e-4 * (1 + 1e-9));
    before = force;
  }
}

TEST(ShaftControlFile, BadActuatorsAreRefused) {
  const std::string text(rotor_template("jeffcott"));
  const auto with = [&](const std::string& lines) { return text + "\n[[actuator]]\n" + lines; };
  EXPECT_NO_THROW(parse_rotor(with("position_mm = 100\nforce_limit_N = 5\n"), "r.toml"));
  for (const char* lines :
       {"position_mm = 100\n", "position_mm = 900\nforce_limit_N = 5\n", "position_mm = 100\nforce_limit_N = -5\n",
        "position_mm = 100\nforce_limit_N = 5\non = \"ground\"\n",
        "position_mm = 100\nforce_limit_N = 5\non = \"casing\"\n",
        "position_mm = 100\nforce_limit_N = 5\nbias_stiffness_N_m = 1e5\n",
        "position_mm = 100\nforce_limit_N = 5\nagainst = \"shaft\"\n",
        "position_mm = 100\nforce_limit_N = 5\nslew = 3\n",
        "name = \"a\"\nposition_mm = 100\nforce_limit_N = 5\n[[actuator]]\nname = \"a\"\nposition_mm = 100\n"
        "force_limit_N = 5\n"})
    try {
      parse_rotor(with(lines), "r.toml");
      ADD_FAILURE() << lines;
    } catch (const Error& e) {
      EXPECT_NE(std::string(e.what()).find("r.toml"), std::string::npos) << e.what();
      EXPECT_NE(std::string(e.what()).find("actuator"), std::string::npos) << e.what();
    }
  try {
    parse_rotor(with("position_mm = 100\nforce_limit_N = 5\nslew_N_s = -1\n"), "r.toml");
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("1e+300 N/s"), std::string::npos) << e.what();
  }
  Rotor rotor = levitated_rotor();
  rotor.probes[1].runout = 7e-6;
  rotor.probes[1].runout_angle = -0.4;
  const Rotor again = parse_rotor(rotor_text(rotor), "again");
  EXPECT_NEAR(again.probes[1].runout, 7e-6, 1e-18);
  EXPECT_NEAR(again.probes[1].runout_angle, -0.4, 1e-12);
  ASSERT_EQ(again.actuators.size(), 4U);
  EXPECT_EQ(again.actuators[3].bias_stiffness, -2e5);
  EXPECT_NEAR(again.actuators[3].angle, rotor.actuators[3].angle, 1e-12);
}

TEST(ShaftControlFile, AFitRefusesMagnets) {
  OrderRun run;
  run.vectors = Eigen::MatrixXcd::Zero(4, 1);
  try {
    fit_rotor(levitated_rotor(), {}, {run});
    ADD_FAILURE();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("bias_stiffness"), std::string::npos) << e.what();
  }
}

}  // namespace
}  // namespace whirl::shaft
