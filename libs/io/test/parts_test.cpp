// Files read in parts: the same numbers as the whole.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/info.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/records/foreign_files.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;

std::string bytes_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

Recording random_record(std::mt19937_64& random, Eigen::Index rows, double dt) {
  std::normal_distribution<double> normal(0, 1e-3);
  Recording record;
  record.dt = dt;
  for (const char* name : {"x", "y", "speed"}) {
    const Eigen::VectorXd v = Eigen::VectorXd::NullaryExpr(rows, [&] { return normal(random); });
    record.add(name, name[0] == 's' ? Quantity::angular_velocity : Quantity::displacement, v);
  }
  return record;
}

std::vector<double> values_of(const Eigen::VectorXd& v) { return {v.begin(), v.end()}; }

/// The record in files of every kind that can be read in parts, as this and other programs write them.
std::vector<std::filesystem::path> files_of(const Recording& r, const testing::TemporaryFolder& folder) {
  std::vector<std::filesystem::path> out;
  for (const char* name : {"a.csv", "a.csv.gz", "a.h5", "a.mat", "a.npz", "a.wav"}) {
    write_recording(folder.path() / name, r);
    out.push_back(folder.path() / name);
  }
  const auto keep = [&](const std::string& name, const std::string& bytes) {
    folder.write(name, bytes);
    out.push_back(folder.path() / name);
  };
  const auto rows = static_cast<int>(r.size());
  const std::vector<double> x = values_of(r["x"]), y = values_of(r["y"]), t = values_of(r.times());
  std::vector<testing::TdmsChannel> channels = {{"x", "m", x}, {"y", "m", y}};
  keep("chunks.tdms", testing::tdms(channels, r.dt));
  keep("many.tdms", testing::tdms(channels, r.dt, 1, false, 0, rows % 5 == 0 ? rows / 5 : 1));
  keep("segments.tdms", testing::tdms(channels, r.dt, rows % 5 == 0 ? 5 : 1));
  keep("rows.tdms", testing::tdms(channels, r.dt, 1, true));
  keep("matrix.mat",
       testing::mat5_file(testing::mat5_double("t", {rows, 1}, t) + testing::mat5_double("fs", {1, 1}, {1 / r.dt}) +
                          testing::mat5_struct("run", {{"x_m", testing::mat5_double("", {1, rows}, x)},
                                                       {"y_m", testing::mat5_double("", {rows, 1}, y)}})));
  keep("v4.mat", testing::mat4_matrix("t_s", rows, 1, t) + testing::mat4_matrix("x_mm", 1, rows, x));
  std::vector<double> both = x;
  both.insert(both.end(), y.begin(), y.end());
  testing::Bytes by_column, by_row;
  for (const double v : both) by_column.put(v);
  for (std::size_t i = 0; i < x.size(); ++i) by_row.put(x[i]).put(y[i]).put(t[i]);
  keep("columns_m.npy", testing::npy("'<f8'", fmt::format("({}, 2)", rows), by_column.str(), true));
  keep("lines_m.npy", testing::npy("'<f8'", fmt::format("(2, {})", rows), by_column.str()));
  keep("fields.npy",
       testing::npy("[('x_m', '<f8'), ('y_m', '<f8'), ('t_s', '<f8')]", fmt::format("({},)", rows), by_row.str()));
  return out;
}

CsvOptions options_for(const std::filesystem::path& file, const Recording& record) {
  CsvOptions options;
  const std::string name = file.filename().string();
  if (name == "columns_m.npy" || name == "lines_m.npy") options.rate = record.rate();
  return options;
}

