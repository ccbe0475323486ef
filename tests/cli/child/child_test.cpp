// Most tests of the command line call the program's code in a child of theirs: it does what the program does.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../made_files.hpp"

namespace whirl::testing {
namespace {

TEST(ChildUnit, WordsAreThoseOfTheShell) {
  using Words = std::vector<std::string>;
  EXPECT_EQ(plain_words(""), Words{});
  EXPECT_EQ(plain_words(" a  'b c'd \"\" --e='1,2' \"[f]\""), (Words{"a", "b cd", "", "--e=1,2", "[f]"}));
  for (const char* call : {"a; b", "a >b", "a $B", "*.csv", "a `b`", "a \"$B\"", "a 'b", "~/a", "a\nb", "a\\ b", "a#b"})
    EXPECT_FALSE(plain_words(call)) << call;
}

TEST(ChildE2e, ACallInAChildIsOneOfTheProgram) {
  const Folder folder;
  copy_made(folder);
  for (const char* call :
       {"--version", "--help", "identify --help-all", "", "info record.csv pull.csv", "info record.csv --json",
        "info none.csv", "stiffness pull.csv --out 'a b.json' --force", "modes frf.json --json",
        "run controller.json --log o.h5 --force --quiet", "margins controller.json model.json --mass-kg 1.5",
        "runup model.json --from-rpm 300 --to-rpm 1900 --limit-mm 0.0001", "identify record.csv --method wek"}) {
    const Outcome child = folder.whirl(call), program = folder.shell("'" + testing::program() + "' " + call);
    EXPECT_EQ(child.exit_code, program.exit_code) << call;
    EXPECT_EQ(child.out, program.out) << call;
    EXPECT_EQ(child.err, program.err) << call;
    EXPECT_GT(child.out.size() + child.err.size(), 5U) << call;
  }
}

}  // namespace
}  // namespace whirl::testing
