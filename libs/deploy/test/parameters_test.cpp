// Parameters while running: C, MEX, S-function, Python; each takes what is inside the bounds and names what is not.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>

#include "whirl/control/catalogue.hpp"
#include "whirl/core/error.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

void write_files(const testing::TemporaryFolder& folder, const std::vector<SourceFile>& files) {
  for (const SourceFile& f : files) folder.write(f.name, f.text);
}

TEST(ParameterExport, EveryParameterOfEveryLawIsTakenInsideItsBoundsAndRefusedOutside) {
  for (const bool single : {false, true}) {
    const testing::TemporaryFolder folder;
    std::string files, calls;
    int prefix = 0;
    for (const auto& law : control::laws()) {
      // Float: a few; pd_influence refuses it.
      if (single && law.name != "tsmc" && law.name != "pid" && law.name != "mpc") continue;
      const std::string name = fmt::format("v{}", prefix++);
      const ControllerCode code = controller_code(testing::design_of(law.name, "kfe"), {name, single, ""});
      write_files(folder, {code.header, code.source});
      files += " " + code.source.name;
      std::string body = fmt::format(
          "#include \"{0}.h\"\n#include \"check.h\"\nvoid check_{0}(void);\nvoid check_{0}(void) {{\n"
          "  static {0}_params p; static {0}_state s, kept; int32_t i;\n  {0}_default_params(&p);\n"
          "  CHECK({0}_init(&s, &p) == 0);\n  kept = s;\n",
          name);
      for (std::size_t i = 0; i < code.parameters.size(); ++i) {
        const CodeParameter& p = code.parameters[i];
        body += fmt::format("  CHECK(strcmp({}_parameter_name({}), \"{}\") == 0);\n", name, i + 1, p.name);
        body += fmt::format("  CHECK({0}_set_parameter(&s, {1}, NAN) != 0 && memcmp(&s, &kept, sizeof s) == 0);\n",
                            name, i + 1);
        body += fmt::format("  CHECK({0}_set_parameter(&s, {1}, ({0}_real)INFINITY) != 0);\n", name, i + 1);
        body += fmt::format("  CHECK({0}_set_parameter(&s, {1}, p.{2}) == 0 && memcmp(&s, &kept, sizeof s) == 0);\n",
                            name, i + 1, p.name);
        if (!std::isinf(p.high)) {
          body += fmt::format("  CHECK({0}_set_parameter(&s, {1}, ({0}_real)({2})) == {1});\n", name, i + 1,
                              p.low - 1 - std::abs(p.low));
          body += fmt::format("  CHECK({0}_set_parameter(&s, {1}, ({0}_real)({2})) == {1});\n", name, i + 1,
                              2 * p.high + 1);
          body += "  CHECK(memcmp(&s, &kept, sizeof s) == 0);\n";
        }
      }
      body += fmt::format(
          "  for (i = -2; i <= 0; i++) CHECK({0}_set_parameter(&s, i, 1) == i && {0}_parameter_name(i)[0] == 0);\n"
          "  CHECK({0}_set_parameter(&s, {0}_count() + 1, 1) != 0);\n}}\n",
          name);
      const std::string upper = fmt::format("V{}_PARAMETERS", prefix - 1);
      for (std::size_t at; (at = body.find(name + "_count()")) != std::string::npos;)
        body.replace(at, name.size() + 8, upper);
      folder.write("check_" + name + ".c", body);
      files += fmt::format(" check_{}.c", name);
      calls += fmt::format("  {{ extern void check_{0}(void); check_{0}(); }}\n", name);
    }
    folder.write(
        "check.h",
        "#include <math.h>\n#include <stdio.h>\n#include <string.h>\nextern int wrong;\n#define CHECK(x) do { if "
        "(!(x)) { wrong++; printf(\"%s:%d %s\\n\", __FILE__, __LINE__, #x); } } while (0)\n");
    folder.write("main.c",
                 "#include \"check.h\"\nint wrong = 0;\nint main(void) {\n" + calls + "  return wrong != 0;\n}\n");
    const auto run =
        testing::shell(folder.path(), "cc -std=c99 -O0 -Wall -Wextra -o a.out main.c" + files + " -lm && ./a.out");
    EXPECT_EQ(run.exit_code, 0) << run.text.substr(0, 2000);
  }
}

