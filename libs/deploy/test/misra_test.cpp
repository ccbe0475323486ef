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
  /// `ending`: of those that are looked at.
  void add(const std::vector<SourceFile>& files, const char* ending = ".c") {
    for (const SourceFile& f : files) {
      folder_.write(f.name, f.text);
      if (f.name.ends_with(ending) && !f.name.ends_with("_selftest.c")) names_ += " " + f.name;
    }
  }
  testing::ShellResult plain(const std::string& checks) const {
    return testing::shell(folder_.path(), "cppcheck --quiet --std=c99 --enable=" + checks +
                                              " --suppress=missingIncludeSystem --error-exitcode=1" + names_);
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

/// Sources of one program at a time: what several have in common is no deviation.
void expect_only(const std::vector<const Sources*>& programs, const Rules& listed,
                 const std::string& checks = "warning,style,performance,portability") {
  if (!testing::has_program("cppcheck")) GTEST_SKIP() << "cppcheck is not installed";
  Rules found;
  std::string all;
  for (const Sources* sources : programs) {
    const auto plain = sources->plain(checks);
    EXPECT_EQ(plain.exit_code, 0) << plain.text;
    std::string text;
    found.merge(sources->deviations(text));
    if (text.find("Did not find addon") != std::string::npos) GTEST_SKIP() << "the MISRA addon is not installed";
    all += text;
  }
  EXPECT_FALSE(found.empty()) << "the check did not run: " << all;
  EXPECT_EQ(found, listed) << all;
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
  expect_only({&sources}, {"8.7", "15.5"});
}

// Without style: the analysis takes steps that are counted down for constant.
TEST(SupervisedSourceExport, MisraCheckFindsOnlyTheListedDeviations) {
  Sources sources;
  for (const auto& [law, reidentify] : {std::pair{"pd", 2}, std::pair{"lqr", 1}}) {
    ControllerDesign d = testing::design_of(law, "lpf");
    d.parameters = {{"supervise", 1}, {"reidentify", reidentify}};
    const ControllerCode code = controller_code(d, {law, false, ""});
    sources.add({code.header, code.source});
  }
  expect_only({&sources}, {"8.7", "15.5"}, "warning,performance,portability");
}

TEST(ModelSourceExport, MisraCheckFindsOnlyTheListedDeviations) {
  Sources rotor, friction;
  rotor.add(export_c99(rotor_model(), {"rotor", false, ""}));
  friction.add(export_c99(friction_oscillator(), {"friction", false, ""}));
  expect_only({&rotor, &friction}, {"2.5", "10.5"});
}

TEST(FmuSourceExport, MisraCheckFindsOnlyTheListedDeviations) {
  Sources drive2, drive3, plant2, plant3;
  FmuOptions options;
  options.code = {"drive", false, ""};
  drive2.add(fmu_files(testing::design_of("tsmc", "kfe"), options));
  plant2.add(fmu_files(rotor_model(), options));
  options.version = 3;
  // The controller is the same source in both versions.
  drive3.add(fmu_files(testing::design_of("tsmc", "kfe"), options), "_fmu.c");
  plant3.add(fmu_files(friction_oscillator(), options));
  // Style: the signatures are those of the standard, and the counts of one FMU make conditions constant.
  expect_only({&drive2, &drive3, &plant2, &plant3},
              {"2.3", "2.4", "2.5", "2.7", "8.4", "8.7", "10.4", "10.5", "10.6", "11.1", "11.5", "15.5", "20.1",
               "20.10", "21.3", "21.15"},
              "warning,performance,portability");
}

}  // namespace
}  // namespace whirl::deploy
