#include "whirl/deploy/fmu.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>
#include <sstream>

#include "fmu_fixture.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

INSTANTIATE_TEST_SUITE_P(Versions, FmuExport, ::testing::Values(2, 3),
                         [](const auto& v) { return fmt::format("Fmi{}", v.param); });

/// Inputs of a rotor that runs down in front of sensors.
Measurement reading(int k) {
  const double t = 1e-3 * k, omega = 120 - 6 * t;
  Measurement m;
  m.beta = 120 * t - 3 * t * t;
  m.omega = omega;
  m.omega_dot = -6;
  const double a = 2e-4 + 1e-3 / (1 + std::pow((omega - 75) / 4, 2));
  m.x = a * std::cos(m.beta - 1) + 1e-6 * std::sin(377 * t);
  m.y = a * std::sin(m.beta - 1);
  m.valid = k % 97 != 0;
  return m;
}

TEST_P(FmuExport, ControllerEqualsTheLibraryStepByStep) {
  const ControllerDesign design =
      GetParam() == 2 ? testing::design_of("tsmc", "kfe") : testing::design_of("sta", "eso");
  const Importer fmu = import(design);
  void* const c = fmu.instantiate(false, fmu.token);
  ASSERT_NE(c, nullptr);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  control::Controller controller = control::make_controller(design);
  double size = 0, error = 0;
  for (int k = 0; k < 14000; ++k) {
    const Measurement m = reading(k);
    const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
    const char* names[] = {"x", "y", "beta", "omega", "omega_dot"};
    for (int i = 0; i < 5; ++i) ASSERT_EQ(fmu.set(c, names[i], in[i]), 0);
    fmu.set_boolean(c, "valid", m.valid);
    ASSERT_EQ(fmu.step(c, 1e-3 * k, 1e-3), 0);
    const auto out = controller.step(m);
    ASSERT_TRUE(out);
    size = std::max({size, std::abs(out->ux), std::abs(out->uy)});
    error = std::max({error, std::abs(fmu.get(c, "ux") - out->ux), std::abs(fmu.get(c, "uy") - out->uy)});
    EXPECT_EQ(fmu.get_boolean(c, "held"), !m.valid);
  }
  EXPECT_GT(size, 1);
  EXPECT_LE(error, 1e-12 * size);
  fmu.free(c);
}

TEST_P(FmuExport, ControllerRefusesWrongStepsOrdersAndParameters) {
  const Importer fmu = import(testing::design_of("tsmc", "kfe"));
  EXPECT_EQ(fmu.instantiate(false, "{wrong}"), nullptr);
  EXPECT_EQ(fmu.instantiate(true, fmu.token), nullptr);
  void* const c = fmu.instantiate(false, fmu.token);
  EXPECT_NE(fmu.step(c, 0, 1e-3), 0) << "before the initialization";
  EXPECT_EQ(fmu.set(c, "surface_gain", -1), 0);
  EXPECT_EQ(fmu.enter_initialization(c, 0), 0);
  EXPECT_NE(fmu.call("ExitInitializationMode", c), 0) << "a gain out of range";
  EXPECT_EQ(fmu.call("Reset", c), 0);
  EXPECT_EQ(fmu.get(c, "surface_gain"), 60);
  EXPECT_EQ(fmu.enter_initialization(c, 0), 0);
  EXPECT_EQ(fmu.call("ExitInitializationMode", c), 0);
  EXPECT_NE(fmu.step(c, 0, 0.7e-3), 0) << "no multiple of the sample time";
  EXPECT_EQ(fmu.step(c, 0, 2e-3), 0);
  EXPECT_NE(fmu.set(c, "sample_time", 2e-3), 0) << "fixed";
  EXPECT_NE(fmu.set(c, "ux", 1), 0) << "an output";
  EXPECT_EQ(fmu.set(c, "surface_gain", 80), 0) << "tunable";
  EXPECT_EQ(fmu.step(c, 2e-3, 1e-3), 0);
  EXPECT_EQ(fmu.set(c, "x", NAN), 0);
  EXPECT_EQ(fmu.step(c, 3e-3, 1e-3), 0);
  EXPECT_TRUE(fmu.get_boolean(c, "held"));
  EXPECT_EQ(fmu.call("Terminate", c), 0);
  for (const char* name : {"x", "surface_gain"}) EXPECT_NE(fmu.set(c, name, 80), 0) << name << " after the end";
  fmu.free(c);
}

