// A key between `whirl rig serve` and `whirl run --io`, over real wires.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "served.hpp"

namespace whirl::testing {
namespace {

using ::testing::HasSubstr;

struct BoardKeyE2e : ::testing::Test {
  Folder folder;
  BoardKeyE2e() {
    folder.write("rig.toml", kRig);
    io::save(folder / "controller.json", pd_design());
    key("key", "a key of both ends");
  }
  void key(const std::string& name, const std::string& secret) {
    folder.write(name, secret + "\n");
    ::chmod((folder / name).c_str(), 0600);
  }
};

TEST_F(BoardKeyE2e, TheLoopRunsWithTheKeyAndIsNotHeardWithAnother) {
  key("other", "a key of one end only");
  const Served served(folder, "--lockstep --rig rig.toml --board-key key");
  const std::string io = slurp(folder / "io.toml");
  served.be_patient();
  EXPECT_THAT(io, HasSubstr("key_file = \"" + (folder / "key").string() + "\""));
  std::string wrong = io;
  wrong.replace(wrong.find((folder / "key").string()), (folder / "key").string().size(), "other");  // beside io.toml
  // A board that stays silent is not waited for as long as one in lockstep.
  wrong.replace(wrong.find("watchdog_ms = "),
                wrong.find('\n', wrong.find("watchdog_ms = ")) - wrong.find("watchdog_ms = "), "watchdog_ms = 20");
  folder.write("wrong.toml", wrong);
  const Outcome refused = folder.whirl("run controller.json --io wrong.toml --json --quiet");
  EXPECT_EQ(refused.exit_code, 1) << refused.err;
  EXPECT_THAT(refused.out, HasSubstr("the board does not answer"));
  const Outcome good = folder.whirl("run controller.json --io io.toml --json --quiet");
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("\"armed\": true"));
  served.end();
  const io::Json json = io::parse_json(slurp(folder / "serve.json"), "serve.json");
  EXPECT_GT(io::JsonReader(json, "serve.json").at("refused").number(), 0);
}

TEST_F(BoardKeyE2e, NoKeyAKeyForAllEyesAndOneForAnotherBoardAreNamed) {
  const Outcome open = folder.whirl("rig serve --address 0.0.0.0:0");
  EXPECT_EQ(open.exit_code, 2);
  EXPECT_THAT(open.err, HasSubstr("--board-key FILE"));
  ::chmod((folder / "key").c_str(), 0644);
  const Outcome seen = folder.whirl("rig serve --board-key key");
  EXPECT_EQ(seen.exit_code, 2);
  EXPECT_THAT(seen.err, HasSubstr("chmod 600"));
  folder.write("iio.toml", "[board]\ndriver = \"comedi\"\nkey_file = \"key\"\n[loop]\nclock = \"wall\"\n");
  const Outcome other = folder.whirl("run controller.json --io iio.toml");
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("board.key_file"));
}

}  // namespace
}  // namespace whirl::testing
