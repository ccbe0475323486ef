#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>
#include <vector>

#include "fmu_models.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/deploy/fmu.hpp"
#include "whirl/deploy/system.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/designs.hpp"

// docs/export.md lists the same rules.
namespace whirl::deploy {
namespace {

using Rules = std::set<std::string>;

/// Exported files of several kinds in one folder, and what the checks say of their sources.
class Sources {
 public:
  void add(const std::vector<SourceFile>& files) {
    for (const SourceFile& f : files) {
      folder_.write(f.name, f.text);
      if (f.name.ends_with(".c") && !f.name.ends_with("_selftest.c")) names_ += " " + f.name;
    }
  }
  testing::ShellResult plain() const {
    return testing::shell(folder_.path(),
                          "cppcheck --quiet --std=c99 --enable=warning,style,performance,portability "
                          "--suppress=missingIncludeSystem --error-exitcode=1" +
                              names_);
  }
  /// Rules of MISRA C:2012 that the sources deviate from; `text`: what the check printed.
  Rules deviations(std::string& text) const {
    text = testing::shell(folder_.path(), "cppcheck --quiet --std=c99 --addon=misra" + names_).text;
    const std::regex rule("misra-c2012-([0-9.]+)");
    Rules found;
    for (std::sregex_iterator it(text.begin(), text.end(), rule), none; it != none; ++it) found.insert((*it)[1]);
    return found;
  }

 private:
  testing::TemporaryFolder folder_;
  std::string names_;
};

void expect_only(const Sources& sources, const Rules& listed) {
  if (!testing::has_program("cppcheck")) GTEST_SKIP() << "cppcheck is not installed";
  const auto plain = sources.plain();
  EXPECT_EQ(plain.exit_code, 0) << plain.text;
  std::string text;
  const Rules found = sources.deviations(text);
  if (text.find("Did not find addon") != std::string::npos) GTEST_SKIP() << "the MISRA addon is not installed";
  EXPECT_TRUE(found.contains("15.5")) << "the check did not run: " << text;
  EXPECT_EQ(found, listed) << text;
}

TEST(ControllerSourceExport, MisraCheckFindsOnlyTheListedDeviations) {
  Sources sources;
  const std::pair<const char*, const char*> pairs[] = {
      {"tsmc", "kfe"},          {"sta_implicit", "eso"}, {"pd_influence", "red_implicit"},
      {"tsmc_implicit", "lpf"}, {"pid", "kfo"},          {"mpc", "kalman"}};
  for (const auto& [law, estimator] : pairs) {
    const ControllerCode code = controller_code(testing::design_of(law, estimator), {law, false, ""});
    sources.add({code.header, code.source});
  }
  expect_only(sources, {"8.7", "15.5"});
}

TEST(ModelSourceExport, MisraCheckFindsOnlyTheListedDeviations) {
  Sources sources;
  sources.add(export_c99(rotor_model(), {"rotor", false, ""}));
  sources.add(export_c99(friction_oscillator(), {"friction", false, ""}));
  expect_only(sources, {"8.7", "15.5"});
}

TEST(FmuSourceExport, MisraCheckFindsOnlyTheListedDeviations) {
  Sources sources;
  for (const int version : {2, 3}) {
    FmuOptions options;
    options.version = version;
    const std::string number = std::to_string(version);
    options.code = {"drive" + number, false, ""};
    for (SourceFile f : fmu_files(testing::design_of("tsmc", "kfe"), options))
      sources.add({{"drive" + number + "/" + f.name, f.text}});
    options.code.prefix = "plant" + number;
    for (SourceFile f : fmu_files(rotor_model(), options)) sources.add({{"plant" + number + "/" + f.name, f.text}});
  }
  expect_only(sources, {"8.7", "15.5"});
}

}  // namespace
}  // namespace whirl::deploy
