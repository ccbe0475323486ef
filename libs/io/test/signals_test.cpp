#include "whirl/io/signals.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/io/atfx.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/info.hpp"
#include "whirl/io/uff.hpp"
#include "whirl/testing/data.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/paths.hpp"

namespace whirl::io {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using whirl::testing::error_of;

std::filesystem::path corpus(const std::string& file) {
  return std::filesystem::path(whirl::testing::source_dir()) / "tests/fuzz/corpus" / file;
}

class Folder {
 public:
  Folder() : path_(std::filesystem::temp_directory_path() / ("whirl_signals_" + std::to_string(::getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~Folder() { std::filesystem::remove_all(path_); }
  std::filesystem::path operator/(const std::string& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

Recording example() {
  std::mt19937_64 random(3);
  std::normal_distribution<double> normal;
  Recording record;
  record.dt = 1.0 / 2048;
  Eigen::VectorXd force(300), acc(300);
  for (Eigen::Index i = 0; i < 300; ++i) {
    force[i] = 200 * normal(random);
    acc[i] = 30 * normal(random);
  }
  record.add("force", Quantity::force, force);
  record.add("acc", Quantity::acceleration, acc);
  return record;
}

TEST(SignalsProperty, RecordsAreWrittenAndReadBackInEveryFormat) {
  const Folder folder;
  const Recording record = example();
  write_csv(folder / "r.csv", record);
  write_mat(folder / "r.mat", record);
  write_hdf5(folder / "r.h5", record);
  write_wav(folder / "r.wav", record);
  write_lvm(folder / "r.lvm", record);
  for (const char* name : {"r.csv", "r.mat", "r.h5", "r.wav", "r.lvm"}) {
    const Recording again = read_recording(folder / name);
    ASSERT_EQ(again.channels.size(), 2u) << name;
    EXPECT_NEAR(again.dt, record.dt, 1e-12) << name;
    for (const Channel& channel : record.channels) {
      EXPECT_EQ(again.at(channel.name).quantity, channel.quantity) << name;
      EXPECT_EQ(again[channel.name], channel.samples) << name;
    }
    const FileInfo info = describe(read_signals(folder / name));
    ASSERT_EQ(info.tables.size(), 1u) << name;
    EXPECT_EQ(info.tables[0].rows, 300) << name;
    EXPECT_THAT(to_string(info), HasSubstr("acceleration")) << name;
  }
  write_uff(folder / "r.uff", uff_from_recording(record));
  const Recording again = read_recording(folder / "r.uff");
  for (std::size_t c = 0; c < 2; ++c) {
    EXPECT_EQ(again.channels[c].quantity, record.channels[c].quantity);
    EXPECT_LT((again.channels[c].samples - record.channels[c].samples).cwiseAbs().maxCoeff(), 1e-9);
  }
}

// Written by the library that other programs use for MAT files: compressed and plain v5, and v7.3.
TEST(Signals, RowsOfAnHdf5FileAreThoseOfTheWhole) {
  const Folder folder;
  Recording record = example();
  record.t0 = 2;
  write_hdf5(folder / "r.h5", record);
  for (const auto& [first, count] : {std::pair<Eigen::Index, Eigen::Index>{0, 100}, {100, 150}, {290, 50}}) {
    const Recording part = recording_of(read_hdf5_rows(folder / "r.h5", first, count));
    ASSERT_EQ(part.size(), std::min<Eigen::Index>(count, 300 - first));
    EXPECT_NEAR(part.t0, 2 + static_cast<double>(first) * record.dt, 1e-12);
    EXPECT_DOUBLE_EQ(part.dt, record.dt);
    for (const char* name : {"force", "acc"})
      EXPECT_EQ(part[name], Eigen::VectorXd(record[name].segment(first, part.size())));
  }
  for (const Eigen::Index beyond : {299, 300}) EXPECT_TRUE(read_hdf5_rows(folder / "r.h5", beyond, 10).tables.empty());
  EXPECT_THAT(error_of([&] { (void)read_hdf5_rows(folder / "none.h5", 0, 10); }), HasSubstr("no HDF5 file"));
}

TEST(SignalsReference, MatFilesOfAnotherLibrary) {
  for (const char* name : {"mat/compressed.mat", "mat/plain.mat", "hdf5/v73.mat"}) {
    const SignalFile file = read_signals(corpus(name));
    EXPECT_THAT(file.findings, ::testing::IsEmpty());
    const Recording record = recording_of(file);
    EXPECT_NEAR(record.dt, 1e-3, 1e-12) << name;
    ASSERT_EQ(record.channels.size(), 4u) << name;
    EXPECT_NEAR(record["x"][7], 1e-3 * std::sin(0.3 * 7), 1e-12) << name;  // stored in mm, as a row
    EXPECT_EQ(record.at("x").quantity, Quantity::displacement) << name;
    EXPECT_NEAR(record["acc(2)"][39], -39 * 9.80665, 1e-9) << name;  // columns of a matrix
  }
}

TEST(SignalsReference, LvmWithDecimalCommaAndWithSegments) {
  const SignalFile comma = read_signals(corpus("lvm/comma.lvm"));
  const Recording record = recording_of(comma);
  EXPECT_NEAR(record.dt, 1e-3, 1e-15);
  EXPECT_EQ(record["force"], Eigen::Vector4d(1.5, 2.5, 3.5, 4.5));
  EXPECT_EQ(record.at("acc").quantity, Quantity::acceleration);
  const SignalFile segments = read_signals(corpus("lvm/segments.lvm"));
  ASSERT_EQ(segments.tables.size(), 3u);
  EXPECT_NEAR(segments.tables[1].step, 0.2, 1e-12);
  EXPECT_EQ(segments.tables[1].signals[0].quantity, Quantity::voltage);
  EXPECT_THAT(error_of([&] { recording_of(segments); }), HasSubstr("choose channels"));
  EXPECT_EQ(recording_of(segments, {.columns = {"c:x_mm"}})["x"][1], 2e-3);
}

// What all channels of a file have in common is one remark, with three names at most.
TEST(Signals, LvmReportsOnceWhatChannelsHaveInCommon) {
  std::string titles = "X_Value", zeros, counts;
  for (int k = 0; k < 5; ++k) titles += "\tc" + std::to_string(k), zeros += "\t0.5", counts += "\t9";
  const std::string file =
      "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t.\nX_Columns\tNo\n***End_of_Header***\t\n\t\n"
      "Channels\t5\nSamples" +
      counts + "\nDelta_X" + zeros + "\n***End_of_Header***\n" + titles + "\n" + zeros + "\n" + zeros + "\n";
  EXPECT_THAT(
      parse_lvm(file, "a.lvm").findings,
      ::testing::UnorderedElementsAre("5 channels ('c0', 'c1', 'c2', ...): header declares 9 samples, 2 are present",
                                      "5 channels ('c0', 'c1', 'c2', ...): no unit"));
}

TEST(SignalsReference, WavNeedsACalibration) {
  const SignalFile file = read_signals(corpus("wav/pcm24.wav"));
  EXPECT_THAT(file.findings, Contains(HasSubstr("calibration")));
  EXPECT_THAT(error_of([&] { recording_of(file); }), HasSubstr("no unit"));
  const Recording record = recording_of(file, {.columns = {"1:force_N*200", "2:acc_g*50"}});
  EXPECT_NEAR(record["force"][5], 200 * 0.5 * std::sin(1.0), 1e-4);
  EXPECT_NEAR(record["acc"][0], -0.25 * 50 * 9.80665, 1e-3);
  EXPECT_NEAR(record.rate(), 2000, 1e-9);
}

TEST(Signals, WavWithoutARateOrChannelsIsNamedWithTheByte) {
  const std::string whole = read_text(corpus("wav/pcm24.wav"));
  ASSERT_EQ(whole.substr(12, 4), "fmt ");
  std::string rate = whole, channels = whole;
  for (std::size_t i = 24; i < 28; ++i) rate[i] = 0;
  channels[22] = channels[23] = 0;
  EXPECT_THAT(error_of([&] { parse_wav(rate, "a.wav"); }),
              HasSubstr("a.wav: byte 24: sample rate = 0: must be 1 Hz or more"));
  EXPECT_THAT(error_of([&] { parse_wav(channels, "a.wav"); }),
              HasSubstr("a.wav: byte 22: channels = 0: must be 1 to 1024"));
}

TEST(Signals, FormatIsFoundFromTheContent) {
  const Folder folder;
  std::filesystem::copy_file(corpus("uff/all.uff"), folder / "wrong.csv");
  const SignalFile file = read_signals(folder / "wrong.csv");
  EXPECT_THAT(file.findings, Contains(HasSubstr("named .csv but its content is universal file")));
  EXPECT_EQ(file_format(corpus("mat/plain.mat")), FileFormat::mat);
  EXPECT_EQ(file_format(corpus("hdf5/v73.mat")), FileFormat::hdf5);
  EXPECT_EQ(file_format(corpus("atfx/small.atfx")), FileFormat::atfx);
  EXPECT_EQ(file_format(corpus("json/frf.json")), FileFormat::json);
  EXPECT_THROW(read_signals(corpus("json/frf.json")), Error);
}

TEST(Formats, EveryEndingThatIsWrittenReadsBackWithTheSameValues) {
  const Folder folder;
  Recording record;
  record.dt = 1e-3;
  record.add("force", Quantity::force, Eigen::VectorXd::LinSpaced(50, -3, 4));
  record.add("acc", Quantity::acceleration, Eigen::VectorXd::LinSpaced(50, 1, -0.125));
  int written = 0;
  for (const char* ending : {".mat", ".h5", ".hdf5", ".lvm", ".uff", ".unv", ".csv", ".csv.gz", ".MAT"}) {
    const std::filesystem::path path = folder / (std::string("record") + ending);
    write_recording(path, record);
    const Recording back = read(path);
    ASSERT_EQ(back.size(), 50) << ending;
    EXPECT_LT((back["force"] - record["force"]).cwiseAbs().maxCoeff(), 1e-9) << ending;
    EXPECT_LT((back["acc"] - record["acc"]).cwiseAbs().maxCoeff(), 1e-9) << ending;
    ++written;
  }
  EXPECT_EQ(written, 9);
  EXPECT_EQ(file_format(folder / "record.mat"), FileFormat::mat);
  const std::string error = error_of([&] { write_recording(folder / "record.xyz", record); });
  for (const char* ending : {".mat", ".h5", ".wav", ".lvm", ".uff", ".csv"}) EXPECT_THAT(error, HasSubstr(ending));
  EXPECT_THAT(error, Not(HasSubstr(".atfx")));  // read only
  EXPECT_THAT(error, Not(HasSubstr(".json")));  // results
}

TEST(Formats, ResponsesComeFromTheFilesThatHoldThem) {
  const std::optional<FrequencyResponse> json = read_responses(corpus("json/frf.json"));
  ASSERT_TRUE(json.has_value());
  EXPECT_FALSE(read_responses(corpus("wav/pcm24.wav")).has_value());
  const Folder folder;
  for (const char* name : {"frf.uff", "frf.csv", "frf.json"}) {
    write_responses(folder / name, *json);
    const std::optional<FrequencyResponse> back = read_responses(folder / name, json->kind);
    ASSERT_TRUE(back.has_value()) << name;
    EXPECT_EQ(back->kind, json->kind) << name;
    EXPECT_EQ(back->frequency.size(), json->frequency.size()) << name;
  }
  EXPECT_THAT(error_of([&] { read_responses(folder / "frf.csv"); }), HasSubstr("state --kind"));
  EXPECT_THAT(error_of([&] { write_responses(folder / "frf.wav", *json); }), HasSubstr(".json"));
  EXPECT_EQ(frf_kind("mobility"), FrfKind::mobility);
  EXPECT_FALSE(frf_kind("").has_value());
  EXPECT_THROW(frf_kind("mobile"), Error);
}

TEST(Signals, AtfxTablesHaveTheirTime) {
  const auto part = [](const std::string&) { return std::string("\0\0\0\1\0\2\0\0\0\3\0\4", 12); };
  const SignalFile file = signals_from_atfx(parse_atfx(read_text(corpus("atfx/small.atfx")), "small.atfx", part));
  const Recording record = recording_of(file);
  EXPECT_EQ(record.dt, 0.5);
  EXPECT_EQ(record["acc"], Eigen::Vector4d(1, 2.5, -3, 0.4));
  EXPECT_EQ(record["part"], Eigen::Vector4d(1, 2, 3, 4));
  EXPECT_EQ(record.at("acc").quantity, Quantity::acceleration);
  EXPECT_THAT(file.contents, Contains("1 column of text"));
}

TEST(Signals, DamagedFilesAreErrorsThatNameThePlace) {
  const std::string mat = read_text(corpus("mat/plain.mat"));
  EXPECT_THAT(error_of([&] { parse_mat("", "a.mat"); }), HasSubstr("a.mat: byte 0"));
  EXPECT_THAT(error_of([&] { parse_mat(mat.substr(0, 300), "a.mat"); }), HasSubstr("byte "));
  std::string lying = mat;  // the dimensions of the first variable
  const std::int32_t huge = 2'000'000'000;
  std::memcpy(lying.data() + 128 + 8 + 16 + 8, &huge, 4);
  EXPECT_THAT(error_of([&] { parse_mat(lying, "a.mat"); }), HasSubstr("values in"));
  std::string order = mat;
  std::swap(order[126], order[127]);
  EXPECT_THAT(error_of([&] { parse_mat(order, "a.mat"); }), HasSubstr("byte 128"));
  EXPECT_THAT(error_of([&] { parse_wav("RIFF", "a.wav"); }), HasSubstr("a.wav: byte 4"));
  const std::string wav = read_text(corpus("wav/pcm24.wav"));
  EXPECT_THAT(parse_wav(wav.substr(0, 200), "cut.wav").tables.at(0).rows(), ::testing::Lt(50));
  EXPECT_THAT(error_of([&] { parse_wav(read_text(corpus("wav/empty.wav")), "empty.wav"); }),
              HasSubstr("holds no samples"));
  EXPECT_THAT(error_of([&] { parse_lvm("", "a.lvm"); }), HasSubstr("a.lvm"));
  const std::string lvm = read_text(corpus("lvm/comma.lvm"));
  EXPECT_THAT(error_of([&] { parse_lvm(lvm.substr(0, 250), "a.lvm"); }), HasSubstr("a.lvm:"));
  std::string many = lvm;
  many.replace(many.find("Channels\t2"), 10, "Channels\t99999999");
  EXPECT_THAT(error_of([&] { parse_lvm(many, "a.lvm"); }), HasSubstr("99999999 channels"));
  const std::string hdf5 = read_text(corpus("hdf5/v73.mat"));
  EXPECT_THAT(error_of([&] { parse_hdf5("", "a.h5"); }), HasSubstr("a.h5"));
  EXPECT_THAT(error_of([&] { parse_hdf5(hdf5.substr(0, 40), "a.h5"); }), HasSubstr("cut off"));
  const auto states = HasSubstr("cut off: its superblock states 24272 bytes, 3000 are present");
  EXPECT_THAT(error_of([&] { parse_hdf5(hdf5.substr(0, 3000), "a.h5"); }), states);
  const Folder folder;
  write_text(folder / "a.h5", hdf5.substr(0, 3000));
  EXPECT_THAT(error_of([&] { (void)read_signals(folder / "a.h5"); }), states);
  EXPECT_THAT(error_of([&] { (void)read_hdf5_rows(folder / "a.h5", 0, 10); }), states);
}

TEST(Signals, SelectionRenamesAndChecks) {
  const SignalFile file = read_signals(corpus("lvm/comma.lvm"));
  EXPECT_THAT(error_of([&] { recording_of(file, {.columns = {"nosuch"}}); }), HasSubstr("present: force, acc"));
  EXPECT_THAT(error_of([&] { recording_of(file, {.columns = {"force:x_mm"}}); }), HasSubstr("cannot be taken"));
  EXPECT_THAT(error_of([&] { recording_of(file, {.columns = {"force:x_furlong"}}); }), HasSubstr("furlong"));
  EXPECT_THAT(error_of([&] { recording_of(file, {.columns = {"force:f_kN"}}); }), HasSubstr("is in N by the file"));
  EXPECT_THAT(error_of([&] { recording_of(file, {.rate = 500}); }), HasSubstr("the rate given"));
  EXPECT_THAT(error_of([&] { recording_of(file, {.required = {"beta"}}); }), HasSubstr("beta"));
  EXPECT_EQ(recording_of(file, {.columns = {"2:a_m_s2"}}).channels.at(0).name, "a");
}

TEST(SignalsReference, EveryUniversalFileIsDescribed) {
  const auto folder = testing::data_file("uff");
  WHIRL_REQUIRE_DATA(folder);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const FileInfo info = describe(read_signals(entry.path()));
    EXPECT_FALSE(info.tables.empty() && info.contents.empty()) << entry.path();
    ++files;
  }
  EXPECT_EQ(files, 13);
}

TEST(UnitLabel, WaysOfOtherPrograms) {
  for (const char* label : {"m/s^2", "m/s2", "(m/s2)", "m/s**2", "m/s\xC2\xB2", "[m/s^2]"}) {
    ASSERT_NE(unit_from_label(label), nullptr) << label;
    EXPECT_EQ(unit_from_label(label)->quantity, Quantity::acceleration) << label;
  }
  EXPECT_EQ(unit_from_label("Volts")->quantity, Quantity::voltage);
  EXPECT_EQ(unit_from_label("\xC2\xB5m")->to_si(1), 1e-6);
  EXPECT_EQ(unit_from_label("furlong"), nullptr);
}

}  // namespace
}  // namespace whirl::io
