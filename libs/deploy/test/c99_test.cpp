#include <fmt/format.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "template.hpp"
#include "whirl/control/catalogue.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

void write_all(const testing::TemporaryFolder& folder, const std::vector<SourceFile>& files) {
  for (const SourceFile& f : files) folder.write(f.name, f.text);
}

TEST(Template, ResolvesConditionsSlotsLiteralsAndPrefix) {
  TemplateSettings s;
  s.prefix = "abc";
  s.features = {"B"};
  s.slots = {{"type", "double"}, {"none", ""}};
  const char* text =
      "#ifndef WHIRL_H\n#if HAS_A\na\n#elif HAS_B || HAS_C\nb R(0.5) M(sqrt)(x) whirl_x xwhirl_y\n#else\nc\n#endif\n"
      "/*@none@*/\n/*@type@*/ x;\n#endif\n";
  EXPECT_EQ(fill_template(text, s), "#ifndef ABC_H\nb 0.5 sqrt(x) abc_x xwhirl_y\ndouble x;\n#endif\n");
  s.single_precision = true;
  EXPECT_EQ(fill_template("R(0.1) R(1.0) R(1e-4) M(sqrt)(x)", s), "0.100000001F 1.0F 9.99999975e-05F sqrtf(x)");
  EXPECT_THROW(fill_template("/*@unknown@*/", s), Error);
  EXPECT_THROW(fill_template("#if HAS_A\n", s), Error);
}

TEST(Template, DropsFunctionsThatNothingUses) {
  const std::string text =
      "/* first */\nstatic int one(void) { return 1; }\n\n/* second */\nstatic int two(int x) {\n  return one() + "
      "x;\n}\n\n"
      "static int three(void) { return 3; }\n\nint use(void) { return three(); }\n";
  EXPECT_EQ(drop_unused_functions(text), "static int three(void) { return 3; }\n\nint use(void) { return three(); }\n");
}

TEST(ControllerSource, RefusesWhatItCannotExport) {
  const ControllerDesign d = testing::design_of("tsmc", "kfe");
  for (const char* prefix : {"", "2x", "float", "My", "a-b", "abcdefghijklmnopqrstuvwxyz"}) {
    EXPECT_THROW(controller_code(d, {prefix, false, ""}), Error) << prefix;
  }
  EXPECT_THROW(controller_code(testing::design_of("pd_influence", "lpf"), {"c", true, ""}), Error);
  ControllerDesign unknown = d;
  unknown.law = "tsmcc";
  EXPECT_THROW(controller_code(unknown, {"c", false, ""}), Error);
  ControllerDesign no_gain = d;
  no_gain.model.gain = 0;
  EXPECT_THROW(controller_code(no_gain, {"c", false, ""}), Error);
}

TEST(ControllerSource, HasNoAllocationNoOutputNoGlobalsAndSameBytesTwice) {
  for (const control::MethodInfo& law : control::laws()) {
    const ControllerCode code = controller_code(testing::design_of(law.name, "kfe"), {"unit", false, "c.json"});
    for (const char* word : {"malloc", "stdio", "printf", "errno", "HAS_", "/*@", "whirl_"}) {
      EXPECT_EQ(code.source.text.find(word), std::string::npos) << law.name << " " << word;
      EXPECT_EQ(code.header.text.find(word), std::string::npos) << law.name << " " << word;
    }
    // A global would be a line at column 0 that ends in ';' and is no declaration of a function, type or brace.
    const std::regex global(R"(^(static |const )?\w+ \w+(\[.*\])?( = .*)?;$)", std::regex::multiline);
    EXPECT_FALSE(std::regex_search(code.source.text, global)) << law.name;
    EXPECT_EQ(code.source.text,
              controller_code(testing::design_of(law.name, "kfe"), {"unit", false, "c.json"}).source.text);
    EXPECT_NE(code.source.text.find("a = "), std::string::npos) << law.name;
  }
}

// Self-test programs of both precisions, built by the exported Makefile and by the exported CMake project.
TEST(ControllerSourceExport, SelfTestsPassWithMakeAndCMake) {
  const testing::TemporaryFolder folder;
  for (const bool single : {false, true}) {
    write_all(folder, export_c99(testing::design_of("tsmc", "kfe"), {"drive", single, ""}));
    const auto made =
        testing::shell(folder.path(), "make clean check CFLAGS='" + std::string(testing::kStrictC99) + "'");
    EXPECT_EQ(made.exit_code, 0) << made.text;
  }
  const auto cmake = testing::shell(folder.path(), "cmake -B b . && cmake --build b && b/drive_selftest");
  EXPECT_EQ(cmake.exit_code, 0) << cmake.text;
}