TEST(ParameterExport, OctaveTakesAndRefusesThem) {
  if (!testing::has_program("octave") || !testing::has_program("mkoctfile"))
    GTEST_SKIP() << "octave or octave-dev is not installed";
  const testing::TemporaryFolder folder;
  write_files(folder, export_matlab(testing::design_of("tsmc", "kfe"), {"drive", false, ""}));
  folder.write("points.m", R"(s = drive();
[names, values] = drive(s, 'parameters');
gain = find(strcmp(names, 'surface_gain'));
assert(values(gain) == 60);
s = drive(s, 'surface_gain', 80);
[names, values] = drive(s, 'parameters');
assert(values(gain) == 80);
for bad = {{'surface_gain', -1}, {'surface_gain', NaN}, {'no_such', 1}, {'surface_gain', [1 2]}}
  refused = false;
  try
    drive(s, bad{1}{:});
  catch e
    refused = true;
    if strcmp(bad{1}{1}, 'surface_gain') && isscalar(bad{1}{2})
      assert(!isempty(strfind(e.message, 'surface_gain')));
    end
  end
  assert(refused);
end
[out, s] = drive(s, [1e-4 0 0 60 0 1]);
assert(all(isfinite(out)) && out(9) == 0);
)");
  const auto run = testing::shell(folder.path(),
                                  "mkoctfile --mex --output drive.mex drive_mex.c drive.c && "
                                  "octave --no-gui --no-window-system --quiet points.m");
  EXPECT_EQ(run.exit_code, 0) << run.text;
}

TEST(ParameterExport, SFunctionsTakeAndRefuseThem) {
  const testing::TemporaryFolder folder;
  folder.write("simstruc.h", R"(#include <stddef.h>
typedef double real_T; typedef int int_T;
typedef struct { double *v; size_t n; } mxArray;
typedef struct { _Alignas(16) unsigned char work[8192]; double x[16], dx[16], in[16], out[32], t; int asked; mxArray given; const char *error; } SimStruct;
#define ssSetNumSFcnParams(S, k) ((S)->asked = (k))
#define ssGetNumSFcnParams(S) ((S)->asked)
#define ssGetSFcnParamsCount(S) 1
#define ssGetSFcnParam(S, i) (&(S)->given)
#define ssSetErrorStatus(S, text) ((S)->error = (text))
#define mxGetNumberOfElements(a) ((a)->n)
#define mxIsDouble(a) ((a) != NULL)
#define mxGetPr(a) ((a)->v)
#define ssSetNumContStates(S, n) ((void)(S))
#define ssSetNumDiscStates(S, n) ((void)(S))
#define ssSetNumInputPorts(S, n) 1
#define ssSetInputPortWidth(S, p, n) ((void)(S))
#define ssSetInputPortRequiredContiguous(S, p, n) ((void)(S))
#define ssSetInputPortDirectFeedThrough(S, p, n) ((void)(S))
#define ssSetNumOutputPorts(S, n) 1
#define ssSetOutputPortWidth(S, p, n) ((void)(S))
#define ssSetNumSampleTimes(S, n) ((void)(S))
#define ssSetNumDWork(S, n) ((void)(S))
#define ssSetDWorkWidth(S, i, n) ((void)(S))
#define ssSetDWorkDataType(S, i, t) ((void)(S))
#define ssSetSampleTime(S, i, t) ((void)(S))
#define ssSetOffsetTime(S, i, t) ((void)(S))
#define ssGetDWork(S, i) ((void *)(S)->work)
#define ssGetContStates(S) ((S)->x)
#define ssGetdX(S) ((S)->dx)
#define ssGetT(S) ((S)->t)
#define ssGetInputPortRealSignal(S, p) ((const real_T *)(S)->in)
#define ssGetOutputPortRealSignal(S, p) ((S)->out)
#define SS_UINT8 3
#define CONTINUOUS_SAMPLE_TIME 0.0
)");
  folder.write("cg_sfun.h", "#define whirl_test_end 1\n");
  write_files(folder, export_sfunction(testing::design_of("pd", "lpf"), {"drive", false, ""}));
  IdentifiedModel model;
  model.rotor = testing::design_of("pd", "lpf").model;
  write_files(folder, export_sfunction(model, {"plant", false, ""}));
  folder.write("drive_main.c", R"(#include "drive_sfun.c"
#include <string.h>
int main(void) {
  static SimStruct S;
  static drive_params p;
  double row[DRIVE_PARAMETERS];
  const double in[6] = {1e-4, 0, 0, 60, 0, 1};
  double was, now;
  int i;
  drive_default_params(&p);
  for (i = 0; i < DRIVE_PARAMETERS; i++) row[i] = ((double *)&p)[i];
  mdlInitializeSizes(&S); mdlInitializeSampleTimes(&S); mdlInitializeConditions(&S);
  if (S.error || S.asked != 1) return 1;
  for (i = 0; i < 6; i++) S.in[i] = in[i];
  mdlOutputs(&S, 0); was = S.out[0];
  S.given.v = row; S.given.n = DRIVE_PARAMETERS;
  for (i = 0; strcmp(drive_parameter_name(i + 1), "gain") != 0; i++) continue;
  row[i] *= 2;
  mdlCheckParameters(&S); mdlProcessParameters(&S);
  if (S.error) return 2;
  mdlOutputs(&S, 0); now = S.out[0];
  if (!(fabs(now - was) > 1e-6)) return 3;
  row[0] = NAN;
  mdlCheckParameters(&S);
  if (!S.error) return 4;
  S.error = NULL; row[0] = -1e300; mdlInitializeConditions(&S);
  if (!S.error) return 5;
  S.error = NULL; S.given.n = 3; mdlInitializeSizes(&S);
  return S.error ? 0 : 6;
}
)");
  folder.write("plant_main.c", R"(#include "plant_sfun.c"
int main(void) {
  static SimStruct S;
  static plant_params p;
  double *row = (double *)&p, was;
  plant_default_params(&p);
  mdlInitializeSizes(&S); mdlInitializeSampleTimes(&S); mdlInitializeConditions(&S);
  S.x[0] = 1e-3;
  mdlDerivatives(&S); was = S.dx[1];
  S.given.v = row; S.given.n = sizeof p / sizeof row[0];
  p.k1 *= 2;
  mdlCheckParameters(&S); mdlDerivatives(&S);
  if (S.error || !(S.dx[1] < 1.5 * was)) return 1;
  p.k1 = NAN;
  mdlCheckParameters(&S);
  return S.error ? 0 : 2;
}
)");
  const auto run = testing::shell(
      folder.path(),
      "for m in drive plant; do cc -std=c11 -Wall -Wextra -Wno-unused-function -Werror -I. ${m}_main.c $m.c -lm -o "
      "$m.out && ./$m.out || { echo $m $?; exit 1; }; done");
  EXPECT_EQ(run.exit_code, 0) << run.text;
}

