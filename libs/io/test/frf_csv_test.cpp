#include "whirl/io/frf_csv.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <complex>
#include <filesystem>
#include <fstream>

#include "whirl/core/error.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::io {
namespace {

using ::testing::HasSubstr;

std::string frf_csv_error(std::string_view text) {
  try {
    frf_from_table(parse_table(text, "f.csv"), FrfKind::accelerance);
  } catch (const Error& e) {
    return e.what();
  }
  return "no error";
}

TEST(FrfCsv, TheAxisMayHaveItsUsualNames) {
  for (const char* axis : {"freq_hz", "frequency_Hz", "Frequency [Hz]", "f [Hz]", "hz"}) {
    const std::string text = std::string(axis) + ",H_re,H_im\n5,1,2\n6,3,4\n7,5,6\n";
    const FrequencyResponse frf = frf_from_table(parse_table(text, "f.csv"), FrfKind::receptance);
    EXPECT_EQ(frf.frequency[2], 7) << axis;
    ASSERT_EQ(frf.channels.size(), 1u) << axis;
    EXPECT_EQ(frf.channels[0].value[1], std::complex<double>(3, 4)) << axis;
    const auto file = std::filesystem::path(::testing::TempDir()) / "frf_axis.csv";
    std::ofstream(file) << text;
    EXPECT_TRUE(read_responses(file, FrfKind::receptance).has_value()) << axis;
    std::filesystem::remove(file);
  }
}

TEST(FrfCsv, WrittenTableReadsBack) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "frf.csv";
  FrequencyResponse frf;
  frf.kind = FrfKind::mobility;
  frf.frequency = Eigen::VectorXd::LinSpaced(21, 5, 15);
  frf.channels = {{"3:+Z", "1:+Z", Eigen::VectorXcd::Random(21), Eigen::VectorXd::Constant(21, 0.9), {}},
                  {"4:+Z", "1:+Z", Eigen::VectorXcd::Random(21), {}, {}}};
  write_frf_csv(file, frf);
  const FrequencyResponse back = read_frf_csv(file, FrfKind::mobility);
  EXPECT_EQ(back.frequency, frf.frequency);
  ASSERT_EQ(back.channels.size(), 2u);
  EXPECT_EQ(back.channels[0].response, "H1");  // a colon cannot stand in a header
  EXPECT_EQ(back.channels[0].value, frf.channels[0].value);
  EXPECT_EQ(back.channels[0].coherence, frf.channels[0].coherence);
  EXPECT_EQ(back.channels[1].value, frf.channels[1].value);
  EXPECT_EQ(back.channels[1].coherence.size(), 0);
}

TEST(FrfCsv, RefusesWhatIsNoTableOfFrequencyResponses) {
  EXPECT_EQ(frf_csv_error("freq_hz,a_re,a_im\n1,2,3\n2,3,4\n"), "no error");
  EXPECT_THAT(frf_csv_error("freq_hz,a_re,a_im\n1,2,3\n2,3,4\n4,3,4\n"),
              HasSubstr("f.csv:3: frequency 2 Hz is not on a uniform"));
  EXPECT_THAT(frf_csv_error("freq_hz,a_re\n1,2\n2,3\n"), HasSubstr("no column 'a_im'"));
  EXPECT_THAT(frf_csv_error("freq_hz,a_re,a_im,x_mm\n1,2,3,4\n2,3,4,5\n"), HasSubstr("and no others"));
  EXPECT_THAT(frf_csv_error("freq_s,a_re,a_im\n1,2,3\n2,3,4\n"), HasSubstr("must be a frequency"));
}

TEST(FrfCsvReference, TheMeasuredBuildingHasNineChannels) {
  const auto file = testing::data_file("modal/building9.csv.gz");
  WHIRL_REQUIRE_DATA(file);
  const FrequencyResponse frf = read_frf_csv(file, FrfKind::accelerance);
  EXPECT_EQ(frf.channels.size(), 9u);
  EXPECT_EQ(frf.frequency.size(), 1601);
  EXPECT_EQ(frf.channels[8].response, "H9");
  EXPECT_EQ(frf.channels[1].value[1], std::complex<double>(0.01054944, 0.005403542));
}

}  // namespace
}  // namespace whirl::io
