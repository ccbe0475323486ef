#include <gtest/gtest.h>

#include <map>

#include "made_files.hpp"

namespace whirl::testing {
namespace {

namespace fs = std::filesystem;

struct WrittenCall {
  const char* arguments;  ///< OUT stands for the output
  const char* input;      ///< that must not be lost
};

/// Every subcommand that reads a file and writes one, once per pair of flags.
const WrittenCall kCalls[] = {
    {"convert record.csv OUT", "record.csv"},
    {"stiffness pull.csv --out OUT", "pull.csv"},
    {"stiffness pull.csv --figure OUT", "pull.csv"},
    {"frf blow_1.csv blow_2.csv --out OUT", "blow_2.csv"},
    {"frf blow_1.csv --figure OUT", "blow_1.csv"},
    {"modes frf.json --out OUT", "frf.json"},
    {"modes frf.json --compare modes.json --out OUT", "modes.json"},
    {"derive system.toml --out OUT", "system.toml"},
    {"derive system.toml --model model.json --out OUT", "model.json"},
    {"identify record.csv --no-holdout --out OUT", "record.csv"},
    {"identify record.csv --no-holdout --modes modes.json --out OUT", "modes.json"},
    {"validate model.json record.csv --out OUT", "model.json"},
    {"validate model.json record.csv --out OUT", "record.csv"},
    {"validate model.json record.csv --clean blow_1.csv --out OUT", "blow_1.csv"},
    {"design model.json --mass-kg 1.5 --law pd --estimator lpf --evaluations 1 --out OUT", "model.json"},
    {"design model.json --stiffness stiff.json --law pd --estimator lpf --evaluations 1 --out OUT", "stiff.json"},
    {"design model.json --mass-kg 1.5 --hardware rig.toml --law pd --estimator lpf --evaluations 1 --out OUT",
     "rig.toml"},
    {"run controller.json --log OUT", "controller.json"},
    {"run controller.json --rig rig.toml --log OUT", "rig.toml"},
    {"robustness controller.json model.json --mass-kg 1.5 --samples 10 --checkpoint OUT", "model.json"},
    {"plot record.csv --what traces --out OUT", "record.csv"},
    {"report record.csv model.json --out OUT", "model.json"},
    {"rig record --rig rig.toml --out OUT", "rig.toml"},
    {"rig campbell --rig rig.toml --out OUT", "rig.toml"},
    {"oma record.csv --out OUT", "record.csv"},
    {"decay record.csv --out OUT", "record.csv"},
    {"sine record.csv --out OUT", "record.csv"},
    {"simulate model.json --from-rpm 300 --to-rpm 900 --seconds 1 --out OUT", "model.json"},
    {"response model.json --from-rpm 300 --to-rpm 900 --out OUT", "model.json"},
    {"response model.json --from-rpm 300 --to-rpm 900 --peak-figure OUT", "model.json"},
    {"runup model.json --from-rpm 300 --to-rpm 900 --figure OUT", "model.json"},
    {"balance model.json --mass-kg 1.5 --radius-mm 83 --speed-rpm 1800 --html OUT", "model.json"},
    {"rig serve --rig rig.toml --io OUT --log l.csv", "rig.toml"},
};

std::string with_output(const std::string& arguments, const std::string& out) {
  std::string call = arguments;
  return call.replace(call.find("OUT"), 3, out);
}

TEST(OutputsE2e, NoSubcommandWritesOverItsInputUnderAnyName) {
  int lost = 0, calls = 0;
  for (const WrittenCall& call : kCalls) {
    const Folder folder;
    copy_made(folder);
    const std::string before = slurp(folder / call.input);
    ASSERT_FALSE(before.empty()) << call.input;
    fs::create_directory(folder / "sub");
    fs::create_symlink(folder / call.input, folder / "symbolic.csv");
    fs::create_hard_link(folder / call.input, folder / "hard.csv");
    fs::create_directory_symlink(folder / ".", folder / "again");
    for (const std::string& out :
         {std::string(call.input), "./sub/../" + std::string(call.input), std::string("symbolic.csv"),
          std::string("hard.csv"), "again/" + std::string(call.input), (folder / call.input).string()}) {
      for (const char* force : {"", " --force"}) {
        const Outcome outcome = folder.whirl(with_output(call.arguments, out) + force + " --quiet");
        ++calls;
        EXPECT_EQ(outcome.exit_code, 2) << call.arguments << " with " << out;
        EXPECT_NE(outcome.err.find("is the input"), std::string::npos) << call.arguments << "\n" << outcome.err;
        if (slurp(folder / call.input) != before || !fs::is_symlink(folder / "symbolic.csv")) ++lost;
      }
      if (slurp(folder / call.input) != before)
        fs::copy_file(made() / call.input, folder / call.input, fs::copy_options::overwrite_existing);
    }
  }
  EXPECT_EQ(lost, 0) << "of " << calls;
}

TEST(OutputsE2e, AnOutputThatCannotBeWrittenIsRefusedBeforeTheWork) {
  const Folder folder;
  copy_made(folder);
  fs::create_directory(folder / "sub");
  folder.write("file", "x");
  for (const WrittenCall& call : kCalls) {
    for (const auto& [out, reason] :
         {std::pair{"nowhere/out.csv", "no folder nowhere"}, {"sub", "is a folder"}, {"file/out.csv", "no folder"}}) {
      const Outcome outcome = folder.whirl(with_output(call.arguments, out));
      EXPECT_EQ(outcome.exit_code, 2) << call.arguments << " with " << out;
      EXPECT_NE(outcome.err.find(reason), std::string::npos) << call.arguments << " with " << out << "\n"
                                                             << outcome.err;
      EXPECT_EQ(outcome.out, "") << call.arguments;
    }
  }
  const std::string long_name(300, 'n');
  // A folder is written: the name of a file made a folder "m.json".
  for (const char* call : {"margins controller.json model.json --mass-kg 1.5 --out m.json",
                           "robustness controller.json model.json --mass-kg 1.5 --out m.html",
                           "compare model.json --mass-kg 1.5 --out m.html"}) {
    const Outcome outcome = folder.whirl(call);
    EXPECT_EQ(outcome.exit_code, 2) << call;
    EXPECT_NE(outcome.err.find("a folder is written here"), std::string::npos) << call << outcome.err;
  }
  EXPECT_EQ(folder.whirl("identify record.csv --out " + long_name + ".json").exit_code, 2);
  for (const auto& file : fs::recursive_directory_iterator(folder / "."))
    EXPECT_EQ(file.path().string().find(".try"), std::string::npos) << file.path();
}

TEST(OutputsE2e, AnExistingFileOfAnotherKindNeedsForce) {
  const Folder folder;
  copy_made(folder);
  folder.write("notes.txt", "by hand\n");
  folder.write("page.html", "<!doctype html><title>mine</title>");
  const std::pair<const char*, const char*> calls[] = {
      {"stiffness pull.csv --out OUT", "model.json"},
      {"stiffness pull.csv --out OUT", "record.csv"},
      {"stiffness pull.csv --out OUT", "notes.txt"},
      {"stiffness pull.csv --out OUT", "system.toml"},
      {"stiffness pull.csv --figure OUT", "record.csv"},
      {"plot record.csv --what traces --out OUT", "blow_1.csv"},
      {"plot record.csv --what traces --out OUT", "pull.csv"},
      {"rig stiffness --out OUT", "record.csv"},
      {"rig record --out OUT", "pull.csv"},
      {"derive system.toml --out OUT", "model.json"},
      {"convert frf.json OUT", "model.json"},
      {"report pull.csv --out OUT", "model.json"},
  };
  for (const auto& [arguments, existing] : calls) {
    const std::string before = slurp(folder / existing);
    const std::string call = with_output(arguments, existing);
    const Outcome refused = folder.whirl(call);
    EXPECT_EQ(refused.exit_code, 2) << call;
    EXPECT_NE(refused.err.find("--force"), std::string::npos) << call << "\n" << refused.err;
    EXPECT_EQ(slurp(folder / existing), before) << call;
  }
  // Of the same kind it is what a repeated command does; with --force it is what was asked for.
  EXPECT_EQ(folder.whirl("stiffness pull.csv --out stiff.json").exit_code, 0);
  EXPECT_EQ(folder.whirl("rig record --out record.csv --seed 2").exit_code, 0);
  EXPECT_EQ(folder.whirl("stiffness pull.csv --figure f.csv --out modes.json --force").exit_code, 0);
  EXPECT_NE(slurp(folder / "modes.json").find("whirl.stiffness/"), std::string::npos);
  EXPECT_EQ(folder.whirl("stiffness pull.csv --figure f.csv").exit_code, 0);

  // Names that the command makes of a prefix.
  fs::copy_file(folder / "pull.csv", folder / "hit_1.csv");
  EXPECT_EQ(folder.whirl("rig hammer --out hit_").exit_code, 2);
  EXPECT_EQ(slurp(folder / "hit_1.csv"), slurp(folder / "pull.csv"));
  EXPECT_EQ(folder.whirl("rig hammer --out hit_ --force").exit_code, 0);
  EXPECT_EQ(folder.whirl("rig hammer --out hit_ --seed 2").exit_code, 0);
}

TEST(OutputsE2e, TwoOutputsOfOneNameAreRefused) {
  const Folder folder;
  copy_made(folder);
  const Outcome outcome = folder.whirl("rig record --out a.csv --truth ./a.csv");
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("--out"), std::string::npos) << outcome.err;
  EXPECT_FALSE(fs::exists(folder / "a.csv"));
}

TEST(OutputsE2e, NamesThatACommandChoosesDoNotTakeInputsEither) {
  const Folder folder;
  copy_made(folder);
  fs::rename(folder / "record.csv", folder / "figure_01.csv");
  const std::string before = slurp(folder / "figure_01.csv");
  EXPECT_EQ(folder.whirl("report figure_01.csv --figures . --formats csv --out page.html").exit_code, 2);
  EXPECT_EQ(slurp(folder / "figure_01.csv"), before);
  const std::string rig = slurp(folder / "rig.toml");
  EXPECT_EQ(folder.whirl("reproduce --rig rig.toml --out .").exit_code, 2);
  EXPECT_EQ(slurp(folder / "rig.toml"), rig);
  // The folder of the input is a fine place for other names.
  EXPECT_EQ(folder.whirl("export c controller.json --out .").exit_code, 0);
}

TEST(HelpE2e, FlagsOfTheExpertStandUnderHelpAllOnly) {
  const Folder folder;
  const Outcome everyday = folder.whirl("identify --help"), all = folder.whirl("identify --help-all");
  EXPECT_EQ(everyday.exit_code, 0);
  EXPECT_EQ(all.exit_code, 0);
  for (const char* flag : {"--out", "--method", "--regressor", "--help-all"})
    EXPECT_NE(everyday.out.find(flag), std::string::npos) << flag;
  for (const char* flag : {"--threshold", "--nu", "--folds", "--resamples"}) {
    EXPECT_EQ(everyday.out.find(flag), std::string::npos) << flag;
    EXPECT_NE(all.out.find(flag), std::string::npos) << flag;
  }
}

TEST(HelpE2e, HelpOfASubcommandAndHintsForMisspeltWords) {
  const Folder folder;
  EXPECT_EQ(folder.whirl("help").out, folder.whirl("--help").out);
  EXPECT_EQ(folder.whirl("help identify").out, folder.whirl("identify --help").out);
  EXPECT_EQ(folder.whirl("help rig record").out, folder.whirl("rig record --help").out);
  for (const auto& [call, hint] :
       std::map<std::string, std::string>{{"identfy r.csv", "'identify'"},
                                          {"rig recrod --out r.csv", "'record'"},
                                          {"io tset", "'test'"},
                                          {"help identfy", "'identify'"},
                                          {"design m.json --otu c.json", "'--out'"},
                                          {"design m.json --evalutions 5", "'--evaluations'"},
                                          {"plot --chanels x", "'--channels'"},
                                          {"run c.json --sed=4", "'--seed'"}}) {
    const Outcome outcome = folder.whirl(call);
    EXPECT_EQ(outcome.exit_code, 2) << call;
    EXPECT_NE(outcome.err.find("did you mean " + hint), std::string::npos) << call << "\n" << outcome.err;
  }
}

}  // namespace
}  // namespace whirl::testing
