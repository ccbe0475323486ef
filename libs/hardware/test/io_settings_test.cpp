#include "whirl/hardware/io_settings.hpp"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "whirl/testing/compiled.hpp"
#include "whirl/testing/paths.hpp"

namespace whirl::hardware {
namespace {

TEST(IoSettingsFile, TheOneOfTheDocumentsIsReadAndNamesItsBoard) {
  std::ifstream in(testing::source_dir() + "/docs/hardware.md");
  std::ostringstream all;
  all << in.rdbuf();
  const std::string text = all.str();
  const std::size_t from = text.find("```toml\n") + 8, to = text.find("```", from);
  ASSERT_LT(to, text.size());
  const testing::TemporaryFolder folder;
  folder.write("io.toml", text.substr(from, to - from));
  const IoSettings io = read_io(folder.path() / "io.toml");
  EXPECT_EQ(io.driver, "comedi");
  EXPECT_EQ(io.clock, "wall");
  EXPECT_EQ(io.loop().dt, rt::DtPolicy::fill);
  for (std::size_t i = 0; i < 2; ++i) {
    const rt::PositionInput& p = io.hardware.position[i];
    EXPECT_TRUE(p.laser.device.empty());
    EXPECT_EQ(p.analog, static_cast<int>(i));
    // 20 mA over the shunt stay inside the board's 10 V, and the middle of the range is the middle of the motion.
    EXPECT_LE(20e-3 * p.shunt, 10);
    EXPECT_DOUBLE_EQ(p.offset, 0.5 * p.laser.range);
  }
}

}  // namespace
}  // namespace whirl::hardware
