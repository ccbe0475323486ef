#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/core/integrate.hpp"
#include "whirl/deploy/system.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::deploy {
namespace {

/// A compiled model; its parameters fit the buffer.
struct CompiledC {
  explicit CompiledC(const testing::SharedLibrary& library, const std::string& prefix = "plant")
      : rates(library.get<void(const void*, double, const double*, const double*, double*)>(prefix + "_rates")),
        outputs(library.get<void(const void*, double, const double*, const double*, double*)>(prefix + "_outputs")),
        step(library.get<void(const void*, double, double*, const double*, double)>(prefix + "_step")) {
    library.get<void(void*)>(prefix + "_default_params")(params);
  }
  alignas(16) unsigned char params[4096] = {};
  void (*rates)(const void*, double, const double*, const double*, double*);
  void (*outputs)(const void*, double, const double*, const double*, double*);
  void (*step)(const void*, double, double*, const double*, double);
};

std::filesystem::path build(const testing::TemporaryFolder& folder, const IdentifiedModel& model) {
  for (const SourceFile& f : export_c99(model, {"plant", false, ""})) folder.write(f.name, f.text);
  const auto built = testing::shell(folder.path(), std::string("cc ") + testing::kStrictC99 +
                                                       " -fPIC -shared -o plant.so plant.c -lm && "
                                                       "make check CFLAGS='" +
                                                       testing::kStrictC99 + "'");
  EXPECT_EQ(built.exit_code, 0) << built.text;
  return folder.path() / "plant.so";
}

RotorModel rotor() {
  RotorModel m;
  m.k1 = 5700;
  m.k2 = 1e7;
  m.c = 1;
  m.k1_conj = {20, -15};
  m.c_conj = {0.02, 0.01};
  m.eps = {280e-6, 40e-6};
  m.offset = {3e-6, -8e-6};
  m.gain = 1 / 1.5;
  return m;
}

IdentifiedModel model_equations() {
  IdentifiedModel m;
  m.method = "paper";
  m.states = {"X1", "X2", "X3", "X4"};
  m.inputs = {"X5", "X6", "ux"};
  const auto term = [](const char* function, double value) {
    return EquationTerm{function, {value, 0, value, value}, ""};
  };
  m.equations = {
      {"X2'",
       {term("X1", -5700), term("X1*(X1^2+X3^2)", -1e7), term("X2", -1), term("X6^2*cos(X5)", 3e-4),
        term("sgn(X2)", -0.02), term("ux", 0.66)}},
      {"X4'", {term("X3", -5600), term("abs(X4)*X4", -0.5), term("X6^2*sin(X5)", 3e-4), term("exp(-t)*X6", 1e-5)}}};
  return m;
}

// 14 s run-down: the C right-hand side in the library's integrator, and the library's own, point by point.
TEST(ModelSourceExport, RotorEqualsTheLibraryAlongARunDown) {
  const testing::TemporaryFolder folder;
  IdentifiedModel model;
  model.rotor = rotor();
  const testing::SharedLibrary library(build(folder, model));
  const CompiledC c(library);
  const rotor::AngleFunction angle(rotor::SpeedProfile::run_down(188.5, 14));
  using State = Eigen::Vector4d;
  const double h = 1e-3;
  State mine(1e-4, 0, 0, 0.01), theirs = mine;
  double size = 0, error = 0, output = 0;
  for (int k = 0; k < 14000; ++k) {
    const double t = k * h;
    const auto force = [&](double at) { return std::complex<double>(5 * std::sin(70 * at), 3 * std::cos(60 * at)); };
    const auto f_c = [&](double at, const State& x) {
      const rotor::AngleState a = angle(at);
      const double u[] = {a.beta, a.omega, a.alpha, force(t).real(), force(t).imag()};
      State dx;
      c.rates(c.params, at, x.data(), u, dx.data());
      return dx;
    };
    const auto f_library = [&](double at, const State& x) {
      const rotor::AngleState a = angle(at);
      const std::complex<double> acc = rotor::lateral_acceleration(
          *model.rotor, {x[0], x[2]}, {x[1], x[3]}, rotor::unbalance_forcing(a.beta, a.omega, a.alpha), force(t));
      return State(x[1], acc.real(), x[3], acc.imag());
    };
    mine = rk4_step<State>(f_c, t, mine, h);
    theirs = rk4_step<State>(f_library, t, theirs, h);
    size = std::max(size, theirs.cwiseAbs().maxCoeff());
    error = std::max(error, (mine - theirs).cwiseAbs().maxCoeff());
    double y[2];
    const double u[5] = {};
    c.outputs(c.params, t, mine.data(), u, y);
    output = std::max({output, std::abs(y[0] - mine[0] - 3e-6), std::abs(y[1] - mine[2] + 8e-6)});
  }
  EXPECT_GT(size, 0.1);
  EXPECT_LE(error, 1e-12 * size);
  EXPECT_LE(output, 1e-18);
}

// Forces beyond RotorModel: against the machine that is integrated in testing/machines.hpp.
TEST(ModelSourceExport, RatesHaveTheFurtherForcesOfTheModel) {
  testing::Machine m;
  m.k = 5700, m.cubic = 1e7, m.c = 1, m.e = 3e-4, m.e_phase = 0.4;
  m.quintic = 8e12, m.quadratic = 20, m.dry = 0.15, m.gyroscopic = 0.05, m.c_rotating = 0.8, m.cross = 60;
  IdentifiedModel model;
  model.rotor = RotorModel{};
  model.rotor->k1 = m.k, model.rotor->k2 = m.cubic, model.rotor->c = m.c;
  model.rotor->eps = std::polar(m.e, m.e_phase);
  for (const auto& [name, value] : {std::pair{"k3", m.quintic},
                                    {"c2", m.quadratic},
                                    {"friction", m.dry},
                                    {"friction_speed", 1e-4},
                                    {"gyroscopic", m.gyroscopic},
                                    {"c_rotating", m.c_rotating},
                                    {"k_cross", m.cross}})
    model.parameters.emplace_back(name, Estimate::from_sd(value, 0));
  const testing::TemporaryFolder folder;
  const testing::SharedLibrary library(build(folder, model));
  const CompiledC c(library);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (int i = 0; i < 50; ++i) {
    const double x[] = {3e-3 * unit(random), 0.3 * unit(random), 3e-3 * unit(random), 0.3 * unit(random)};
    const double u[] = {6 * unit(random), 200 * unit(random), 20 * unit(random), 0, 0};
    double found[4];
    c.rates(c.params, 0.0, x, u, found);
    const testing::machines_detail::State truth =
        testing::machines_detail::slope(m, 0, u[0], u[1], u[2], {x[0], x[1], x[2], x[3]});
    for (int k = 0; k < 4; ++k)
      EXPECT_NEAR(found[k], truth[static_cast<std::size_t>(k)], 1e-9 * (1 + std::abs(truth[1]) + std::abs(truth[3])));
  }
}

// The exported step follows the angle within the step: fourth order against the prescribed-angle simulation.
TEST(ModelSourceExport, StepFollowsTheLibrarysSimulation) {
  const testing::TemporaryFolder folder;
  IdentifiedModel model;
  model.rotor = rotor();
  model.rotor->modes = {{640, 0.01, {2e-6, 1e-6}}};
  const testing::SharedLibrary library(build(folder, model));
  const CompiledC c(library);
  const rotor::SpeedProfile profile = rotor::SpeedProfile::run_down(188.5, 14);
  const rotor::AngleFunction angle(profile);
  const double h = 1e-3;
  double x[8] = {1e-4, 0, 0, 0.01};
  const rotor::Response reference =
      rotor::simulate(*model.rotor, rotor::angle_signal(profile, h), {1e-4, 0}, {0, 0.01});
  double size = 0, error = 0;
  for (int k = 0; k < 14000; ++k) {
    double y[2];
    const rotor::AngleState a = angle(k * h);
    const double u[] = {a.beta, a.omega, a.alpha, 0, 0};
    c.outputs(c.params, k * h, x, u, y);
    if (k > 3000) {  // the mode starts in its steady state there, at rest here
      size = std::max(size, std::abs(reference.z[k]));
      error = std::max(error, std::abs(std::complex<double>(y[0], y[1]) - reference.z[k]));
    }
    c.step(c.params, k * h, x, u, h);
  }
  EXPECT_GT(size, 1e-3);
  EXPECT_LE(error, 1e-6 * size);
}

TEST(ModelSourceExport, EquationsWithSignAndTimeEqualTheCompiledModel) {
  const testing::TemporaryFolder folder;
  const IdentifiedModel model = model_equations();
  const testing::SharedLibrary library(build(folder, model));
  const CompiledC c(library);
  const identification::CompiledModel compiled(model);
  ASSERT_EQ(compiled.inputs(), (std::vector<std::string>{"X5", "X6", "ux", "t"}));
  auto* const between = library.get<void(const void*, double, const double*, const double*, const double*, double*)>(
      "plant_rates_between");
  auto* const events = library.get<void(const void*, double, const double*, const double*, double*)>("plant_events");
  std::mt19937_64 random(7);
  const auto draw = [&](double size) { return size * (2e-19 * static_cast<double>(random() >> 1) - 0.92); };
  for (int k = 0; k < 500; ++k) {
    double in[8] = {draw(1e-3), draw(0.1), draw(1e-3), draw(0.1), draw(10), draw(150), draw(20), std::abs(draw(5))};
    if (k == 0) in[1] = 0;
    double mine[4], theirs[4], frozen[4], z[1];
    c.rates(c.params, in[7], in, in + 4, mine);
    compiled.rate(in, theirs);
    events(c.params, in[7], in, in + 4, z);
    EXPECT_EQ(z[0], in[1]);
    const double sign[1] = {in[1] > 0 ? 1.0 : in[1] < 0 ? -1.0 : 0.0};
    between(c.params, in[7], in, in + 4, sign, frozen);
    for (int i = 0; i < 4; ++i) {
      EXPECT_NEAR(mine[i], theirs[i], 1e-12 * (1 + std::abs(theirs[i])));
      EXPECT_NEAR(mine[i], frozen[i], 1e-12 * (1 + std::abs(theirs[i])));
    }
  }
}

TEST(ModelSourceExport, MapGivesTheNextState) {
  const testing::TemporaryFolder folder;
  IdentifiedModel m;
  m.method = "map";
  m.states = {"a", "b"};
  m.inputs = {"u1"};
  const auto term = [](const char* function, double value) {
    return EquationTerm{function, {value, 0, value, value}, ""};
  };
  m.equations = {{"a[k+1]", {term("b", 1)}}, {"b[k+1]", {term("a", -0.5), term("b*a^2", 0.1), term("u1", 0.3)}}};
  const testing::SharedLibrary library(build(folder, m));
  const CompiledC c(library);
  double x[2] = {0.2, -0.4};
  const double u[1] = {2};
  c.step(c.params, 0, x, u, 0);
  EXPECT_EQ(x[0], -0.4);
  EXPECT_NEAR(x[1], -0.1 - 0.1 * 0.4 * 0.04 + 0.6, 1e-15);
}

TEST(ModelSystem, RefusesNamesThatAreNoIdentifiers) {
  IdentifiedModel m = model_equations();
  m.states.push_back("X2'");
  EXPECT_THROW(model_system(m), Error);
}

}  // namespace
}  // namespace whirl::deploy
