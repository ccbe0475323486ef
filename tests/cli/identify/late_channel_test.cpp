// Channels that are read at other instants, from the command line.
#include <gtest/gtest.h>

#include <cmath>

#include "../program.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/testing/systems/driven_oscillators.hpp"

namespace whirl::testing {
namespace {

TEST(LateChannelE2e, ItIsFoundToldAndBroughtToTheOthersInstants) {
  const Folder folder;
  const DrivenOscillator machine = drawn_oscillator(91);
  io::write_csv(folder / "run.csv", driven_record(machine, {.seed = 91, .noise = 0.01, .late = 0.5}));
  io::write_csv(folder / "other.csv", driven_record(machine, {.seed = 92, .seconds = 20, .noise = 0.01, .late = 0.5}));
  const Outcome o = folder.whirl("identify run.csv --states x,v --inputs u --out model.json");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NE((o.out + o.err).find("channel v is read"), std::string::npos) << o.out << o.err;
  EXPECT_NE((o.out + o.err).find("--late v=0.0"), std::string::npos) << o.out << o.err;
  const Outcome with = folder.whirl("validate model.json other.csv --late v=0.01");
  EXPECT_EQ(with.exit_code, 0) << with.out;
  EXPECT_EQ(with.err, "");
  const Outcome without = folder.whirl("validate model.json other.csv");
  EXPECT_NE(without.err.find("the free run of v leaves the record"), std::string::npos) << without.err;
}

TEST(LateChannelE2e, RowsAreThoseOfTheFile) {
  const Folder folder;
  io::write_csv(folder / "run.csv", driven_record(drawn_oscillator(93), {.seed = 93, .seconds = 10, .noise = 0}));
  ASSERT_EQ(folder.whirl("convert run.csv part.csv --rows 100:300 --late v=0.01").exit_code, 0);
  const Recording file = io::read_csv(folder / "run.csv"), part = io::read_csv(folder / "part.csv");
  ASSERT_EQ(part.size(), 199);  // the first was not read before
  EXPECT_EQ(part["x"][0], file["x"][101]);
  EXPECT_EQ(part["x"][198], file["x"][299]);
  const Eigen::VectorXd& v = file["v"];
  EXPECT_NEAR(part["v"][99], (9 * (v[199] + v[200]) - v[198] - v[201]) / 16, 1e-3 * v.cwiseAbs().maxCoeff());
  for (const char* wrong : {"--late v", "--late w=0.01", "--late v=100"}) {
    const Outcome o = folder.whirl(std::string("convert run.csv wrong.csv ") + wrong);
    EXPECT_EQ(o.exit_code, 2) << wrong;
    EXPECT_FALSE(o.err.empty());
    EXPECT_FALSE(std::filesystem::exists(folder / "wrong.csv"));
  }
}

}  // namespace
}  // namespace whirl::testing