TEST_P(FmuExport, WhatIsNoNumberIsRefusedAndLeavesTheStateAsItWas) {
  {
    const Importer controller = import(testing::design_of("tsmc", "kfe"));
    void* const c = controller.instantiate(false, controller.token);
    EXPECT_NE(controller.set(c, "surface_gain", NAN), 0) << "parameter";
    const unsigned x = controller.reference.at("x"), nothing = 1000000;
    EXPECT_EQ(controller.set(c, {x, x + 1}, {0, 0}), 0);
    EXPECT_NE(controller.set(c, {x, nothing}, {0, 0}), 0) << "the second is no variable";
    EXPECT_NE(controller.set(c, {nothing, x}, {0, 0}), 0);
    EXPECT_NE(controller.enter_initialization(c, NAN), 0) << "start time";
    ASSERT_EQ(controller.enter_initialization(c, 0), 0);
    ASSERT_EQ(controller.call("ExitInitializationMode", c), 0);
    for (const double odd : {static_cast<double>(NAN), static_cast<double>(INFINITY)}) {
      for (const char* name : {"beta", "omega", "omega_dot"}) {
        controller.set(c, name, odd);
        EXPECT_NE(controller.step(c, 0, 1e-3), 0) << name;
        controller.set(c, name, 0);
      }
      EXPECT_NE(controller.step(c, odd, 1e-3), 0) << "time";
      EXPECT_NE(controller.step(c, 0, odd), 0) << "step";
    }
    EXPECT_EQ(controller.set(c, "omega", 1e200), 0);
    EXPECT_NE(controller.step(c, 0, 1e-3), 0) << "no finite force follows";
    EXPECT_EQ(controller.get(c, "ux"), 0);
    EXPECT_EQ(controller.set(c, "omega", 10), 0);
    EXPECT_EQ(controller.step(c, 0, 1e-3), 0) << "and goes on";
    EXPECT_TRUE(std::isfinite(controller.get(c, "ux")));
    controller.free(c);
  }

  const Importer plant = import(rotor_model());
  void* const p = plant.instantiate(false, plant.token);
  EXPECT_NE(plant.set(p, "k1", NAN), 0);
  EXPECT_NE(plant.set(p, "k1", INFINITY), 0);
  ASSERT_EQ(plant.enter_initialization(p, 0), 0);
  ASSERT_EQ(plant.call("ExitInitializationMode", p), 0);
  plant.set(p, "omega", NAN);
  EXPECT_NE(plant.step(p, 0, 1e-3), 0);
  plant.set(p, "omega", 0);
  EXPECT_NE(plant.step(p, NAN, 1e-3), 0);
  EXPECT_NE(plant.step(p, 0, NAN), 0);
  EXPECT_EQ(plant.step(p, 0, 1e-3), 0);
  EXPECT_TRUE(std::isfinite(plant.get(p, "x")));
  plant.free(p);
}

TEST_P(FmuExport, BinaryLoadsOnOldSystems) {
  for (const auto& [law, estimator] :
       {std::pair{"tsmc", "kfe"}, {"tsmc_implicit", "kfo"}, {"asmc", "lpf"}, {"mpc", "eso"}}) {
    const Importer fmu = import(testing::design_of(law, estimator));
    const auto symbols = testing::shell(folder.path(), "objdump -T unpacked/binaries/*/unit.so");
    ASSERT_EQ(symbols.exit_code, 0);
    std::istringstream text(symbols.text);
    int seen = 0;
    for (std::string word; text >> word;) {
      const std::size_t at = word.find("GLIBC_2.");
      if (at == std::string::npos) continue;
      ++seen;
      EXPECT_LE(std::stoi(word.substr(at + 8)), 17) << law << ": " << word;
    }
    EXPECT_GT(seen, 0);
  }
}