// Whatever the size of the parts, and whichever rows are asked for.
TEST(PartsProperty, ConvertedInPartsTheBytesAreThoseOfTheWhole) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    std::mt19937_64 random(seed);
    const testing::TemporaryFolder folder;
    const Recording record = random_record(random, 300 + static_cast<Eigen::Index>(random() % 400) / 5 * 5, 1.0 / 512);
    for (const std::filesystem::path& file : files_of(record, folder)) {
      const CsvOptions options = options_for(file, record);
      const Recording whole = read_recording(file, options);
      ASSERT_EQ(whole.size(), record.size()) << file;
      write_csv(folder.path() / "whole.csv", whole);
      for (const Eigen::Index each : {2, 3, 64, 299, 65536}) {
        if (each < 64 && file.extension() == ".h5") continue;  // a process each
        const Converted done =
            convert_in_parts(file, folder.path() / "parts.csv", options, {.each = each}, [](double) {});
        EXPECT_EQ(done.samples, record.size());
        EXPECT_EQ(bytes_of(folder.path() / "parts.csv"), bytes_of(folder.path() / "whole.csv"))
            << file << " by " << each;
        if (each == 299) {
          (void)convert_in_parts(file, folder.path() / "parts.h5", options, {.each = each}, [](double) {});
          const Recording again = read_recording(folder.path() / "parts.h5");
          EXPECT_EQ(std::tie(again.t0, again.dt), std::tie(whole.t0, whole.dt)) << file;
          for (const Channel& c : whole.channels) EXPECT_EQ(again[c.name], c.samples) << file;
        }
        const Eigen::Index first = static_cast<Eigen::Index>(random() % 200),
                           end = first + 1 + static_cast<Eigen::Index>(random() % 99);
        const Recording some = read_record_rows(file, options, {first, end, each});
        ASSERT_EQ(some.size(), end - first) << file;
        for (std::size_t c = 0; c < whole.channels.size(); ++c)
          EXPECT_EQ(some.channels[c].samples, whole.channels[c].samples.segment(first, end - first)) << file;
        EXPECT_NEAR(some.t0, whole.t0 + whole.dt * static_cast<double>(first), 1e-12) << file;
      }
    }
  }
}

TEST(PartsProperty, WhatInfoTellsInPartsIsWhatItTellsOfTheWhole) {
  std::mt19937_64 random(7);
  const testing::TemporaryFolder folder;
  const Recording record = random_record(random, 1000, 1e-3);
  for (const std::filesystem::path& file : files_of(record, folder)) {
    const FileInfo whole = describe(read_signals(file));
    for (const Eigen::Index each : {7, 256, 65536}) {
      if (each < 64 && file.extension() == ".h5") continue;
      if (file.extension() == ".npy" && file.filename() != "fields.npy") continue;  // without time: rows alone
      const auto stream = open_signal_stream(file, {}, {.each = each});
      const FileInfo parts = describe(*stream, [](double) {});
      ASSERT_EQ(parts.tables.size(), whole.tables.size()) << file;
      for (std::size_t k = 0; k < whole.tables.size(); ++k) {
        const TableInfo &a = parts.tables[k], &b = whole.tables[k];
        EXPECT_EQ(std::tie(a.name, a.abscissa, a.start, a.step, a.rows),
                  std::tie(b.name, b.abscissa, b.start, b.step, b.rows))
            << file << " by " << each;
        ASSERT_EQ(a.channels.size(), b.channels.size());
        for (std::size_t c = 0; c < a.channels.size(); ++c) {
          const ChannelInfo &p = a.channels[c], &q = b.channels[c];
          EXPECT_EQ(std::tie(p.name, p.unit, p.minimum, p.maximum, p.mean, p.rms),
                    std::tie(q.name, q.unit, q.minimum, q.maximum, q.mean, q.rms))
              << file << " by " << each;
        }
      }
      EXPECT_EQ(parts.contents, whole.contents);
    }
  }
}

// Lost digits are counted over all parts and told once.
TEST(Parts, RoundedIntegersAreCountedOverAllParts) {
  const testing::TemporaryFolder folder;
  testing::Bytes b;
  for (int i = 0; i < 500; ++i) b.put<std::int64_t>((std::int64_t{1} << (i % 2 == 0 ? 55 : 40)) + i);
  folder.write("n_1.npy", testing::npy("'<i8'", "(500,)", b.str()));
  const auto stream = open_signal_stream(folder.path() / "n_1.npy", {}, {.each = 64});
  const FileInfo info = describe(*stream, [](double) {});
  EXPECT_THAT(info.findings, ::testing::Contains("'n_1': 250 of 500 integers are 2^53 or more: rounded to 53 bits"));
}

