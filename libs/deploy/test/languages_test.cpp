#include "whirl/deploy/languages.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/tape.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {
namespace {

void write_all(const testing::TemporaryFolder& folder, const std::vector<SourceFile>& files) {
  for (const SourceFile& f : files) folder.write(f.name, f.text);
}

IdentifiedModel exported_rotor() {
  IdentifiedModel m;
  m.rotor = testing::design_of("pd", "lpf").model;
  m.rotor->k1_conj = {20, -15};
  m.rotor->modes = {{640, 0.01, {2e-6, 1e-6}}};
  return m;
}

/// Equations with every kind of term the printers know.
IdentifiedModel equations() {
  IdentifiedModel m;
  m.method = "test";
  m.states = {"X1", "X2"};
  m.inputs = {"X6", "u1"};
  const auto term = [](const char* function, double value) {
    return EquationTerm{function, {value, 0, value, value}, ""};
  };
  m.equations = {{"X2'",
                  {term("X1^3", -5700), term("sgn(X2)*sqrt(abs(X1))", -0.2), term("exp(-t)*cos(X6)", 0.3),
                   term("u1/(1+X1^2)", 1), term("tanh(X2)*min(X1, X2)", 2), term("max(X1, 0.1)^1.5", -1)}}};
  return m;
}

struct Points {
  std::vector<std::vector<double>> in, out;  ///< t, states, inputs; rates then outputs
};

Points points(const IdentifiedModel& model) {
  const ModelSystem s = model_system(model);
  std::vector<std::string> names{"t"};
  for (const auto& list : {s.states, s.inputs}) {
    for (const SystemVariable& v : list) names.push_back(v.name);
  }
  const std::size_t n = names.size();
  for (const CodeParameter& p : s.parameters) names.push_back(p.name);
  std::vector<expr::Expr> terms = s.rates;
  terms.insert(terms.end(), s.output_terms.begin(), s.output_terms.end());
  const expr::Tape tape = expr::compile(terms, names);
  std::mt19937_64 random(3);
  Points out;
  for (int k = 0; k < 20; ++k) {
    std::vector<double> in(names.size()), result(terms.size());
    for (std::size_t i = 0; i < n; ++i) in[i] = static_cast<double>(random() % 2000) / 1000 - (i == 0 ? 0 : 1);
    for (std::size_t i = n; i < names.size(); ++i) in[i] = s.parameters[i - n].value;
    tape.evaluate_point(in.data(), result.data());
    in.resize(n);
    out.in.push_back(in);
    out.out.push_back(result);
  }
  return out;
}

std::string list(const std::vector<double>& values, std::size_t from, std::size_t to, const char* open,
                 const char* close) {
  std::string text = open;
  for (std::size_t i = from; i < to; ++i) text += fmt::format("{}{:.17g}", i > from ? ", " : "", values[i]);
  return text + close;
}

/// Numbers that a program printed, one a line.
void expect_numbers(const std::string& text, const Points& expected) {
  std::istringstream in(text);
  for (const auto& row : expected.out) {
    for (const double value : row) {
      std::string token;
      in >> token;
      const double printed = std::strtod(token.c_str(), nullptr);
      ASSERT_FALSE(token.empty()) << text;
      EXPECT_NEAR(printed, value, 1e-12 * (1 + std::abs(value))) << token;
    }
  }
}

TEST(Forms, ByNameAndPrefixFromAFile) {
  const ControllerDesign design = testing::design_of("pd", "lpf");
  CodeOptions options;
  EXPECT_EQ(source_files(design, "latex", options).front().text, export_latex(design, options).front().text);
  EXPECT_EQ(source_files(exported_rotor(), "modelica", options).front().name, "Controller.mo");
  EXPECT_THROW(source_files(design, "modelica", options), Error);
  EXPECT_THROW(source_files(exported_rotor(), "fortran", options), Error);
  EXPECT_EQ(prefix_of("out/Controller-tsmc.json"), "controller_tsmc");
  EXPECT_EQ(prefix_of("5g.json"), "whirl_5g");
}

TEST(LanguageExport, PythonFunctionGivesTheSameNumbers) {
  if (!testing::has_program("python3")) GTEST_SKIP() << "python3 is not installed";
  for (const IdentifiedModel& model : {exported_rotor(), equations()}) {
    const testing::TemporaryFolder folder;
    write_all(folder, export_python(model, {"plant", false, ""}));
    const Points p = points(model);
    const std::size_t n = model_system(model).states.size();
    std::string script = "import plant\n";
    for (const auto& in : p.in) {
      const std::string arguments =
          fmt::format("{:.17g}, {}, {}", in[0], list(in, 1, n + 1, "[", "]"), list(in, n + 1, in.size(), "[", "]"));
      script +=
          fmt::format("for v in list(plant.rates({0})) + list(plant.outputs({0})): print(repr(float(v)))\n", arguments);
    }
    folder.write("main.py", script);
    const auto run = testing::shell(folder.path(), "python3 main.py");
    ASSERT_EQ(run.exit_code, 0) << run.text;
    expect_numbers(run.text, p);
  }
}

TEST(LanguageExport, OctaveFunctionGivesTheSameNumbers) {
  if (!testing::has_program("octave")) GTEST_SKIP() << "octave is not installed";
  for (const IdentifiedModel& model : {exported_rotor(), equations()}) {
    const testing::TemporaryFolder folder;
    write_all(folder, export_matlab(model, {"plant", false, ""}));
    const Points p = points(model);
    const std::size_t n = model_system(model).states.size();
    std::string script = "p = plant();\n";
    for (const auto& in : p.in) {
      script += fmt::format("[r, y] = plant({:.17g}, {}, {}, p); printf('%.17g\\n', r, y);\n", in[0],
                            list(in, 1, n + 1, "[", "]"), list(in, n + 1, in.size(), "[", "]"));
    }
    folder.write("points.m", script);
    const auto run =
        testing::shell(folder.path(), "octave --no-gui --no-window-system --quiet points.m 2>warnings.txt");
    ASSERT_EQ(run.exit_code, 0) << run.text;
    expect_numbers(run.text, p);
  }
}

/// A short closed-loop-like record with the library's answers.
struct Answers {
  std::vector<Measurement> in;
  std::vector<Command> out;
};
Answers answers(const ControllerDesign& design) {
  control::Controller controller = control::make_controller(design);
  Answers a;
  for (int k = 0; k < 300; ++k) {
    Measurement m;
    m.beta = 0.09 * k;
    m.omega = 90;
    m.omega_dot = -1;
    m.x = 3e-4 * std::cos(m.beta - 1);
    m.y = 3e-4 * std::sin(m.beta - 1);
    m.valid = k % 50 != 7;
    a.in.push_back(m);
    a.out.push_back(*controller.step(m));
  }
  return a;
}

void expect_forces(const std::string& text, const Answers& a) {
  std::istringstream in(text);
  for (const Command& c : a.out) {
    double ux = NAN, uy = NAN;
    in >> ux >> uy;
    EXPECT_NEAR(ux, c.ux, 1e-11);
    EXPECT_NEAR(uy, c.uy, 1e-11);
  }
}

TEST(LanguageExport, PythonControllerGivesTheSameForces) {
  if (!testing::has_program("python3")) GTEST_SKIP() << "python3 is not installed";
  const ControllerDesign design = testing::design_of("tsmc", "kfe");
  const testing::TemporaryFolder folder;
  write_all(folder, export_python(design, {"drive", false, ""}));
  const Answers a = answers(design);
  std::string script = "from drive import Controller\nc = Controller()\n";
  for (const Measurement& m : a.in) {
    script += fmt::format("o = c.step({:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {}); print(o.ux, o.uy)\n", m.x, m.y,
                          m.beta, m.omega, m.omega_dot, m.valid ? "True" : "False");
  }
  script +=
      "try:\n    Controller(surface_gain=-1)\n    raise SystemExit(3)\nexcept ValueError as e:\n    assert "
      "'surface_gain' in str(e)\n";
  folder.write("main.py", script);
  const auto run = testing::shell(folder.path(), "python3 main.py");
  ASSERT_EQ(run.exit_code, 0) << run.text;
  expect_forces(run.text, a);
}

TEST(LanguageExport, OctaveControllerGivesTheSameForces) {
  if (!testing::has_program("octave") || !testing::has_program("mkoctfile"))
    GTEST_SKIP() << "octave or octave-dev is not installed";
  const ControllerDesign design = testing::design_of("tsmc", "kfe");
  const testing::TemporaryFolder folder;
  write_all(folder, export_matlab(design, {"drive", false, ""}));
  const Answers a = answers(design);
  std::string script = "s = drive();\n";
  for (const Measurement& m : a.in) {
    script += fmt::format(
        "[o, s] = drive(s, [{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {}]); printf('%.17g %.17g\\n', o(1:2));\n",
        m.x, m.y, m.beta, m.omega, m.omega_dot, m.valid ? 1 : 0);
  }
  folder.write("points.m", script);
  const auto run = testing::shell(folder.path(),
                                  "mkoctfile --mex --output drive.mex drive_mex.c drive.c && "
                                  "octave --no-gui --no-window-system --quiet points.m 2>warnings.txt");
  ASSERT_EQ(run.exit_code, 0) << run.text;
  expect_forces(run.text, a);
}

// Simulink's headers are not free: a header of our own stands for the macros the S-function uses, and a driver for the
// solver.
TEST(LanguageExport, SFunctionsCompileAndGiveTheSameForces) {
  const ControllerDesign design = testing::design_of("tsmc", "kfe");
  const testing::TemporaryFolder folder;
  folder.write("simstruc.h", R"(#include <stddef.h>
typedef double real_T; typedef int int_T;
typedef struct { _Alignas(16) unsigned char work[8192]; double x[16], dx[16], in[16], out[32], t; int states, inputs, outputs; double sample; } SimStruct;
#define ssSetNumSFcnParams(S, n) ((void)(S))
#define ssSetNumContStates(S, n) ((S)->states = (n))
#define ssSetNumDiscStates(S, n) ((void)(S))
#define ssSetNumInputPorts(S, n) 1
#define ssSetInputPortWidth(S, p, n) ((S)->inputs = (n))
#define ssSetInputPortRequiredContiguous(S, p, n) ((void)(S))
#define ssSetInputPortDirectFeedThrough(S, p, n) ((void)(S))
#define ssSetNumOutputPorts(S, n) 1
#define ssSetOutputPortWidth(S, p, n) ((S)->outputs = (n))
#define ssSetNumSampleTimes(S, n) ((void)(S))
#define ssSetNumDWork(S, n) ((void)(S))
#define ssSetDWorkWidth(S, i, n) ((void)(S))
#define ssSetDWorkDataType(S, i, t) ((void)(S))
#define ssSetSampleTime(S, i, t) ((S)->sample = (t))
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
  write_all(folder, export_sfunction(design, {"drive", false, ""}));
  write_all(folder, export_sfunction(exported_rotor(), {"plant", false, ""}));
  const Answers a = answers(design);
  std::string driver = "#include \"drive_sfun.c\"\n#include <stdio.h>\nstatic const double in[][6] = {\n";
  for (const Measurement& m : a.in) {
    driver += fmt::format("{{{:.17g}, {:.17g}, {:.17g}, {:.17g}, {:.17g}, {}}},\n", m.x, m.y, m.beta, m.omega,
                          m.omega_dot, m.valid ? 1 : 0);
  }
  driver += R"(};
int main(void) {
  static SimStruct S;
  mdlInitializeSizes(&S); mdlInitializeSampleTimes(&S); mdlInitializeConditions(&S);
  if (S.inputs != 6 || S.outputs != 9 || S.sample != 1e-3) return 1;
  for (size_t k = 0; k < sizeof in / sizeof in[0]; k++) {
    for (int i = 0; i < 6; i++) S.in[i] = in[k][i];
    mdlOutputs(&S, 0);
    printf("%.17g %.17g\n", S.out[0], S.out[1]);
  }
  mdlTerminate(&S);
  return 0;
}
)";
  folder.write("driver.c", driver);
  const auto run =
      testing::shell(folder.path(),
                     "cc -std=c11 -Wall -Wextra -Werror -I. driver.c drive.c -lm -o a.out && "
                     "cc -std=c11 -Wall -Wextra -Wno-unused-function -Werror -I. -c plant_sfun.c && ./a.out");
  ASSERT_EQ(run.exit_code, 0) << run.text;
  expect_forces(run.text, a);
}

TEST(LanguageExport, LatexAndModelicaHoldEveryEquationAndParameter) {
  const IdentifiedModel model = exported_rotor();
  const ModelSystem s = model_system(model);
  const std::string tex = export_latex(model, {"plant", false, ""}).front().text;
  const SourceFile modelica = export_modelica(model, {"plant", false, ""}).front();
  EXPECT_EQ(modelica.name, "Plant.mo");
  EXPECT_NE(modelica.text.find("\nend Plant;"), std::string::npos);
  for (const SystemVariable& v : s.states) {
    EXPECT_NE(modelica.text.find("der(" + v.name + ") = "), std::string::npos) << v.name;
    EXPECT_NE(tex.find("\\dot{"), std::string::npos);
  }
  for (const CodeParameter& p : s.parameters)
    EXPECT_NE(modelica.text.find("parameter Real " + p.name), std::string::npos) << p.name;
  EXPECT_NE(modelica.text.find("unit=\"1/(m2.s2)\""), std::string::npos);
  for (const control::MethodInfo& law : control::laws()) {
    const std::string text = export_latex(testing::design_of(law.name, "kfe"), {"drive", false, ""}).front().text;
    EXPECT_EQ(std::count(text.begin(), text.end(), '{'), std::count(text.begin(), text.end(), '}')) << law.name;
    EXPECT_EQ(std::count(text.begin(), text.end(), '$') % 2, 0) << law.name;
    EXPECT_NE(text.find("a = "), std::string::npos) << law.name;
  }
}

}  // namespace
}  // namespace whirl::deploy