TEST_P(FmuExport, OtherPlatformsAreInTheSameFileWhereTheirCompilersAre) {
  FmuOptions options;
  options.all_platforms = true;
  const Importer fmu = import(testing::design_of("tsmc", "kfe"), options);
  const bool windows = testing::has_program("x86_64-w64-mingw32-gcc"),
             arm = testing::has_program("aarch64-linux-gnu-gcc");
  const auto has = [&](const std::string& name) {
    return std::find(fmu.names.begin(), fmu.names.end(), "binaries/" + name) != fmu.names.end();
  };
  EXPECT_EQ(has(fmu.three ? "x86_64-windows/unit.dll" : "win64/unit.dll"), windows);
  EXPECT_EQ(has("aarch64-linux/unit.so"), arm);
  if (windows) {
    const auto dll = testing::shell(folder.path(), "x86_64-w64-mingw32-objdump -p unpacked/binaries/*/unit.dll");
    EXPECT_NE(dll.text.find(fmu.three ? "fmi3DoStep" : "fmi2DoStep"), std::string::npos);
    std::istringstream lines(dll.text);
    for (std::string line; std::getline(lines, line);) {
      const std::size_t at = line.find("DLL Name: ");
      if (at == std::string::npos) continue;
      const std::string needed = line.substr(at + 10);
      EXPECT_TRUE(needed == "KERNEL32.dll" || needed == "msvcrt.dll") << needed;
    }
  }
  if (!arm || !testing::has_program("qemu-aarch64")) return;
  folder.write(
      "load.c",
      "#include <dlfcn.h>\n#include <stdio.h>\nint main(int n, char **v) {\n  void *l = dlopen(v[1], RTLD_NOW);\n"
      "  const char *(*version)(void) = l ? (const char *(*)(void))dlsym(l, v[2]) : 0;\n  (void)n;\n"
      "  if (!version) { puts(dlerror()); return 1; }\n  puts(version());\n  return 0;\n}\n");
  const auto loaded = testing::shell(
      folder.path(),
      fmt::format("aarch64-linux-gnu-gcc -o load load.c && qemu-aarch64 -L /usr/aarch64-linux-gnu ./load "
                  "unpacked/binaries/aarch64-linux/unit.so fmi{}GetVersion",
                  GetParam()));
  EXPECT_EQ(loaded.exit_code, 0) << loaded.text;
  EXPECT_NE(loaded.text.find(fmu.three ? "3.0" : "2.0"), std::string::npos) << loaded.text;
  const auto symbols = testing::shell(folder.path(), "objdump -T unpacked/binaries/aarch64-linux/unit.so");
  for (const char* young : {"GLIBC_2.2", "GLIBC_2.3"})
    EXPECT_EQ(symbols.text.find(young), std::string::npos) << symbols.text;
}

TEST_P(FmuExport, StatesAreSavedAndInstancesShareNothing) {
  const Importer fmu = import(testing::design_of("sta", "kfe"));
  const auto make = [&] {
    void* const c = fmu.instantiate(false, fmu.token);
    fmu.enter_initialization(c, 0);
    fmu.call("ExitInitializationMode", c);
    return c;
  };
  const auto run = [&](void* c, int from, int to) {
    double u = 0;
    for (int k = from; k < to; ++k) {
      const Measurement m = reading(k);
      fmu.set(c, "x", m.x), fmu.set(c, "y", m.y), fmu.set(c, "beta", m.beta), fmu.set(c, "omega", m.omega);
      EXPECT_EQ(fmu.step(c, 1e-3 * k, 1e-3), 0);
      u = fmu.get(c, "ux");
    }
    return u;
  };
  void *const a = make(), *const b = make();
  const double reference = run(a, 0, 200);
  run(b, 0, 100);
  void *state = nullptr, *copy = nullptr;
  const std::string s = fmu.three ? "FMUState" : "FMUstate";
  EXPECT_EQ(fmu.function<int(void*, void**)>("Get" + s)(b, &state), 0);
  std::size_t size = 0;
  EXPECT_EQ(fmu.function<int(void*, void*, std::size_t*)>("Serialized" + s + "Size")(b, state, &size), 0);
  std::vector<char> bytes(size);
  EXPECT_EQ(fmu.function<int(void*, void*, char*, std::size_t)>("Serialize" + s)(b, state, bytes.data(), size), 0);
  run(b, 5000, 5100);
  EXPECT_EQ(fmu.function<int(void*, const char*, std::size_t, void**)>((fmu.three ? "Deserialize" : "DeSerialize") + s)(
                b, bytes.data(), size, &copy),
            0);
  EXPECT_EQ(fmu.function<int(void*, void*)>("Set" + s)(b, copy), 0);
  EXPECT_EQ(run(b, 100, 200), reference);
  for (void** p : {&state, &copy}) EXPECT_EQ(fmu.function<int(void*, void**)>("Free" + s)(b, p), 0);
  fmu.free(a);
  fmu.free(b);
}