// Numbers of a table with a gap are told all the same; a record is refused where it is uneven.
TEST(Parts, UnevenTimesOfATableAreToldAndRefusedInARecord) {
  const testing::TemporaryFolder folder;
  std::string text = "t_s,x_m\n";
  for (int i = 0; i < 300; ++i) text += fmt::format("{},{}\n", i < 200 ? i : i + 7, i % 5);
  folder.write("a.csv", text);
  const auto stream = open_signal_stream(folder.path() / "a.csv", {.gaps = true}, {.each = 50});
  const FileInfo info = describe(*stream, [](double) {});
  ASSERT_EQ(info.tables.size(), 1U);
  EXPECT_EQ(info.tables[0].rows, 300);
  EXPECT_EQ(info.tables[0].step, 0);
  EXPECT_THAT(info.findings, ::testing::Contains(HasSubstr("not uniform")));
  EXPECT_THAT(
      error_of([&] { (void)convert_in_parts(folder.path() / "a.csv", folder.path() / "b.csv", {}, {.each = 50}, {}); }),
      HasSubstr("for a uniform step"));
}

// What must be unpacked whole, or is more than one record, is refused before anything is read of it.
TEST(Parts, WhatCannotBeReadInPartsIsRefusedWithItsCure) {
  const testing::TemporaryFolder folder;
  const auto refusal = [&](const std::string& name, const std::string& bytes) {
    folder.write(name, bytes);
    return error_of([&] { (void)open_signal_stream(folder.path() / name); });
  };
  const std::string large(std::size_t{20} << 20, '\0');
  const std::string member = testing::npy("'<f8'", "(2621440,)", large);
  EXPECT_THAT(refusal("deflated.npz", testing::zip({{"a.npy", member}}, true)),
              AllOf(HasSubstr("deflated.npz"), HasSubstr("cannot be read in parts; save it with numpy.savez")));
  std::string packed(compressBound(large.size() + 64), '\0');
  uLongf size = packed.size();
  const std::string variable = testing::mat5_double("x_m", {2621440, 1}, std::vector<double>(2621440));
  compress(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(variable.data()),
           variable.size());
  packed.resize(size);
  testing::Bytes tag;
  tag.put<std::uint32_t>(15).put(static_cast<std::uint32_t>(size));
  EXPECT_THAT(refusal("packed.mat", testing::mat5_file(tag.str() + packed)), HasSubstr("-nocompression"));
  const std::string other = testing::npy("'<f8'", "(80000,)", std::string(640000, '\0'));
  EXPECT_THAT(refusal("two.npz", testing::zip({{"a.npy", member}, {"b.npy", other}}, false)),
              HasSubstr("'b' has 80000 values, the record 2621440 samples: such a file cannot be read in parts"));
  EXPECT_THAT(refusal("text.lvm", "LabVIEW Measurement\n"),
              HasSubstr("LVM cannot be read in parts (above 1 GiB, or --stream)"));
  EXPECT_THAT(error_of([&] {
                (void)convert_in_parts(folder.path() / "two.npz", folder.path() / "a.uff", {}, {}, [](double) {});
              }),
              AllOf(HasSubstr("OUT"), HasSubstr("the input is read in parts")));
}

TEST(Parts, RowsBeyondTheEndAreRefused) {
  const testing::TemporaryFolder folder;
  std::mt19937_64 random(1);
  for (const std::filesystem::path& file : files_of(random_record(random, 100, 1e-3), folder)) {
    const CsvOptions options = options_for(file, random_record(random, 2, 1e-3));
    for (const PartRows& rows : {PartRows{0, 101}, PartRows{100, 102}, PartRows{5, 5}})
      EXPECT_THAT(error_of([&] { (void)read_record_rows(file, options, rows); }), HasSubstr("--rows")) << file;
  }
}

}  // namespace
}  // namespace whirl::io
