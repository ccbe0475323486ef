// What an FMU holds: description, functions, sources.
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
#include "whirl/deploy/fmu.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

/// Every function of the standard, whether this FMU has a use for it or not; those of model exchange are left out of an
/// FMI 2 controller only.
std::set<std::string> standard_functions(bool three, bool controller) {
  const char* const text2 =
      "GetTypesPlatform GetVersion SetDebugLogging Instantiate FreeInstance SetupExperiment EnterInitializationMode "
      "ExitInitializationMode Terminate Reset GetReal SetReal GetInteger SetInteger GetBoolean SetBoolean GetString "
      "SetString "
      "GetFMUstate SetFMUstate FreeFMUstate SerializedFMUstateSize SerializeFMUstate DeSerializeFMUstate "
      "GetDirectionalDerivative SetRealInputDerivatives GetRealOutputDerivatives DoStep CancelStep GetStatus "
      "GetRealStatus "
      "GetIntegerStatus GetBooleanStatus GetStringStatus";
  const char* const exchange2 =
      " EnterEventMode NewDiscreteStates EnterContinuousTimeMode CompletedIntegratorStep SetTime SetContinuousStates "
      "GetDerivatives GetEventIndicators GetContinuousStates GetNominalsOfContinuousStates";
  std::string text3 =
      "GetVersion SetDebugLogging InstantiateModelExchange InstantiateCoSimulation InstantiateScheduledExecution "
      "FreeInstance "
      "EnterInitializationMode ExitInitializationMode EnterEventMode Terminate Reset GetNumberOfVariableDependencies "
      "GetVariableDependencies GetFMUState SetFMUState FreeFMUState SerializedFMUStateSize SerializeFMUState "
      "DeserializeFMUState GetDirectionalDerivative GetAdjointDerivative EnterConfigurationMode ExitConfigurationMode "
      "GetIntervalDecimal GetIntervalFraction GetShiftDecimal GetShiftFraction SetIntervalDecimal SetIntervalFraction "
      "SetShiftDecimal SetShiftFraction EvaluateDiscreteStates UpdateDiscreteStates EnterContinuousTimeMode "
      "CompletedIntegratorStep SetTime SetContinuousStates GetContinuousStateDerivatives GetEventIndicators "
      "GetContinuousStates GetNominalsOfContinuousStates GetNumberOfEventIndicators GetNumberOfContinuousStates "
      "EnterStepMode GetOutputDerivatives DoStep ActivateModelPartition";
  for (const char* type : {"Float32", "Float64", "Int8", "UInt8", "Int16", "UInt16", "Int32", "UInt32", "Int64",
                           "UInt64", "Boolean", "String", "Binary", "Clock"}) {
    text3 += fmt::format(" Get{0} Set{0}", type);
  }
  std::istringstream in(three ? text3 : controller ? std::string(text2) : std::string(text2) + exchange2);
  std::set<std::string> out;
  for (std::string name; in >> name;) out.insert((three ? "fmi3" : "fmi2") + name);
  return out;
}

