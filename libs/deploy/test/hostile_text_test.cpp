#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <sstream>

#include "whirl/core/error.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/deploy/languages.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/report/document.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"
#include "whirl/testing/source/tokens.hpp"

// What stands in a result file came from somebody: whatever it says, it is refused or the source made of it has the
// tokens that it has with harmless text.
namespace whirl::deploy {
namespace {

const std::vector<std::string>& hostile() {
  static const std::vector<std::string> texts{
      "X5*/ __attribute__((constructor)) static void evil(void){ extern int system(const char*); system(\"id\"); } /*",
      "1\n}\nimport os; os.system(\"id\")\nY = { #",
      "*/",
      "/*",
      "*/*",
      "/*/",
      "m*/s",
      "//",
      "\n",
      "\r",
      "\r\nimport os",
      "\x0b"
      "import os",
      "a\\",
      "\\",
      "\"",
      "\"\"\"",
      "\"\"\"\nimport os\n\"\"\"",
      "\\\"\"\"",
      "'",
      "''' + __import__('os').system('id') + '''",
      "#include </etc/passwd>",
      "#if HAS_EVENTS",
      "R(nonsense)",
      "R(1.0",
      "M(sin(",
      "/*@banner@*/",
      "whirl_x); system(\"id\"",
      "%{",
      "%\nsystem('id')",
      "end; system('id'); %",
      "\\input{/etc/passwd}",
      "$\\write18{id}$",
      "}{\\immediate\\write18{id}",
      "\xE2\x80\xA8system('id')",
      "\xE2\x80\xAE/* \xE2\x81\xA6",
      "\xff\xfe",
      "\xC2\x85"
      "import os",
      "?"
      "?/",
      "x\xCC\x88",
      "</script><script>alert(1)</script>",
      "\"/><Float64 name=\"evil",
      "]]>",
      "&#10;",
      "a b",
      "x;y",
      "{0}{}",
      "-X1+system",
      "X1'\"]\nevil = [\""};
  return texts;
}

IdentifiedModel harmless() {
  IdentifiedModel m;
  m.method = "weak";
  m.states = {"X1", "X2"};
  m.inputs = {"u1", "X6"};
  m.parameters = {{"k1", {5667.1, 3.2, 5660, 5674}}};
  m.equations = {{"X2'", {{"X1", {-5667.1, 3.2, -5674, -5660}, "1/s^2"}, {"sgn(X2)*u1", {1, 0.1, 0.9, 1.1}, "m/s^2"}}}};
  m.sample_time = 1e-3;
  m.summary.trust = "within the record";
  m.summary.warnings = {"short record"};
  m.provenance = {"0.2.0", {"a.csv sha256:00"}, "rate=1000", 42};
  return m;
}

using Place = std::function<void(IdentifiedModel&, CodeOptions&, const std::string&)>;
const std::vector<std::pair<const char*, Place>>& places() {
  using M = IdentifiedModel;
  using O = CodeOptions;
  using S = std::string;
  static const std::vector<std::pair<const char*, Place>> all{
      {"state", [](M& m, O&, const S& s) { m.states[0] = s; }},
      {"input", [](M& m, O&, const S& s) { m.inputs[1] = s; }},
      {"unit", [](M& m, O&, const S& s) { m.equations[0].terms[0].unit = s; }},
      {"function", [](M& m, O&, const S& s) { m.equations[0].terms[0].function = s; }},
      {"left side", [](M& m, O&, const S& s) { m.equations[0].lhs = s; }},
      {"method", [](M& m, O&, const S& s) { m.method = s; }},
      {"parameter", [](M& m, O&, const S& s) { m.parameters[0].first = s; }},
      {"timing",
       [](M& m, O&, const S& s) {
         m.timing = {{s, Hold::zero, {}}};
       }},
      {"noise",
       [](M& m, O&, const S& s) {
         m.noise_correlation = {{s, 0.5}};
       }},
      {"trust", [](M& m, O&, const S& s) { m.summary.trust = s; }},
      {"warning", [](M& m, O&, const S& s) { m.summary.warnings[0] = s; }},
      {"options", [](M& m, O&, const S& s) { m.provenance.options = s; }},
      {"origin", [](M&, O& o, const S& s) { o.origin = s; }}};
  return all;
}

/// Every file of every form: its name and its tokens.
std::vector<std::pair<std::string, std::string>> all_forms(const IdentifiedModel& model, const CodeOptions& options) {
  std::vector<std::pair<std::string, std::string>> out;
  const auto add = [&](const std::string& form, const std::vector<SourceFile>& files) {
    for (const SourceFile& f : files) out.emplace_back(form + " " + f.name, testing::tokens(f.name, f.text));
  };
  for (const char* form : {"c", "latex", "matlab", "python", "sfunction", "modelica"})
    add(form, source_files(model, form, options));
  for (const int version : {2, 3}) {
    FmuOptions fmu;
    fmu.code = options;
    fmu.version = version;
    add("fmu", fmu_files(model, fmu));
  }
  return out;
}

using Forms = std::vector<std::pair<std::string, std::string>>;

/// The file that has other tokens and the first of its lines that has; empty: none.
std::string difference(const Forms& found, const Forms& expected) {
  if (found.size() != expected.size()) return "other files";
  for (std::size_t i = 0; i < found.size(); ++i) {
    if (found[i] == expected[i]) continue;
    std::istringstream a(found[i].second), b(expected[i].second);
    std::string left, right;
    while (std::getline(a, left) && std::getline(b, right) && left == right) {
    }
    return found[i].first + ": " + left + "\n  in place of: " + right;
  }
  return {};
}

TEST(HostileTextExport, FilesAreRefusedOrTheTokensStay) {
  const CodeOptions plain{"plant", false, "model.json sha256:00"};
  const auto expected = all_forms(harmless(), plain);
  int refused = 0, exported = 0;
  for (const std::string& text : hostile()) {
    for (const auto& [place, put] : places()) {
      IdentifiedModel model = harmless();
      CodeOptions options = plain;
      put(model, options, text);
      const std::string file = io::to_json(model).dump();
      try {
        model = io::from_json<IdentifiedModel>(io::parse_json(file, "m.json"), "m.json");
      } catch (const Error& e) {
        ++refused;
        EXPECT_NE(std::string_view(e.what()).find("m.json: $."), std::string_view::npos) << e.what();
        continue;
      }
      ++exported;
      try {
        EXPECT_EQ(difference(all_forms(model, options), expected), "") << place << ": " << text;
      } catch (const Error&) {  // a name that the equations do not have
      }
    }
  }
  EXPECT_GT(refused, 200);
  EXPECT_GT(exported, 100);
}

// A program that makes a model itself meets the same rule.
TEST(HostileTextExport, ModelsMadeInAProgramAreNoWayAround) {
  const CodeOptions plain{"plant", false, "model.json"};
  const auto expected = all_forms(harmless(), plain);
  for (std::size_t i = 0; i < hostile().size(); i += 3) {
    const std::string& text = hostile()[i];
    for (const auto& [place, put] : places()) {
      IdentifiedModel model = harmless();
      CodeOptions options = plain;
      put(model, options, text);
      try {
        EXPECT_EQ(difference(all_forms(model, options), expected), "") << place << ": " << text;
      } catch (const Error&) {
      }
    }
  }
}

TEST(HostileTextExport, ControllersNameTheirOriginInAComment) {
  const ControllerDesign design = testing::design_of("pd", "lpf");
  const auto all = [&](const std::string& origin) {
    std::vector<std::string> out;
    for (const char* form : {"c", "latex", "matlab", "python", "sfunction"}) {
      for (const SourceFile& f : source_files(design, form, {"drive", false, origin}))
        out.push_back(testing::tokens(f.name, f.text));
    }
    return out;
  };
  const auto expected = all("controller.json");
  for (std::size_t i = 0; i < hostile().size(); i += 6) EXPECT_EQ(all(hostile()[i]), expected) << hostile()[i];
}

// Names that are words of a language or of the file made get an underscore more.
TEST(HostileTextExport, WordsOfTheLanguageGetOtherNames) {
  IdentifiedModel model = harmless();
  model.states = {"import", "p"};
  model.inputs = {"state", "end"};
  model.equations = {{"import'", {{"p", {1, 0, 1, 1}, ""}}}, {"p'", {{"import*state", {2, 0, 2, 2}, ""}}}};
  const std::string python = source_files(model, "python", {"plant", false, ""})[0].text;
  EXPECT_NE(python.find("[import_, p_] = state\n    [state_, end] = inputs"), std::string::npos) << python;
  const std::string matlab = source_files(model, "matlab", {"plant", false, ""})[0].text;
  EXPECT_NE(matlab.find("end_ = input(2);"), std::string::npos) << matlab;
  if (!testing::has_program("python3")) GTEST_SKIP() << "python3 is not installed";
  const testing::TemporaryFolder folder;
  folder.write("plant.py", python);
  const auto run = testing::shell(folder.path(), "python3 -c 'import plant; print(plant.rates(0, [3, 5], [7, 0]))'");
  EXPECT_EQ(run.text, "[5.0, 42.0]\n");
}

TEST(HostileTextExport, TomlAndPagesKeepTheirStructure) {
  for (const std::string& text : hostile()) {
    expr::CandidateLibrary library = io::parse_library_toml("equations = [\"x'\"]\ncommon = [\"x\"]", "l");
    library.groups[0].name = text;
    library.groups[0].coefficient = "K/m";
    try {
      const auto back = io::parse_library_toml(io::to_toml(library, {text}), "l");
      EXPECT_EQ(back.groups.size(), 1U);
      EXPECT_EQ(back.groups[0].name, text);
    } catch (const Error&) {  // no label, or no UTF-8
    }
    const std::string entry = io::to_toml(std::vector<io::TomlEntry>{{"a", "key", text, text}});
    EXPECT_EQ(std::count(entry.begin(), entry.end(), '\n'), 2) << entry;

    const auto page = [](const std::string& s) {
      report::Document document;
      document.title = s;
      document.blocks = {report::Heading{2, s}, report::Paragraph{s}, report::Code{s}, report::KeyValues{{{s, s}}}};
      const std::string html = report::to_html(document);
      return std::count(html.begin(), html.end(), '<');
    };
    EXPECT_EQ(page(text), page("harmless")) << text;
  }
}

}  // namespace
}  // namespace whirl::deploy