TEST(ControllerSourceExport, PredictiveLawPassesItsSelfTestAtTheForceLimit) {
  const testing::TemporaryFolder folder;
  for (const bool single : {false, true}) {
    ControllerDesign d = testing::design_of("mpc", "kfe");
    d.parameters["predict"] = 1;
    d.force_limit = 2;
    write_all(folder, export_c99(d, {"drive", single, ""}));
    const auto made =
        testing::shell(folder.path(), "make clean check CFLAGS='" + std::string(testing::kStrictC99) + "'");
    EXPECT_EQ(made.exit_code, 0) << made.text;
    EXPECT_NE(made.text.find("largest force 2 N"), std::string::npos) << made.text;
    fmt::print("{}", made.text.substr(made.text.find("drive: ")));
  }
}

TEST(ControllerSourceExport, SelfTestFailsOnAWrongController) {
  const testing::TemporaryFolder folder;
  auto files = export_c99(testing::design_of("tsmc", "kfe"), {"drive", false, ""});
  files[1].text = std::regex_replace(files[1].text, std::regex("surface_gain = 60.0"), "surface_gain = 60.001");
  write_all(folder, files);
  const auto made = testing::shell(folder.path(), "make check");
  EXPECT_NE(made.exit_code, 0) << made.text;
  EXPECT_NE(made.text.find("off by"), std::string::npos) << made.text;
}

// The same bytes are valid C++, and clang finds nothing either.
TEST(ControllerSourceExport, CompilesAsCPlusPlusAndWithClang) {
  const testing::TemporaryFolder folder;
  const ControllerCode code = controller_code(testing::design_of("sta_implicit", "eso"), {"drive", false, ""});
  write_all(folder, {code.header, code.source});
  const auto cpp =
      testing::shell(folder.path(), "c++ -x c++ -std=c++17 -Wall -Wextra -pedantic -Werror -c drive.c -o cpp.o");
  EXPECT_EQ(cpp.exit_code, 0) << cpp.text;
  if (!testing::has_program("clang")) GTEST_SKIP() << "clang is not installed";
  const auto clang =
      testing::shell(folder.path(), "clang " + std::string(testing::kStrictC99) + " -c drive.c -o clang.o");
  EXPECT_EQ(clang.exit_code, 0) << clang.text;
}

TEST(ControllerSourceExport, WrongParametersAreRefusedByTheirNumber) {
  const testing::TemporaryFolder folder;
  const ControllerCode code = controller_code(testing::design_of("tsmc", "kfe"), {"drive", false, ""});
  write_all(folder, {code.header, code.source});
  folder.write("main.c", R"(#include "drive.h"
#include <math.h>
int main(void) {
  drive_params p; drive_state s; drive_input in = {0, 0, 0, 0, 0, true}; drive_output out;
  drive_default_params(&p);
  p.surface_gain = -1.0;
  if (drive_init(&s, &p) != 1) return 1;
  if (drive_step(&s, &in, &out) != DRIVE_NOT_READY) return 2;
  drive_default_params(&p);
  if (drive_init(&s, &p) != 0) return 3;
  if (drive_step(&s, &in, &out) != DRIVE_OK) return 4;
  p.k1 = NAN;
  if (drive_set_params(&s, &p) == 0) return 5;
  drive_default_params(&p);
  p.sensor_delay = 2.0 * p.delay;
  if (drive_set_params(&s, &p) == 0) return 6;
  in.beta = INFINITY;
  if (drive_step(&s, &in, &out) != DRIVE_NOT_FINITE || out.ux != 0.0) return 7;
  in.beta = 0.0; in.valid = false;
  { int k; for (k = 0; k < 100; k++) if (drive_step(&s, &in, &out) != DRIVE_OK || !out.held) return 8; }
  if (drive_step(&s, &in, &out) != DRIVE_STALE_SENSOR) return 9;
  return 0;
}
)");
  const auto built =
      testing::shell(folder.path(), "cc " + std::string(testing::kStrictC99) + " main.c drive.c -lm && ./a.out");
  EXPECT_EQ(built.exit_code, 0) << built.text;
}

// Another processor: the self-test of both precisions under an emulator.
TEST(ControllerSourceExport, SelfTestPassesOnAarch64) {
  if (!testing::has_program("aarch64-linux-gnu-gcc") || !testing::has_program("qemu-aarch64")) {
    GTEST_SKIP() << "gcc-aarch64-linux-gnu or qemu-user is not installed";
  }
  const testing::TemporaryFolder folder;
  for (const bool single : {false, true}) {
    write_all(folder, export_c99(testing::design_of("tsmc", "kfe"), {"drive", single, ""}));
    const auto run = testing::shell(folder.path(), "aarch64-linux-gnu-gcc -static " + std::string(testing::kStrictC99) +
                                                       " drive.c drive_selftest.c -lm && qemu-aarch64 ./a.out");
    EXPECT_EQ(run.exit_code, 0) << run.text;
    EXPECT_NE(run.text.find("off by"), std::string::npos) << run.text;
    fmt::print("{}", run.text);
  }
}

}  // namespace
}  // namespace whirl::deploy
