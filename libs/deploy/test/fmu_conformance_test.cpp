// Every function of FMI 2.0 and 3.0 in every state of an instance: what the standard allows is done, the rest is
// refused and changes nothing.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <map>
#include <sstream>

#include "fmu_models.hpp"
#include "importer.hpp"
#include "whirl/deploy/fmu.hpp"

namespace whirl::deploy {
namespace {

using testing::Importer;

/// I instantiated, N initialising, E event mode, C continuous time, S stepping, T terminated.
void go_to(const Importer& fmu, void* c, char state) {
  if (state == 'I') return;
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  if (state == 'N') return;
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  if (state == 'C') {
    ASSERT_EQ(fmu.new_discrete_states(c), 0);
    ASSERT_EQ(fmu.call("EnterContinuousTimeMode", c), 0);
  }
  if (state == 'T') {
    ASSERT_EQ(fmu.call("Terminate", c), 0);
  }
}

/// An instance as bytes; none when it cannot be saved.
std::string bytes_of(const Importer& fmu, void* c) {
  const std::string s = fmu.three ? "FMUState" : "FMUstate";
  void* saved = nullptr;
  std::size_t size = 0;
  EXPECT_EQ(fmu.function<int(void*, void**)>("Get" + s)(c, &saved), 0);
  EXPECT_EQ(fmu.function<int(void*, void*, std::size_t*)>("Serialized" + s + "Size")(c, saved, &size), 0);
  std::string bytes(size, '\0');
  EXPECT_EQ(fmu.function<int(void*, void*, char*, std::size_t)>("Serialize" + s)(c, saved, bytes.data(), size), 0);
  EXPECT_EQ(fmu.function<int(void*, void**)>("Free" + s)(c, &saved), 0);
  return bytes;
}

struct Row {
  std::string allowed;  ///< states in which it is done
  std::function<int(const Importer&, void*)> call;
};
using Table = std::map<std::string, Row>;
enum class Kind { controller, plant_steps, plant_exchange };

int one_real(const Importer& fmu, void* c, const char* what, const std::string& name, double value) {
  const unsigned r = fmu.reference.at(name);
  return fmu.three ? fmu.function<int(void*, const unsigned*, std::size_t, double*, std::size_t)>(
                         std::string(what) + "Float64")(c, &r, 1, &value, 1)
                   : fmu.function<int(void*, const unsigned*, std::size_t, double*)>(std::string(what) + "Real")(
                         c, &r, 1, &value);
}
/// A call with references that no variable has; enough for every function that takes a list of them.
int unknown(const Importer& fmu, void* c, const std::string& name) {
  const unsigned r = 100000;
  long long place[8] = {0};
  return fmu.function<int(void*, const unsigned*, std::size_t, void*, std::size_t)>(name)(c, &r, 1, place, 1);
}
/// A call of a function that is refused whatever it is given.
int bare(const Importer& fmu, void* c, const std::string& name) {
  return fmu.function<int(void*, void*, std::size_t, void*, std::size_t, void*, std::size_t, void*, std::size_t)>(name)(
      c, nullptr, 0, nullptr, 0, nullptr, 0, nullptr, 0);
}

void add_common(Table& t, Kind kind) {
  const bool controller = kind == Kind::controller, exchange = kind == Kind::plant_exchange;
  const auto real = [&](const char* row, const char* what, const char* name, const char* allowed, double value = 0.01) {
    t[row] = {allowed, [=](const Importer& f, void* c) { return one_real(f, c, what, name, value); }};
  };
  const auto plain = [&](const char* name, const char* allowed) {
    t[name] = {allowed, [=](const Importer& f, void* c) { return f.call(name, c); }};
  };
  real("get output", "Get", controller ? "ux" : "x_sensor", "INECST");
  real("set input", "Set", controller ? "x" : "ux", "INECS");
  real("set tunable", "Set", controller ? "surface_gain" : "k1", "INES", 70);
  real("set fixed", "Set", controller ? "sample_time" : "inner_step", "IN", 1e-3);
  real("set output", "Set", controller ? "ux" : "x_sensor", "");
  real("set parameter to no number", "Set", controller ? "surface_gain" : "k1", "", NAN);
  if (!controller) real("set start", "Set", "vx", "IN");
  plain("ExitInitializationMode", "N");
  plain("Terminate", "ECS");
  plain("Reset", "INECST");
  t["EnterInitializationMode"] = {"I", [](const Importer& f, void* c) { return f.enter_initialization(c, 0); }};
  t["enter at no time"] = {"", [](const Importer& f, void* c) { return f.enter_initialization(c, NAN); }};
  t["SetDebugLogging"] = {"INECST", [](const Importer& f, void* c) {
                            return f.function<int(void*, int, std::size_t, void*)>("SetDebugLogging")(c, 1, 0, nullptr);
                          }};
  t["DoStep"] = {"S", [](const Importer& f, void* c) { return f.step(c, 0, 1e-3); }};
  t["step at no time"] = {"", [](const Importer& f, void* c) { return f.step(c, NAN, 1e-3); }};
  t["step of no size"] = {"", [](const Importer& f, void* c) { return f.step(c, 0, INFINITY); }};
  t["step back"] = {"", [](const Importer& f, void* c) { return f.step(c, -0.5, 1e-3); }};
  t["GetDirectionalDerivative"] = {controller ? "" : "NECST", [=](const Importer& f, void* c) {
                                     const std::vector<double> d =
                                         controller ? f.directional(c, {"ux"}, {"x"}, {1.0})
                                                    : f.directional(c, {"der(vx)"}, {"x", "ux"}, {1.0, 1.0});
                                     return d.empty() ? 3 : 0;
                                   }};
  const char* const inside = exchange ? "NECT" : "";
  if (!controller) {
    plain("EnterEventMode", exchange ? "EC" : "");
    plain("EnterContinuousTimeMode", exchange ? "E" : "");
    t["discrete states"] = {exchange ? "E" : "", [](const Importer& f, void* c) { return f.new_discrete_states(c); }};
    t["CompletedIntegratorStep"] = {exchange ? "C" : "", [](const Importer& f, void* c) {
                                      int a = 0, b = 0;
                                      return f.function<int(void*, int, int*, int*)>("CompletedIntegratorStep")(c, 1,
                                                                                                                &a, &b);
                                    }};
    t["SetTime"] = {exchange ? "EC" : "",
                    [](const Importer& f, void* c) { return f.function<int(void*, double)>("SetTime")(c, 0.1); }};
    t["set no time"] = {"",
                        [](const Importer& f, void* c) { return f.function<int(void*, double)>("SetTime")(c, NAN); }};
    const auto vector = [&](const char* row, const std::string& two, const std::string& three, const char* allowed,
                            std::size_t n, double value) {
      t[row] = {allowed, [=](const Importer& f, void* c) {
                  std::vector<double> x(n, value);
                  return f.function<int(void*, double*, std::size_t)>(f.three ? three : two)(c, x.data(), n);
                }};
    };
    vector("SetContinuousStates", "SetContinuousStates", "SetContinuousStates", exchange ? "EC" : "", 4, 1e-3);
    vector("set states to no number", "SetContinuousStates", "SetContinuousStates", "", 4, NAN);
    vector("set too few states", "SetContinuousStates", "SetContinuousStates", "", 3, 1e-3);
    vector("derivatives", "GetDerivatives", "GetContinuousStateDerivatives", inside, 4, 0);
    vector("GetContinuousStates", "GetContinuousStates", "GetContinuousStates", inside, 4, 0);
    vector("GetNominals", "GetNominalsOfContinuousStates", "GetNominalsOfContinuousStates", inside, 4, 0);
    vector("GetEventIndicators", "GetEventIndicators", "GetEventIndicators", inside, 0, 0);
    vector("indicators there are not", "GetEventIndicators", "GetEventIndicators", "", 1, 0);
  }
}

Table table_of(bool three, Kind kind) {
  const bool controller = kind == Kind::controller;
  Table t;
  add_common(t, kind);
  const auto refused = [&](std::initializer_list<const char*> names, bool with_reference) {
    for (const char* name : names) {
      const std::string row = name;
      t[row] = {"", [=](const Importer& f, void* c) { return with_reference ? unknown(f, c, row) : bare(f, c, row); }};
    }
  };
  t["set valid"] = {controller ? "INS" : "", [=](const Importer& f, void* c) {
                      return controller ? f.set_boolean(c, "valid", true) : unknown(f, c, "SetBoolean");
                    }};
  t["get status"] = {controller ? "INST" : "", [=](const Importer& f, void* c) {
                       if (!controller) return unknown(f, c, f.three ? "GetInt32" : "GetInteger");
                       const unsigned r = f.reference.at("status");
                       int value = 0;
                       return f.function<int(void*, const unsigned*, std::size_t, int*, std::size_t)>(
                           f.three ? "GetInt32" : "GetInteger")(c, &r, 1, &value, 1);
                     }};
  refused({"GetBoolean", "SetBoolean", "GetString", "SetString"}, true);
  if (!three) {
    refused({"GetReal", "SetReal", "GetInteger", "SetInteger"}, true);
    refused({"CancelStep", "GetStatus", "GetIntegerStatus", "GetStringStatus"}, false);
    t["derivatives of inputs"] = {
        "", [](const Importer& f, void* c) {
          const unsigned r = 1;
          const int order = 1;
          const double value = 1;
          return f.function<int(void*, const unsigned*, std::size_t, const int*, const double*)>(
              "SetRealInputDerivatives")(c, &r, 1, &order, &value);
        }};
    t["derivatives of outputs"] = {"", [](const Importer& f, void* c) {
                                     const unsigned r = 1;
                                     const int order = 1;
                                     double value = 1;
                                     return f.function<int(void*, const unsigned*, std::size_t, const int*, double*)>(
                                         "GetRealOutputDerivatives")(c, &r, 1, &order, &value);
                                   }};
    t["last time"] = {"INECST", [](const Importer& f, void* c) {
                        double value = -1;
                        return f.function<int(void*, int, double*)>("GetRealStatus")(c, 2, &value);
                      }};
    t["is terminated"] = {"INECST", [](const Importer& f, void* c) {
                            int value = -1;
                            return f.function<int(void*, int, int*)>("GetBooleanStatus")(c, 3, &value);
                          }};
    t["SetupExperiment"] = {"I", [](const Importer& f, void* c) {
                              return f.function<int(void*, int, double, double, int, double)>("SetupExperiment")(
                                  c, 0, 0, 0, 0, 0);
                            }};
    return t;
  }
  refused({"GetFloat64", "SetFloat64", "GetInt32", "SetInt32"}, true);
  for (const char* type :
       {"Float32", "Int8", "UInt8", "Int16", "UInt16", "UInt32", "Int64", "UInt64", "Binary", "Clock"}) {
    for (const char* what : {"Get", "Set"}) {
      const std::string name = std::string(what) + type;
      t[name] = {"", [=](const Importer& f, void* c) { return bare(f, c, name); }};
    }
  }
  refused(
      {"GetNumberOfVariableDependencies", "GetVariableDependencies", "GetAdjointDerivative", "EnterConfigurationMode",
       "ExitConfigurationMode", "EnterStepMode", "EvaluateDiscreteStates", "GetIntervalDecimal", "GetIntervalFraction",
       "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal", "SetIntervalFraction", "SetShiftDecimal",
       "SetShiftFraction", "GetOutputDerivatives", "ActivateModelPartition"},
      false);
  if (controller) {
    refused({"EnterEventMode", "UpdateDiscreteStates", "EnterContinuousTimeMode", "CompletedIntegratorStep", "SetTime",
             "SetContinuousStates", "GetContinuousStates", "GetContinuousStateDerivatives", "GetEventIndicators",
             "GetNominalsOfContinuousStates"},
            false);
  }
  for (const char* name : {"GetNumberOfContinuousStates", "GetNumberOfEventIndicators"}) {
    const std::string n = name;
    t[n] = {"INECST", [=](const Importer& f, void* c) {
              std::size_t count = 99;
              const int status = f.function<int(void*, std::size_t*)>(n)(c, &count);
              EXPECT_TRUE(c == nullptr || count == (n.find("Event") == std::string::npos && !controller ? 4u : 0u));
              return status;
            }};
  }
  return t;
}

class FmuConformanceExport : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Versions, FmuConformanceExport, ::testing::Values(2, 3),
                         [](const auto& v) { return fmt::format("Fmi{}", v.param); });

TEST_P(FmuConformanceExport, EveryFunctionInEveryStateIsDoneOrRefusedWithoutAChange) {
  int cells = 0;
  for (const Kind kind : {Kind::controller, Kind::plant_steps, Kind::plant_exchange}) {
    const testing::TemporaryFolder folder;
    FmuOptions options;
    options.version = GetParam();
    options.code.prefix = "unit";
    const auto files = kind == Kind::controller ? fmu_files(testing::design_of("tsmc", "kfe"), options)
                                                : fmu_files(rotor_model(), options);
    const Importer fmu = testing::packed(folder, files, options);
    const bool exchange = kind == Kind::plant_exchange;
    for (const auto& [name, row] : table_of(fmu.three, kind)) {
      for (const char state : std::string(exchange ? "INECT" : "INST")) {
        SCOPED_TRACE(fmt::format("{} in {} of kind {}", name, state, static_cast<int>(kind)));
        void* const c = fmu.instantiate(exchange, fmu.token);
        ASSERT_NE(c, nullptr);
        go_to(fmu, c, state);
        const std::string before = bytes_of(fmu, c);
        const int status = row.call(fmu, c);
        EXPECT_EQ(status <= 1, row.allowed.find(state) != std::string::npos) << "status " << status;
        if (status > 1) {
          EXPECT_EQ(bytes_of(fmu, c) == before, true) << "refused, and changed something";
        }
        fmu.free(c);
        ++cells;
      }
      EXPECT_GT(row.call(fmu, nullptr), 1) << name << " without an instance";
    }
  }
  fmt::print("FMI {}.0: {} functions and states\n", GetParam(), cells);
}

Importer import_rotor(const testing::TemporaryFolder& folder, int version) {
  FmuOptions options;
  options.version = version;
  options.code.prefix = "unit";
  return testing::packed(folder, fmu_files(rotor_model(), options), options);
}

// A state so large that its rates are no numbers is discarded, not handed on as if it were sound; then all goes on.
TEST_P(FmuConformanceExport, RatesThatOverflowAreDiscarded) {
  const testing::TemporaryFolder folder;
  const Importer fmu = import_rotor(folder, GetParam());
  void* const c = fmu.instantiate(true, fmu.token);
  go_to(fmu, c, 'C');
  const auto set = fmu.function<int(void*, const double*, std::size_t)>("SetContinuousStates");
  const auto rates =
      fmu.function<int(void*, double*, std::size_t)>(fmu.three ? "GetContinuousStateDerivatives" : "GetDerivatives");
  const auto get = fmu.function<int(void*, const unsigned*, std::size_t, double*, std::size_t)>(fmu.three ? "GetFloat64"
                                                                                                          : "GetReal");
  const std::array<unsigned, 2> asked{fmu.reference.at("der(vx)"), fmu.reference.at("x")};
  std::array<double, 2> value{};
  std::array<double, 4> state{}, rate{};
  for (const double size : {1e-3, 1e150, 1e300, 1e-3}) {
    state.fill(size);
    ASSERT_LE(set(c, state.data(), 4), 1);
    const int wanted = size > 1 ? 2 : 0;
    EXPECT_EQ(rates(c, rate.data(), 4), wanted) << size;
    EXPECT_EQ(get(c, asked.data(), 1, value.data(), 1), wanted) << size;
    EXPECT_EQ(get(c, asked.data() + 1, 1, value.data(), 1), 0) << "a state is what was set";
    EXPECT_EQ(value[0], size);
  }
  fmu.free(c);
}

TEST_P(FmuConformanceExport, StatesOfAnotherNumberAndNoPlaceForThemAreRefused) {
  const testing::TemporaryFolder folder;
  const Importer fmu = import_rotor(folder, GetParam());
  std::array<double, 5> values{1e-4, 0, 0, 0, 0};
  for (const char* name : {"SetContinuousStates", "GetContinuousStates", "GetNominalsOfContinuousStates",
                           fmu.three ? "GetContinuousStateDerivatives" : "GetDerivatives"}) {
    const auto call = fmu.function<int(void*, double*, std::size_t)>(name);
    const struct {
      double* place;
      std::size_t count;
      int status;
    } cases[] = {{values.data(), 4, 0}, {values.data(), 3, 3}, {values.data(), 5, 3}, {nullptr, 4, 3}};
    for (const auto& [place, count, status] : cases) {
      void* const c = fmu.instantiate(true, fmu.token);
      go_to(fmu, c, 'C');
      EXPECT_EQ(call(c, place, count), status) << name << " " << count;
      fmu.free(c);
    }
  }
}

TEST_P(FmuConformanceExport, PlacesThatAreNotThereAndAlteredBytesAreRefused) {
  const testing::TemporaryFolder folder;
  const Importer fmu = import_rotor(folder, GetParam());
  void* const c = fmu.instantiate(false, fmu.token);
  go_to(fmu, c, 'S');
  for (const char* what : {"Get", "Set"}) {
    const unsigned r = 1;
    const std::string name = std::string(what) + (fmu.three ? "Float64" : "Real");
    EXPECT_GT(
        (fmu.function<int(void*, const unsigned*, std::size_t, double*, std::size_t)>(name)(c, &r, 1, nullptr, 1)), 1);
    double value = 0;
    EXPECT_GT(
        (fmu.function<int(void*, const unsigned*, std::size_t, double*, std::size_t)>(name)(c, nullptr, 1, &value, 1)),
        1);
  }
  const std::string s = fmu.three ? "FMUState" : "FMUstate", load = (fmu.three ? "Deserialize" : "DeSerialize") + s;
  EXPECT_GT(fmu.function<int(void*, void**)>("Get" + s)(c, nullptr), 1);
  EXPECT_GT(fmu.function<int(void*, void*)>("Set" + s)(c, nullptr), 1);
  const std::string good = bytes_of(fmu, c);
  const auto read = [&](const std::string& bytes) {
    void* state = nullptr;
    const int status =
        fmu.function<int(void*, const char*, std::size_t, void**)>(load)(c, bytes.data(), bytes.size(), &state);
    if (state != nullptr) fmu.function<int(void*, void**)>("Free" + s)(c, &state);
    return status;
  };
  EXPECT_EQ(read(good), 0);
  for (std::size_t i = 0; i < good.size(); i += 7) {
    std::string bad = good;
    bad[i] = static_cast<char>(bad[i] ^ 0x40);
    EXPECT_GT(read(bad), 1) << i;
  }
  EXPECT_GT(read(good.substr(1)), 1);
  EXPECT_GT(read(good + '\0'), 1);
  fmu.free(c);
}

}  // namespace
}  // namespace whirl::deploy