TEST_P(FmuExport, PlantInCoSimulationEqualsTheLibraryStepByStep) {
  const IdentifiedModel model = rotor_model();
  const Importer fmu = import(model);
  void* const c = fmu.instantiate(false, fmu.token);
  ASSERT_NE(c, nullptr);
  EXPECT_EQ(fmu.set(c, "x", 1e-4), 0);
  EXPECT_EQ(fmu.set(c, "vy", 0.01), 0);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  EXPECT_NE(fmu.set(c, "x", 1), 0) << "a state during the run";
  std::array<double, 4> x{1e-4, 0, 0, 0.01};
  const char* states[] = {"x", "vx", "y", "vy"};
  double size = 0, error = 0;
  for (int k = 0; k < 14000; ++k) {
    const double t = 1e-3 * k;
    const auto u = plant_inputs(t, t);
    for (int i = 0; i < 5; ++i) ASSERT_EQ(fmu.set(c, kInputs[i], u[static_cast<std::size_t>(i)]), 0);
    ASSERT_EQ(fmu.step(c, t, 1e-3), 0);
    x = rk4([&](double at, const auto& s) { return library_rate(*model.rotor, s, plant_inputs(at, t).data()); }, t, x,
            1e-3);
    for (std::size_t i = 0; i < 4; ++i) {
      size = std::max(size, std::abs(x[i]));
      error = std::max(error, std::abs(fmu.get(c, states[i]) - x[i]));
    }
    EXPECT_NEAR(fmu.get(c, "x_sensor"), fmu.get(c, "x") + 3e-6, 1e-18);
  }
  EXPECT_GT(size, 0.05);
  EXPECT_LE(error, 1e-12 * size);
  fmu.set(c, "ux", NAN);
  const double before = fmu.get(c, "x");
  EXPECT_NE(fmu.step(c, 14, 1e-3), 0);
  EXPECT_EQ(fmu.get(c, "x"), before);
  fmu.free(c);
}

TEST_P(FmuExport, PlantInModelExchangeEqualsTheLibraryStepByStep) {
  const IdentifiedModel model = rotor_model();
  const Importer fmu = import(model);
  void* const c = fmu.exchanging();
  std::array<double, 4> mine{1e-4, 0, 0, 0.01}, theirs = mine;
  double size = 0, error = 0;
  for (int k = 0; k < 2000; ++k) {
    const double t = 1e-3 * k;
    const auto rate = [&](double at, const std::array<double, 4>& s) {
      const auto u = plant_inputs(at, t);
      fmu.set_time(c, at);
      for (int i = 0; i < 5; ++i) fmu.set(c, kInputs[i], u[static_cast<std::size_t>(i)]);
      fmu.set_states(c, {s.begin(), s.end()});
      const std::vector<double> dx = fmu.rates(c, 4);
      return std::array<double, 4>{dx[0], dx[1], dx[2], dx[3]};
    };
    mine = rk4(rate, t, mine, 1e-3);
    theirs = rk4([&](double at, const auto& s) { return library_rate(*model.rotor, s, plant_inputs(at, t).data()); }, t,
                 theirs, 1e-3);
    for (std::size_t i = 0; i < 4; ++i) {
      size = std::max(size, std::abs(theirs[i]));
      error = std::max(error, std::abs(mine[i] - theirs[i]));
    }
  }
  EXPECT_LE(error, 1e-12 * size);
  EXPECT_GT(size, 0.01);
  fmu.free(c);
}