TEST(ParameterExport, PythonTakesAndRefusesThem) {
  if (!testing::has_program("python3")) GTEST_SKIP() << "python3 is not installed";
  const testing::TemporaryFolder folder;
  write_files(folder, export_python(testing::design_of("tsmc", "kfe"), {"drive", false, ""}));
  folder.write("main.py", R"(from drive import Controller
a, b = Controller(), Controller(surface_gain=80)
a.set(surface_gain=80)
for k in range(50):
    x, y = a.step(1e-4 * k, 0, 0.06 * k, 60), b.step(1e-4 * k, 0, 0.06 * k, 60)
    assert (x.ux, x.uy) == (y.ux, y.uy)
for bad in ({"surface_gain": -1}, {"surface_gain": float("nan")}, {"no_such": 1}):
    try:
        a.set(**bad)
    except ValueError as e:
        assert list(bad)[0] in str(e)
    else:
        raise SystemExit(3)
a.step(5e-3, 0, 3.1, 60, missed=3)
)");
  const auto run = testing::shell(folder.path(), "python3 main.py");
  EXPECT_EQ(run.exit_code, 0) << run.text;
}

TEST(ParameterExport, ModelicaSignalsAreConnectors) {
  IdentifiedModel model;
  model.rotor = testing::design_of("pd", "lpf").model;
  const std::string text = export_modelica(model, {"plant", false, ""}).front().text;
  EXPECT_NE(text.find("connector RealInput = input Real"), std::string::npos);
  EXPECT_NE(text.find("connector RealOutput = output Real"), std::string::npos);
  for (const char* line :
       {"  RealInput ux(unit=\"N\") \"", "  RealInput beta(unit=\"rad\") \"", "  RealOutput x_sensor(unit=\"m\") \""})
    EXPECT_NE(text.find(line), std::string::npos) << line;
  EXPECT_EQ(text.find("  input Real"), std::string::npos);
}

TEST(ParameterExport, ARefusedExportWritesNothing) {
  EXPECT_THROW(export_c99(testing::design_of("pd_influence", "lpf"), {"drive", true, ""}), Error);
}

}  // namespace
}  // namespace whirl::deploy
