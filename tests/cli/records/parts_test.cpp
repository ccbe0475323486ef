// Files that are read in parts, as a user meets them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../program.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/testing/records/foreign_files.hpp"

namespace whirl::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

TEST(PartsE2e, ConvertAndInfoInPartsGiveTheSameFileAndTheSameNumbers) {
  const Folder folder;
  Recording record;
  record.dt = 1.0 / 1024;
  for (const char* name : {"x", "y"})
    record.add(name, Quantity::displacement, Eigen::VectorXd::LinSpaced(5000, -1e-3, 2e-3).array().sin());
  for (const char* name : {"a.h5", "a.mat", "a.npz", "a.wav", "a.csv"}) {
    io::write_recording(folder / name, record);
    const std::string file = name;
    ASSERT_EQ(folder.whirl("convert " + file + " whole.csv").exit_code, 0) << name;
    const Outcome parts = folder.whirl("convert " + file + " parts.csv --stream");
    ASSERT_EQ(parts.exit_code, 0) << parts.err;
    EXPECT_EQ(slurp(folder / "whole.csv"), slurp(folder / "parts.csv")) << name;
    ASSERT_EQ(folder.whirl("convert " + file + " some.csv --rows 100:300").exit_code, 0);
    ASSERT_EQ(folder.whirl("convert " + file + " some_parts.csv --rows 100:300 --stream").exit_code, 0);
    EXPECT_EQ(slurp(folder / "some.csv"), slurp(folder / "some_parts.csv")) << name;
    const Outcome info = folder.whirl("info " + file + " --stream");
    ASSERT_EQ(info.exit_code, 0) << info.err;
    EXPECT_THAT(info.out, HasSubstr("2 channels, 5000 samples, 1024 Hz"));
    EXPECT_THAT(info.out, HasSubstr("read in parts: damage and vibration are not looked for"));
    EXPECT_THAT(folder.whirl("info " + file + " --rows 10:60").out, HasSubstr("2 channels, 50 samples, 1024 Hz"));
  }
  const Outcome tacho = folder.whirl("convert a.h5 b.csv --stream --pulses x:1");
  EXPECT_EQ(tacho.exit_code, 2);
  EXPECT_THAT(tacho.err, HasSubstr("read in parts"));
  folder.write("gap.csv", "t_s,x_mm\n0,1\n0.001,\n0.002,1\n0.003,2\n");
  EXPECT_THAT(
      folder.whirl("convert gap.csv b.csv --stream").err,
      AllOf(HasSubstr("gap.csv:3"), HasSubstr("empty in row 1"), HasSubstr("without --stream"), HasSubstr("--rows")));
  EXPECT_THAT(folder.whirl("convert a.h5 b.uff --stream").err, HasSubstr("a file ending in"));
}

// Twenty gigabytes that are not there: a sparse file.
TEST(PartsE2e, RowsOfAFileLargerThanTheMemory) {
  const Folder folder;
  const std::uintmax_t rows = 1'250'000'000;
  folder.write("x_m.npy", npy("'<f8'", "(1250000000, 2)", ""));
  const std::uintmax_t head = std::filesystem::file_size(folder / "x_m.npy");
  std::filesystem::resize_file(folder / "x_m.npy", head + 16 * rows);
  const Outcome o = folder.whirl("convert x_m.npy last.csv --rate 1000 --rows 1249999990:1250000000");
  ASSERT_EQ(o.exit_code, 0) << o.err;
  EXPECT_THAT(slurp(folder / "last.csv"), HasSubstr("1249999.999,0,0\n"));
  EXPECT_THAT(folder.whirl("info x_m.npy --rate 1000 --rows 0:1000").out, HasSubstr("2 channels, 1000"));
  const Outcome whole = folder.whirl("plot x_m.npy --rate 1000 --out a.svg");
  EXPECT_EQ(whole.exit_code, 2);
  EXPECT_THAT(whole.err,
              HasSubstr("larger than the limit of 1073741824 bytes; `whirl info` and `whirl convert` read it"));
}

}  // namespace
}  // namespace whirl::testing
