#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <regex>
#include <sstream>

#include "../program.hpp"
#include "duffing_record.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/testing/systems/quadratic_flows.hpp"

namespace whirl::testing {
namespace {

std::string lines_with(const std::string& text, const std::string& word) {
  std::istringstream in(text);
  std::string line, out;
  while (std::getline(in, line)) {
    if (line.find(word) != std::string::npos) out += line + "\n";
  }
  return out;
}

TEST(IdentifyGeneralE2e, StatesInputsAndDegreeGiveEquationsEvidenceAndAModelFile) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  const Outcome o = folder.whirl("identify run.csv --states x,v --inputs u --degree 3 --out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  for (const char* word :
       {"x\u0307 = ", "v\u0307 = ", "95 % interval", "chi^2", "condition number", "collinear", "held out", "Trust"}) {
    EXPECT_NE(o.out.find(word), std::string::npos) << word << "\n" << o.out;
  }
  const auto m = io::load<IdentifiedModel>(folder / "model.json");
  ASSERT_EQ(m.equations.size(), 2u);
  EXPECT_EQ(m.equations[0].terms.size(), 1u);
  EXPECT_EQ(m.equations[1].terms.size(), 4u);
  EXPECT_NEAR(coefficient(m, "v'", "x^3"), -1, 0.01);
  EXPECT_NEAR(m.summary.chi_square, 1, 0.2);
  const io::Json file = io::load_json(folder / "model.json");
  const io::Json* held = file.find("evidence")->find("held_out");
  EXPECT_EQ(held->find("free_run")->get<io::Json::Array>()->size(), 2u);

