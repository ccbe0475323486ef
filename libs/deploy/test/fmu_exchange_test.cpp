// What an importer builds on: sizes, dependencies, derivatives, its own integrator, its order of steps.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <functional>
#include <set>
#include <sstream>

#include "fmu_models.hpp"
#include "importer.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/deploy/fmu.hpp"

namespace whirl::deploy {
namespace {

using testing::Importer;

class FmuExchangeExport : public ::testing::TestWithParam<int> {
 protected:
  template <class T>
  Importer import(const T& value, const std::string& name = "unit") {
    FmuOptions options;
    options.version = GetParam();
    options.code.prefix = name;
    const auto path = folder.path() / (name + ".fmu");
    pack_fmu(fmu_files(value, options), options, path);
    return {path, folder.path() / name};
  }
  testing::TemporaryFolder folder;
};
INSTANTIATE_TEST_SUITE_P(Versions, FmuExchangeExport, ::testing::Values(2, 3),
                         [](const auto& v) { return fmt::format("Fmi{}", v.param); });

/// Names of the variables of one kind, in the order of the file.
std::vector<std::string> names_of(const Importer& fmu, const std::function<bool(const pugi::xml_node&)>& is) {
  std::vector<std::string> out;
  for (const pugi::xml_node v : fmu.variables) {
    if (is(v)) out.emplace_back(v.attribute("name").value());
  }
  return out;
}
std::vector<std::string> by_causality(const Importer& fmu, const std::string& causality) {
  return names_of(fmu, [&](const auto& v) { return v.attribute("causality").value() == causality; });
}
std::vector<std::string> states_of(const Importer& fmu) {
  return names_of(fmu, [](const auto& v) { return std::string(v.attribute("initial").value()) == "exact"; });
}

/// Each unknown of ModelStructure with what it is said to depend on.
std::map<std::string, std::set<std::string>> dependencies(const Importer& fmu, const char* list2, const char* list3) {
  std::map<std::string, std::set<std::string>> out;
  const pugi::xml_node structure = fmu.root.child("ModelStructure");
  const auto name = [&](std::size_t i) { return std::string(fmu.variables.at(i).attribute("name").value()); };
  const std::size_t shift = fmu.three ? 0 : 1;
  for (const pugi::xml_node u : fmu.three ? structure.children(list3) : structure.child(list2).children("Unknown")) {
    EXPECT_TRUE(u.attribute("dependencies"));
    std::istringstream in(u.attribute("dependencies").value());
    auto& known = out[name(u.attribute(fmu.three ? "valueReference" : "index").as_uint() - shift)];
    for (std::size_t i; in >> i;) known.insert(name(i - shift));
  }
  return out;
}

TEST_P(FmuExchangeExport, DerivativesAndDependenciesAreThoseOfTheEquations) {
  for (const IdentifiedModel& model : {rotor_model(), friction_oscillator()}) {
    const Importer fmu = import(model);
    void* const c = fmu.exchanging();
    const std::vector<std::string> states = states_of(fmu), inputs = by_causality(fmu, "input"),
                                   outputs = by_causality(fmu, "output");
    std::vector<std::string> knowns = states, unknowns;
    knowns.insert(knowns.end(), inputs.begin(), inputs.end());
    for (const std::string& s : states) unknowns.push_back("der(" + s + ")");
    unknowns.insert(unknowns.end(), outputs.begin(), outputs.end());
    auto said = dependencies(fmu, "Derivatives", "ContinuousStateDerivative");
    said.merge(dependencies(fmu, "Outputs", "Output"));
    EXPECT_EQ(said.size(), unknowns.size());

    std::map<std::string, double> point;
    double seed = 0.3;
    for (const std::string& k : knowns) point[k] = (seed = std::fmod(seed * 7.3 + 0.41, 1.0)) * 1e-2 + 1e-3;
    const auto values = [&](const std::map<std::string, double>& at) {
      std::vector<double> x, out;
      for (const std::string& s : states) x.push_back(at.at(s));
      fmu.set_states(c, x);
      for (const std::string& u : inputs) EXPECT_EQ(fmu.set(c, u, at.at(u)), 0);
      for (const std::string& u : unknowns) out.push_back(fmu.get(c, u));
      return out;
    };
    for (const std::string& k : knowns) {
      const double step = 1e-5;
      auto low = point, high = point;
      low[k] -= step, high[k] += step;
      const std::vector<double> below = values(low), above = values(high);
      values(point);
      const std::vector<double> exact = fmu.directional(c, unknowns, {k}, {1.0});
      ASSERT_EQ(exact.size(), unknowns.size()) << k;
      for (std::size_t i = 0; i < unknowns.size(); ++i) {
        const double slope = (above[i] - below[i]) / (2 * step);
        EXPECT_NEAR(exact[i], slope, 1e-5 * std::max(1.0, std::abs(slope))) << unknowns[i] << " along " << k;
        // A coefficient that is zero now may be set.
        EXPECT_TRUE(exact[i] == 0 || said[unknowns[i]].contains(k)) << unknowns[i] << " and " << k;
      }
    }
    EXPECT_EQ(said["der(" + states[0] + ")"], std::set<std::string>{states[1]});
    for (const std::string& output : outputs) EXPECT_LE(said[output].size(), 1u) << output;
    // Several at once add up; what is no state and no input is refused.
    const auto a = fmu.directional(c, unknowns, {states[0]}, {2.0}),
               b = fmu.directional(c, unknowns, {states[1]}, {-3.0}),
               both = fmu.directional(c, unknowns, {states[0], states[1]}, {2.0, -3.0});
    for (std::size_t i = 0; i < unknowns.size(); ++i)
      EXPECT_NEAR(both[i], a[i] + b[i], 1e-9 * std::max(1.0, std::abs(both[i])));
    EXPECT_TRUE(fmu.directional(c, unknowns, {"inner_step"}, {1.0}).empty());
    EXPECT_TRUE(fmu.directional(c, {states[0]}, {states[0]}, {1.0}).empty());
    fmu.free(c);
    std::filesystem::remove_all(folder.path() / "unit");
  }
  const Importer controller = import(testing::design_of("tsmc", "kfe"));
  for (const auto& [name, known] : dependencies(controller, "Outputs", "Output")) EXPECT_TRUE(known.empty()) << name;
}

/// Dormand and Prince 5(4) with the step an importer would take. Largest displacement and the displacement at each of
/// 1400 times.
struct Integrated {
  std::vector<std::array<double, 2>> z;
  double peak = 0;
  long evaluations = 0;
};
Integrated integrate(const Importer& fmu, double tolerance, const std::vector<double>& nominal) {
  void* const c = fmu.exchanging();
  Integrated out;
  const auto rate = [&](double t, const std::vector<double>& x) {
    ++out.evaluations;
    fmu.set_time(c, t);
    const auto u = plant_inputs(t, 0);
    for (int i = 0; i < 3; ++i) fmu.set(c, kInputs[i], u[static_cast<std::size_t>(i)]);
    fmu.set_states(c, x);
    return fmu.rates(c, 4);
  };
  constexpr double b[6][6] = {{1.0 / 5},
                              {3.0 / 40, 9.0 / 40},
                              {44.0 / 45, -56.0 / 15, 32.0 / 9},
                              {19372.0 / 6561, -25360.0 / 2187, 64448.0 / 6561, -212.0 / 729},
                              {9017.0 / 3168, -355.0 / 33, 46732.0 / 5247, 49.0 / 176, -5103.0 / 18656},
                              {35.0 / 384, 0, 500.0 / 1113, 125.0 / 192, -2187.0 / 6784, 11.0 / 84}};
  constexpr double at[7] = {0, 0.2, 0.3, 0.8, 8.0 / 9, 1, 1};
  constexpr double e[7] = {71.0 / 57600, 0, -71.0 / 16695, 71.0 / 1920, -17253.0 / 339200, 22.0 / 525, -1.0 / 40};
  std::vector<double> x(4, 0.0);
  double t = 0, h = 1e-4;
  for (int sample = 1; sample <= 1400; ++sample) {
    const double end = 0.01 * sample;
    while (t < end - 1e-12) {
      const double step = std::min(h, end - t);
      std::vector<double> k[7], y = x;
      for (int stage = 0; stage < 7; ++stage) {
        y = x;
        for (int j = 0; j < stage; ++j) {
          for (std::size_t i = 0; i < 4; ++i) y[i] += step * b[stage - 1][j] * k[j][i];
        }
        k[stage] = rate(t + at[stage] * step, y);
      }
      double error = 0;
      for (std::size_t i = 0; i < 4; ++i) {
        double d = 0;
        for (int j = 0; j < 7; ++j) d += step * e[j] * k[j][i];
        error = std::max(error, std::abs(d) / (tolerance * (nominal[i] + std::max(std::abs(x[i]), std::abs(y[i])))));
      }
      if (error <= 1) {
        x = y;  // the seventh stage stands at the end of the step
        t += step;
      }
      h = step * std::clamp(0.9 * std::pow(std::max(error, 1e-10), -0.2), 0.2, 5.0);
    }
    out.z.push_back({x[0], x[2]});
    out.peak = std::max(out.peak, std::hypot(x[0], x[2]));
  }
  fmu.free(c);
  return out;
}

double difference(const Integrated& a, const Integrated& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.z.size(); ++i)
    most = std::max(most, std::hypot(a.z[i][0] - b.z[i][0], a.z[i][1] - b.z[i][1]));
  return most / b.peak;
}

TEST_P(FmuExchangeExport, AnImportersDefaultToleranceIsEnoughInModelExchange) {
  const Importer fmu = import(rotor_model());
  void* const c = fmu.exchanging();
  const std::vector<double> nominal = fmu.vector(c, "GetNominalsOfContinuousStates", 4);
  fmu.free(c);
  const std::vector<std::string> states = states_of(fmu);
  for (std::size_t i = 0; i < 4; ++i) {
    const pugi::xml_node v = fmu.variables[fmu.reference.at(states[i])];
    EXPECT_EQ((fmu.three ? v : v.first_child()).attribute("nominal").as_double(), nominal[i]);
    EXPECT_LT(nominal[i], 0.2);
  }
  const Integrated exact = integrate(fmu, 1e-10, nominal), usual = integrate(fmu, 1e-4, nominal),
                   unit = integrate(fmu, 1e-4, {1, 1, 1, 1});
  EXPECT_GT(exact.peak, 3e-3);
  EXPECT_LE(difference(usual, exact), 0.01);
  EXPECT_GT(difference(unit, exact), 5 * difference(usual, exact)) << "the sizes are what makes it so";
  fmt::print("peak {:.2f} mm; at 1e-4 {:.3f} % of it off ({} evaluations), with nominals of 1 {:.1f} %\n",
             1e3 * exact.peak, 100 * difference(usual, exact), usual.evaluations, 100 * difference(unit, exact));
}

/// Closed loop of both FMUs beside the library: `late` is the number of sample times by which the force is later.
struct Loop {
  double peak = 0, error = 0;
};
Loop closed_loop(const Importer& controller, const Importer& plant, const ControllerDesign& design, bool jacobi) {
  void *const c = controller.instantiate(false, controller.token), *const p = plant.instantiate(false, plant.token);
  for (const auto& [fmu, it] : {std::pair{&controller, c}, {&plant, p}}) {
    EXPECT_EQ(fmu->enter_initialization(it, 0), 0);
    EXPECT_EQ(fmu->call("ExitInitializationMode", it), 0);
  }
  control::Controller mine = control::make_controller(design);
  const RotorModel rotor = *rotor_model().rotor;
  std::array<double, 4> x{};
  std::deque<Command> sent(jacobi ? 1 : 0);
  Loop out;
  for (int k = 0; k < 14000; ++k) {
    const double t = 1e-3 * k;
    const auto angle = plant_inputs(t, t);
    const double ux = controller.get(c, "ux"), uy = controller.get(c, "uy");
    controller.set(c, "x", plant.get(p, "x_sensor")), controller.set(c, "y", plant.get(p, "y_sensor"));
    const char* const names[] = {"beta", "omega", "omega_dot"};
    for (std::size_t i = 0; i < 3; ++i) {
      controller.set(c, names[i], angle[i]);
      plant.set(p, kInputs[i], angle[i]);
    }
    EXPECT_EQ(controller.step(c, t, 1e-3), 0);
    plant.set(p, "ux", jacobi ? ux : controller.get(c, "ux"));
    plant.set(p, "uy", jacobi ? uy : controller.get(c, "uy"));
    EXPECT_EQ(plant.step(p, t, 1e-3), 0);

    Measurement m;
    m.x = x[0] + rotor.offset.real(), m.y = x[2] + rotor.offset.imag();
    m.beta = angle[0], m.omega = angle[1], m.omega_dot = angle[2];
    sent.push_back(*mine.step(m));
    const Command u = sent.front();
    sent.pop_front();
    x = rk4(
        [&](double at, const auto& s) {
          auto in = plant_inputs(at, t);
          in[3] = u.ux, in[4] = u.uy;
          return library_rate(rotor, s, in.data());
        },
        t, x, 1e-3);
    out.error = std::max(out.error, std::hypot(plant.get(p, "x") - x[0], plant.get(p, "y") - x[2]));
    if (k > 500) out.peak = std::max(out.peak, std::hypot(x[0], x[2]));
  }
  controller.free(c);
  plant.free(p);
  return out;
}

TEST_P(FmuExchangeExport, ClosedLoopIsTheLibrarysAndOneSampleLaterUnderJacobi) {
  ControllerDesign design = testing::design_of("tsmc", "kfe");
  design.delay = 0;
  design.parameters = {{"sensor_delay", 0}, {"predict", 1}};
  ControllerDesign later = design;
  later.delay = design.sample_time;
  const Importer plant = import(rotor_model(), "plant");
  const Loop seidel = closed_loop(import(design, "now"), plant, design, false),
             jacobi = closed_loop(import(later, "later"), plant, later, true);
  EXPECT_LE(seidel.error, 1e-9 * seidel.peak);
  EXPECT_LE(jacobi.error, 1e-9 * jacobi.peak);
  EXPECT_LT(seidel.peak, 1e-3);
  EXPECT_LT(jacobi.peak, 1.5 * seidel.peak) << "designed for it, the delay costs little";
  fmt::print(
      "Gauss-Seidel: peak {:.4f} mm, {:.1g} of it off; Jacobi with one sample more of delay: {:.4f} mm, {:.1g}\n",
      1e3 * seidel.peak, seidel.error / seidel.peak, 1e3 * jacobi.peak, jacobi.error / jacobi.peak);
}

}  // namespace
}  // namespace whirl::deploy