// An importer may set the time before the states or after them.
TEST_P(FmuExport, RatesAreThoseOfTheLastStatesAlsoWhenTheTimeComesAfterThem) {
  const Importer fmu = import(rotor_model());
  void* const c = fmu.exchanging();
  fmu.set_states(c, {1e-4, 0, 0, 0.01});
  const double first = fmu.rates(c, 4)[1];
  fmu.set_states(c, {3e-4, 0, 0, 0.01});
  fmu.set_time(c, 0.1);
  const double read = fmu.get(c, "der(vx)");
  EXPECT_EQ(read, fmu.rates(c, 4)[1]);
  EXPECT_NE(read, first);
  fmu.free(c);
}

// An oscillator with Coulomb friction: every half swing is 2 f/k shorter, and it comes to rest inside |x| <= f/k.
TEST_P(FmuExport, CoulombFrictionIsAStateEvent) {
  const Importer fmu = import(friction_oscillator());
  void* const c = fmu.instantiate(true, fmu.token);
  ASSERT_NE(c, nullptr);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  std::vector<double> x{0.0525, 0};  // 5.25 units of 2 f/k = 0.01 m
  fmu.set(c, "X1", x[0]);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  const auto enter = [&] {
    ASSERT_EQ(fmu.new_discrete_states(c), 0);
    ASSERT_EQ(fmu.call("EnterContinuousTimeMode", c), 0);
  };
  enter();
  // What lies behind the states that are counted is not looked at.
  std::vector<double> more{x[0], x[1], NAN};
  EXPECT_EQ(fmu.function<int(void*, const double*, std::size_t)>("SetContinuousStates")(c, more.data(), 2), 0);
  EXPECT_EQ(fmu.function<int(void*, double*, std::size_t)>(fmu.three ? "GetContinuousStateDerivatives"
                                                                     : "GetDerivatives")(c, more.data(), 2),
            0);
  double t = 0;
  const auto advance = [&](const std::vector<double>& from, double h) {
    const auto rate = [&](const std::vector<double>& s) {
      fmu.set_states(c, s);
      return fmu.rates(c, 2);
    };
    const auto along = [&](const std::vector<double>& k, double s) {
      return std::vector<double>{from[0] + s * k[0], from[1] + s * k[1]};
    };
    const auto k1 = rate(from), k2 = rate(along(k1, h / 2)), k3 = rate(along(k2, h / 2)), k4 = rate(along(k3, h));
    return std::vector<double>{from[0] + h / 6 * (k1[0] + 2 * k2[0] + 2 * k3[0] + k4[0]),
                               from[1] + h / 6 * (k1[1] + 2 * k2[1] + 2 * k3[1] + k4[1])};
  };
  const auto indicator = [&](const std::vector<double>& s) {
    fmu.set_states(c, s);
    const double value = fmu.vector(c, "GetEventIndicators", 1)[0];
    if (fmu.reference.contains("event_1")) {
      EXPECT_EQ(fmu.get(c, "event_1"), value);
    }
    return value;
  };
  std::vector<double> turns;
  while (t < 1.2 && turns.size() < 5) {
    const double before = indicator(x);
    std::vector<double> next = advance(x, 1e-3);
    double h = 1e-3;
    const bool event = (indicator(next) > 0) != (before > 0);
    if (event) {
      double low = 0, high = h;
      for (int i = 0; i < 60; ++i) {
        h = 0.5 * (low + high);
        next = advance(x, h);
        ((indicator(next) > 0) != (before > 0) ? high : low) = h;
      }
      h = high;
      next = advance(x, h);
    }
    x = next;
    t += h;
    fmu.set_time(c, t);
    fmu.set_states(c, x);
    if (event) {
      if (t > 0.01) turns.push_back(std::abs(x[0]));
      ASSERT_EQ(fmu.call("EnterEventMode", c), 0);
      enter();
      // At rest at a turning point the sign is 0: give it the side it leaves to.
      x = advance(x, 1e-6);
      t += 1e-6;
      fmu.set_states(c, x);
      ASSERT_EQ(fmu.call("EnterEventMode", c), 0);
      enter();
    }
  }
  ASSERT_EQ(turns.size(), 5u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(turns[i], 0.0525 - 0.01 * static_cast<double>(i + 1), 2e-7) << i;
  EXPECT_LE(std::abs(x[0]), 2.0 / 400 + 1e-9);
  fmu.free(c);
}

}  // namespace
}  // namespace whirl::deploy