  io::write_csv(folder / "other.csv", duffing(2000, 9));
  const Outcome check = folder.whirl("validate model.json other.csv --json");
  ASSERT_EQ(check.exit_code, 0) << check.err;
  const io::Json shown = io::parse_json(check.out, "stdout");
  const io::Json& run = shown.find("runs")->get<io::Json::Array>()->front();
  const io::Json& x = run.find("free_run")->get<io::Json::Array>()->front();
  EXPECT_EQ(*x.find("state")->get<std::string>(), "x");
  EXPECT_LT(*x.find("nrmse")->get<double>(), 0.03);
}

TEST(IdentifyGeneralE2e, DisplacementOnlyKnownEquationsMapsTermsAndSeveralFiles) {
  const Folder folder;
  io::write_csv(folder / "a.csv", duffing(3000, 1));
  io::write_csv(folder / "b.csv", duffing(2500, 2));
  Outcome o = folder.whirl("identify a.csv b.csv --states x --inputs u --order 2 --out second.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NE(o.out.find("held out          b.csv"), std::string::npos) << o.out;
  EXPECT_NEAR(coefficient(io::load<IdentifiedModel>(folder / "second.json"), "x''", "x^3"), -1, 0.02);

  o = folder.whirl(
      "identify a.csv --method sindy --states x,v --inputs u --known \"x' = v\" --terms 'x, v, u, x^3, max(x, v)' "
      "--no-holdout "
      "--out known.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto known = io::load<IdentifiedModel>(folder / "known.json");
  EXPECT_EQ(coefficient(known, "x'", "v"), 1);
  EXPECT_EQ(known.equations[1].terms.size(), 4u);
  EXPECT_EQ(o.out.find("held out"), std::string::npos);

  // Henon 1976.
  std::string text = "t_s,p_1,q_1\n";
  double p = 0.1, q = 0.1;
  for (int k = 0; k < 400; ++k) {
    text += fmt::format("{},{:.17g},{:.17g}\n", k, p, q);
    const double next = 1 - 1.4 * p * p + q;
    q = 0.3 * p;
    p = next;
  }
  folder.write("henon.csv", text);
  o = folder.whirl("identify henon.csv --discrete --degree 2 --out map.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NEAR(coefficient(io::load<IdentifiedModel>(folder / "map.json"), "p[k+1]", "p^2"), -1.4, 1e-6);

  // Explicit time: x' = -x + 0.5 t.
  text = "t_s,x_1\n";
  for (int k = 0; k < 600; ++k) {
    const double t = 0.01 * k;
    text += fmt::format("{:.4f},{:.17g}\n", t, 0.5 * (t - 1) + 3 * std::exp(-t));
  }
  folder.write("ramp.csv", text);
  o = folder.whirl("identify ramp.csv --time --degree 1 --method sindy --out ramp.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NEAR(coefficient(io::load<IdentifiedModel>(folder / "ramp.json"), "x'", "t"), 0.5, 1e-4);
}

TEST(IdentifyGeneralE2e, BoundsBetweenCoefficientsAndAStableLinearPart) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  const Outcome o = folder.whirl(
      "identify run.csv --states x,v --inputs u --bound \"[v': x] - [v': x^3] <= -0.1\" --stable-1s 0.2 --no-holdout "
      "--out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto m = io::load<IdentifiedModel>(folder / "model.json");
  EXPECT_NEAR(coefficient(m, "v'", "x") - coefficient(m, "v'", "x^3"), -0.1, 1e-6);
  EXPECT_NEAR(coefficient(m, "v'", "v"), -0.4, 1e-4);  // half the trace is the rate
  EXPECT_NE((o.out + o.err).find("the bound [v': x] - [v': x^3] <= -0.1 is active"), std::string::npos) << o.out;
  EXPECT_NE((o.out + o.err).find("decay of the linear part"), std::string::npos);
  const Outcome typing = folder.whirl("identify run.csv --states x,v --inputs u --bound \"[v': q] <= 0\"");
  EXPECT_EQ(typing.exit_code, 2);
  EXPECT_NE(typing.err.find("v': x^3"), std::string::npos) << typing.err;
}

TEST(IdentifyGeneralE2e, ATrappingModelCarriesItsCertificate) {
  const Folder folder;
  io::write_csv(folder / "flow.csv",
                whirl::testing::flow_record(whirl::testing::convection(541), {-8, 7, 27}, 0.005, 4000, 0.01, 541));
  const Outcome o = folder.whirl("identify flow.csv --states x,y,z --trapping --out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NE(o.out.find("every motion ends within"), std::string::npos) << o.out;
  const io::Json file = io::load_json(folder / "model.json");
  const io::Json* trapping = file.find("evidence")->find("trapping");
  ASSERT_NE(trapping, nullptr);
  EXPECT_LT(*trapping->find("eigenvalue_1_s")->get<double>(), 0);
  const auto m = io::load<IdentifiedModel>(folder / "model.json");
  EXPECT_NEAR(coefficient(m, "y'", "x*z") + coefficient(m, "z'", "x*y"), 0, 1e-9);
  const Outcome cubic = folder.whirl("identify flow.csv --states x,y,z --trapping --degree 3");
  EXPECT_EQ(cubic.exit_code, 2);
  EXPECT_NE(cubic.err.find("--degree 2"), std::string::npos) << cubic.err;
}

TEST(IdentifyGeneralE2e, ALibraryFileGivesTermsTiesAndKnownParts) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  folder.write("library.toml",
               "equations = [\"x'\", \"v'\"]\n"
               "[terms]\n\"v'\" = [\"x\", \"x^2\", \"x^3\", \"u\", \"v^3\"]\n"
               "[known]\n\"x'\" = \"v\"\n"
               "[[group]]\nname = \"c\"\ncoefficient = \"C/m\"\nterms = [\"0\", \"-v\"]\n");
  const Outcome o = folder.whirl("identify run.csv --library library.toml --out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const auto m = io::load<IdentifiedModel>(folder / "model.json");
  ASSERT_NE(m.parameter("c"), nullptr);
  EXPECT_NEAR(m.parameter("c")->value, 0.3, 0.003);
  EXPECT_NEAR(coefficient(m, "v'", "x^3"), -1, 0.01);
  EXPECT_TRUE(std::isnan(coefficient(m, "v'", "x^2")));
  EXPECT_EQ(coefficient(m, "x'", "v"), 1);
  EXPECT_NE(o.out.find("held out"), std::string::npos);
  const Outcome table = folder.whirl("identify run.csv --library library.toml --compare");
  ASSERT_EQ(table.exit_code, 0) << table.err;
  for (const char* row : {"stlsq", "best_subset", "sindy (default)"})
    EXPECT_FALSE(lines_with(table.out, row).empty()) << table.out;

  // Left-hand sides say states and order; flags may repeat them, not contradict.
  folder.write("second.toml", "equations = [\"x''\"]\ncommon = [\"x\", \"x'\", \"x^3\", \"u\"]\n");
  const Outcome second = folder.whirl(
      "identify run.csv --library second.toml --states x --order 2 --inputs u --no-holdout --out second.json");
  ASSERT_EQ(second.exit_code, 0) << second.err;
  EXPECT_NEAR(coefficient(io::load<IdentifiedModel>(folder / "second.json"), "x''", "x^3"), -1, 0.02);
  for (const char* flags :
       {"--states v", "--order 1", "--discrete", "--inputs v", "--degree 2", "--known \"x' = v\"", "--method weak"}) {
    const Outcome refused = folder.whirl(std::string("identify run.csv --library second.toml ") + flags);
    EXPECT_EQ(refused.exit_code, 2) << flags << "\n" << refused.out;
  }
  // A file without equations serves those asked for.
  folder.write("common.toml", "common = [\"x\", \"v\", \"x^3\", \"u\"]\n");
  EXPECT_EQ(folder.whirl("identify run.csv --library common.toml --inputs u --no-holdout").exit_code, 0);
  folder.write("typo.toml", "equations = [\"x'\"]\ncomon = [\"x\"]\n");
  EXPECT_EQ(folder.whirl("identify run.csv --library typo.toml").exit_code, 2);
}

TEST(IdentifyGeneralE2e, EveryRegressorCanBeNamed) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  for (const char* flags :
       {"stlsq --threshold 0.05", "lasso --selection bic --debias", "sr3 --nu 0.5", "ensemble --resamples 20 --seed 3",
        "frols --max-terms 6", "backward --backward-t 6", "lasso --lambda 0.01", "ridge --ridge 1e-6"}) {
    const Outcome o = folder.whirl(
        std::string("identify run.csv --states x,v --inputs u --no-refine --no-holdout --regressor ") + flags);
    EXPECT_EQ(o.exit_code, 0) << flags << "\n" << o.err;
    EXPECT_NE(o.out.find("x³"), std::string::npos) << flags << "\n" << o.out;
  }
  const Outcome wrong = folder.whirl("identify run.csv --method sindy --regressor omp");
  EXPECT_EQ(wrong.exit_code, 2);
}

TEST(IdentifyCompareE2e, OneRowPerMethodForRotorsAndForAnySystem) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  Outcome o = folder.whirl("identify run.csv --states x,v --inputs u --compare");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  for (const char* row : {"ols", "lasso ", "sqrt_lasso", "lspl", "stlsq", "sr3", "ssr", "frols", "best_subset",
                          "backward", "ensemble", "sindy (default)"}) {
    EXPECT_EQ(lines_with(o.out, row).empty(), false) << row << "\n" << o.out;
  }
  ASSERT_EQ(folder.whirl("rig record --added-mass-g 5 --snr-db 20 --out rotor.csv").exit_code, 0);
  o = folder.whirl("identify rotor.csv --compare --json --out comparison.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  const io::Json table = io::load_json(folder / "comparison.json");
  const io::Json::Array& rows = *table.find("methods")->get<io::Json::Array>();
  ASSERT_EQ(rows.size(), 16u);
  double least = INFINITY;
  std::string best;
  for (const io::Json& row : rows) {
    const io::Json::Array& scores = *row.find("held_out")->find("free_run")->get<io::Json::Array>();
    ASSERT_EQ(scores.size(), 2u) << *row.find("method")->get<std::string>();
    const double* error = scores.front().find("rmse")->get<double>();
    if (error != nullptr && *error < least) {
      least = *error;
      best = *row.find("method")->get<std::string>();
    }
    EXPECT_GE(*row.find("seconds")->get<double>(), 0);
  }
  EXPECT_EQ(best, "weak (default)");
}

struct Spoiler {
  const char* name;
  std::function<void(Recording&)> spoil;
  const char* reason;
};
Eigen::VectorXd& channel(Recording& r, const char* name) {
  for (Channel& c : r.channels) {
    if (c.name == name) return c.samples;
  }
  throw Error("no such channel");
}
/// 12345 stands for infinity, which the writer refuses.
void write_spoilt(const Folder& folder, const std::string& file, const Recording& r) {
  io::write_csv(folder / file, r);
  std::string text = slurp(folder / file);
  const auto at = text.find(",12345");
  if (at != std::string::npos) text.replace(at, 6, ",inf");
  folder.write(file, text);
}
void keep(Recording& r, Eigen::Index n) {
  for (Channel& c : r.channels) c.samples = c.samples.head(n).eval();
}

TEST(IllPosedE2e, NeverAModelWithExitCodeZero) {
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig record --added-mass-g 5 --out good.csv").exit_code, 0);
  const Recording rotor = io::read_csv(folder / "good.csv");
  const Spoiler of_rotor[] = {
      {"constant", [](Recording& r) { channel(r, "y").setConstant(1e-4); }, "constant"},
      {"equal", [](Recording& r) { channel(r, "y") = channel(r, "x"); }, "same signal"},
      {"ten", [](Recording& r) { keep(r, 10); }, "samples"},
      {"tiny", [](Recording& r) { channel(r, "x") *= 1e-300, channel(r, "y") *= 1e-300; }, "constant"},
      {"zero", [](Recording& r) { channel(r, "x").setZero(), channel(r, "y").setZero(); }, "constant"},
      {"turn", [](Recording& r) { keep(r, 34); }, "turn"},
      {"infinite", [](Recording& r) { channel(r, "x")[500] = 12345; }, "finite"},
  };
  for (const Spoiler& s : of_rotor) {
    Recording r = rotor;
    s.spoil(r);
    const std::string file = std::string(s.name) + ".csv";
    write_spoilt(folder, file, r);
    for (const char* method : {"weak", "paper", "consistent"}) {
      const Outcome o = folder.whirl("identify " + file + " --method " + method);
      EXPECT_TRUE(o.exit_code == 1 || o.exit_code == 2) << s.name << " " << method << "\n" << o.out << o.err;
      EXPECT_NE(o.err.find(s.reason), std::string::npos) << s.name << " " << method << "\n" << o.err;
    }
    const Outcome compare = folder.whirl("identify " + file + " --compare");
    EXPECT_TRUE(compare.exit_code == 1 || compare.exit_code == 2) << s.name << "\n" << compare.out << compare.err;
  }
  const Spoiler of_any[] = {
      {"state constant", [](Recording& r) { channel(r, "x").setConstant(2); }, "constant"},
      {"input constant", [](Recording& r) { channel(r, "u").setConstant(2); }, "constant"},
      {"equal columns", [](Recording& r) { channel(r, "v") = channel(r, "x"); }, "same signal"},
      {"ten samples", [](Recording& r) { keep(r, 10); }, "samples"},
      {"tiny values", [](Recording& r) { channel(r, "x") *= 1e-300; }, "range of numbers"},
      {"all zero", [](Recording& r) { channel(r, "x").setZero(), channel(r, "v").setZero(); }, "zero"},
      {"infinite", [](Recording& r) { channel(r, "x")[500] = 12345; }, "finite"},
  };
  for (const Spoiler& s : of_any) {
    Recording r = duffing();
    s.spoil(r);
    write_spoilt(folder, "spoilt.csv", r);
    for (const char* flags :
         {"--states x,v --inputs u", "--states x,v --inputs u --no-refine", "--states x,v --inputs u --compare",
          "--method second-order --output-channel x --input-channel u"}) {
      if (std::string(s.name) == "equal columns" && std::string(flags).find("second-order") != std::string::npos)
        continue;
      const Outcome o = folder.whirl(std::string("identify spoilt.csv ") + flags);
      EXPECT_TRUE(o.exit_code == 1 || o.exit_code == 2) << s.name << " " << flags << "\n" << o.out << o.err;
      EXPECT_NE(o.err.find(s.reason), std::string::npos) << s.name << " " << flags << "\n" << o.err;
    }
  }
}

TEST(IdentifyGeneralE2e, SignsOfCoefficientsAreKeptAndActiveOnesTold) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  Outcome o = folder.whirl(
      "identify run.csv --states x,v --inputs u --sign \"v':v=-\" --sign v:x^3=- --sign x^2=+ --out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NE(o.out.find("sign bound        v': v <= 0 is not active: the term is in the model"), std::string::npos)
      << o.out;
  EXPECT_NE(o.out.find("sign bound        v': x^2 >= 0 is not active: the term is not needed"), std::string::npos)
      << o.out;
  const io::Json file = io::load_json(folder / "model.json");
  const io::Json* bounds = file.find("evidence")->find("bounds");
  EXPECT_EQ(bounds->get<io::Json::Array>()->size(), 4u);  // x^2 in both equations
  EXPECT_NEAR(coefficient(io::load<IdentifiedModel>(folder / "model.json"), "v'", "x^3"), -1, 0.01);

  // A map whose second coefficient is -0.3, held at 0.
  std::string text = "t_s,x_1,p_1,q_1\n";
  double x = 0;
  for (int k = 0; k < 300; ++k) {
    const double p = std::sin(1.7 * k), q = std::cos(2.9 * k + 1);
    text += fmt::format("{},{:.17g},{:.17g},{:.17g}\n", k, x, p, q);
    x = 2 * p - 0.3 * q;
  }
  folder.write("map.csv", text);
  o = folder.whirl("identify map.csv --discrete --states x --inputs p,q --terms p,q --sign q=+ --out map.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NE(o.out.find("x[k+1]: q >= 0 is active: held at 0, no interval; without the bound about -0.3"),
            std::string::npos)
      << o.out;
  EXPECT_TRUE(std::isnan(coefficient(io::load<IdentifiedModel>(folder / "map.json"), "x[k+1]", "q")));
  o = folder.whirl("identify map.csv --discrete --states x --inputs p,q --terms p,q --sign q=+ --stream");
  EXPECT_NE(o.out.find("x[k+1]: q >= 0 is active"), std::string::npos) << o.out << o.err;

  o = folder.whirl("identify run.csv --states x,v --inputs u --degree 1 --sign w=+");
  EXPECT_EQ(o.exit_code, 2);
  EXPECT_NE(o.err.find("w: must be a term of the library (v': 1, x, v, u; x': 1, x, v, u)"), std::string::npos)
      << o.err;
  folder.write("library.toml", "equations = [\"x''\"]\ncommon = [\"x\", \"x'\"]\n");
  for (const char* flags :
       {"--method weak --sign x=+", "--method second-order --output-channel x --sign x=+", "--states x,v --sign x",
        "--states x,v --sign x=2", "--states x,v --sign :x=+", "--states x,v --sign q:x=+",
        "--states x,v --sign x=+ --sign \"v':x=-\"", "--library library.toml --sign x=-"}) {
    const Outcome refused = folder.whirl(std::string("identify run.csv ") + flags);
    EXPECT_EQ(refused.exit_code, 2) << flags << "\n" << refused.out;
  }
}

TEST(IdentifyGeneralE2e, FlagsOfAnotherMethodAreRefused) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing(300));
  for (const char* flags : {"--method weak --degree 3", "--method consistent --terms x",
                            "--method second-order --output-channel x --states x", "--method sindy --filter-ms 5",
                            "--states x,v --inputs u --angle profile", "--states x,v --max-passes 0"}) {
    const Outcome o = folder.whirl(std::string("identify run.csv ") + flags);
    EXPECT_EQ(o.exit_code, 2) << flags << "\n" << o.out;
  }
}

// Every flag in a section of its methods is refused where another one runs, also when its value is the default.
TEST(IdentifyGeneralE2e, NoFlagOfAnotherMethodIsPassedOver) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing(300));
  folder.write("a.toml", "equations = [\"x''\"]\ncommon = [\"x\"]\n");
  std::istringstream help(folder.whirl("identify --help-all").out);
  const std::regex flag("^  (--[a-z0-9-]+)( [A-Z]+)?"), choice("\\{([a-z0-9_-]+)");
  bool sections = false;
  int found = 0;
  for (std::string line, name; std::getline(help, line);) {
    std::smatch match, word;
    if (line == "Rotor:" || line == "ROTOR:") sections = true;
    if (!sections || !std::regex_search(line, match, flag)) continue;
    name = match[1];
    std::string call = name;
    if (match[2].matched)
      call += std::regex_search(line, word, choice) ? "=" + word[1].str() : name == "--library" ? "=a.toml" : "=5e-1";
    if (line.find(" INT") != std::string::npos || line.find(" UINT") != std::string::npos) call = name + "=2";
    if (name == "--angle") call = "--angle=profile";
    bool refused = false;
    for (const char* method : {"weak", "consistent", "sindy"}) {
      const Outcome o = folder.whirl("identify run.csv " + call + " --method " + method);
      refused = refused || o.err.find(name + " is for --method") != std::string::npos;
      if (o.exit_code == 2 && refused) break;
    }
    EXPECT_TRUE(refused) << call;
    ++found;
  }
  EXPECT_GE(found, 50);
  for (const char* misspelt : {"--ouput", "--output"}) {
    const Outcome o = folder.whirl(std::string("identify run.csv ") + misspelt + " m.json");
    EXPECT_NE(o.err.find("did you mean '--out'?"), std::string::npos) << o.err;
  }
}

TEST(IdentifyGeneralE2e, ADriverTakenForAStateIsTold) {
  const Folder folder;
  io::write_csv(folder / "run.csv", duffing());
  const Outcome o = folder.whirl("identify run.csv --method sindy");
  EXPECT_EQ(o.exit_code, 1) << o.out;
  EXPECT_NE(o.err.find("should be an input; least explained is u'"), std::string::npos) << o.err;
}

}  // namespace
}  // namespace whirl::testing