TEST_P(FmuExport, DescriptionHasTheStructureOfTheStandard) {
  const bool three = GetParam() == 3;
  for (const bool controller : {true, false}) {
    const Importer fmu = controller ? import(testing::design_of("tsmc", "kfe")) : import(friction_oscillator());
    EXPECT_EQ(fmu.root.attribute("modelName").value(), std::string("unit"));
    EXPECT_EQ(bool(fmu.root.child("CoSimulation")), true);
    EXPECT_EQ(bool(fmu.root.child("ModelExchange")), !controller);
    std::set<std::string> units, names;
    for (const pugi::xml_node u : fmu.root.child("UnitDefinitions").children("Unit"))
      units.insert(u.attribute("name").value());
    std::vector<unsigned> references;
    for (const pugi::xml_node v : fmu.variables) {
      EXPECT_TRUE(names.insert(v.attribute("name").value()).second) << v.attribute("name").value();
      references.push_back(v.attribute("valueReference").as_uint());
      const pugi::xml_node typed = three ? v : v.first_child();
      if (const auto unit = typed.attribute("unit")) {
        EXPECT_TRUE(units.contains(unit.value())) << unit.value();
      }
      const std::string causality = v.attribute("causality").value();
      if (causality == "input" || causality == "parameter") {
        EXPECT_TRUE(typed.attribute("start")) << v.attribute("name").value();
      }
      if (causality != "independent") {
        EXPECT_TRUE(v.attribute("description")) << v.attribute("name").value();
      }
      if (const auto d = typed.attribute("derivative")) {
        const std::size_t at = three ? d.as_uint() : d.as_uint() - 1;
        EXPECT_EQ("der(" + std::string(fmu.variables[at].attribute("name").value()) + ")", v.attribute("name").value());
      }
    }
    EXPECT_EQ(std::set<unsigned>(references.begin(), references.end()).size(), references.size());
    const pugi::xml_node structure = fmu.root.child("ModelStructure");
    std::size_t outputs = 0, listed = 0;
    for (const pugi::xml_node v : fmu.variables) outputs += std::string(v.attribute("causality").value()) == "output";
    if (three) {
      for (const pugi::xml_node o : structure.children("Output")) {
        EXPECT_EQ(fmu.variables[o.attribute("valueReference").as_uint()].attribute("causality").value(),
                  std::string("output"));
        ++listed;
      }
      EXPECT_EQ(std::distance(structure.children("EventIndicator").begin(), structure.children("EventIndicator").end()),
                controller ? 0 : 1);
    } else {
      for (const pugi::xml_node o : structure.child("Outputs").children()) {
        EXPECT_EQ(fmu.variables[o.attribute("index").as_uint() - 1].attribute("causality").value(),
                  std::string("output"));
        ++listed;
      }
      EXPECT_EQ(fmu.root.attribute("numberOfEventIndicators").as_int(), controller ? 0 : 1);
      std::size_t unknowns = 0;
      for ([[maybe_unused]] const pugi::xml_node u : structure.child("InitialUnknowns").children()) ++unknowns;
      EXPECT_EQ(unknowns, outputs + (controller ? 0u : 2u));
    }
    EXPECT_EQ(listed, outputs);
    EXPECT_EQ(fmu.names.front(), "modelDescription.xml");
    for (const std::string& name : fmu.names) EXPECT_EQ(name.find('\\'), std::string::npos);

    // The standard's functions and nothing else are visible.
    const auto symbols = testing::shell(
        folder.path(), fmt::format("nm -D --defined-only unpacked/binaries/*/unit.so | awk '{{print $3}}'"));
    std::istringstream lines(symbols.text);
    const std::set<std::string> visible{std::istream_iterator<std::string>(lines), {}};
    EXPECT_EQ(visible, standard_functions(three, controller));
    if (testing::has_program("xmllint")) {
      const auto lint = testing::shell(folder.path(), "find unpacked -name '*.xml' | xargs xmllint --noout");
      EXPECT_EQ(lint.exit_code, 0) << lint.text;
    }
    std::filesystem::remove_all(folder.path() / "unpacked");
  }
}

TEST_P(FmuExport, SourcesCompileStrictlyAndTheFileIsTheSameTwice) {
  FmuOptions options;
  options.version = GetParam();
  options.code.prefix = "unit";
  for (const auto& files :
       {fmu_files(testing::design_of("pid", "kfo"), options), fmu_files(friction_oscillator(), options)}) {
    for (const SourceFile& f : files) folder.write(f.name, f.text);
    const auto built = testing::shell(
        folder.path(), std::string("cd sources && cc ") + testing::kStrictC99 + " -fPIC -c unit.c unit_fmu.c");
    EXPECT_EQ(built.exit_code, 0) << built.text;
  }
  const auto files = fmu_files(friction_oscillator(), options);
  for (const char* name : {"a.fmu", "b.fmu"}) pack_fmu(files, options, folder.path() / name);
  EXPECT_EQ(testing::shell(folder.path(), "cmp a.fmu b.fmu").exit_code, 0);
}

TEST(Fmu, RefusesWhatHasNoSuchForm) {
  FmuOptions options;
  options.version = 1;
  EXPECT_THROW(fmu_files(testing::design_of("pd", "lpf"), options), Error);
  options.version = 2;
  options.co_simulation = false;
  EXPECT_THROW(fmu_files(testing::design_of("pd", "lpf"), options), Error);
  options = {};
  options.code.single_precision = true;
  EXPECT_THROW(fmu_files(testing::design_of("pd", "lpf"), options), Error);
  IdentifiedModel map = friction_oscillator();
  map.equations[0].lhs = "X2[k+1]";
  map.equations.push_back({"X1[k+1]", map.equations[0].terms});
  EXPECT_THROW(fmu_files(map, {}), Error);
}

}  // namespace
}  // namespace whirl::deploy
