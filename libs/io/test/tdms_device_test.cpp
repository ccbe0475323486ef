// TDMS as LabVIEW's DAQmx logging writes it, and objects that leave a segment and come back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "whirl/io/formats.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/records/foreign_files.hpp"

namespace {

using namespace whirl;
using namespace whirl::io;
using namespace whirl::testing;
using ::testing::Contains;
using ::testing::HasSubstr;

std::filesystem::path saved(const std::string& name, const std::string& bytes) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / ("device_" + name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

std::string counted(const std::string& s) { return Bytes().put(static_cast<std::uint32_t>(s.size())).text(s).str(); }
std::string property(const std::string& name, const std::string& value) {
  return counted(name) + Bytes().put<std::uint32_t>(0x20).str() + counted(value);
}
std::string property(const std::string& name, double value) {
  return counted(name) + Bytes().put<std::uint32_t>(10).put(value).str();
}
std::string property(const std::string& name, std::uint32_t value) {
  return counted(name) + Bytes().put<std::uint32_t>(7).put(value).str();
}

/// One object of a segment: its raw data index as bytes, its properties.
struct Described {
  std::string name, index;
  std::vector<std::string> properties = {};
};
std::string segment(std::uint32_t contents, const std::vector<Described>& objects, const std::string& raw,
                    std::size_t missing = 0) {
  Bytes meta, lead;
  meta.put(static_cast<std::uint32_t>(objects.size()));
  for (const Described& o : objects) {
    meta.text(counted("/'g'/'" + o.name + "'")).text(o.index).put(static_cast<std::uint32_t>(o.properties.size()));
    for (const std::string& p : o.properties) meta.text(p);
  }
  lead.text("TDSm").put(contents).put<std::uint32_t>(4713);
  lead.put<std::uint64_t>(meta.str().size() + raw.size()).put<std::uint64_t>(meta.str().size());
  return lead.str() + meta.str() + raw.substr(0, raw.size() - missing);
}
constexpr std::uint32_t kMeta = 2, kList = 4, kRaw = 8, kDevice = 128;

struct Scaler {
  std::uint32_t type, buffer, offset, scale;
};
std::string device_index(std::uint64_t rows, const std::vector<Scaler>& scalers,
                         const std::vector<std::uint32_t>& widths, bool digital = false) {
  Bytes b;
  b.put<std::uint32_t>(digital ? 0x126A : 0x1269).put<std::uint32_t>(0xFFFFFFFF).put<std::uint32_t>(1).put(rows);
  b.put(static_cast<std::uint32_t>(scalers.size()));
  for (const Scaler& s : scalers) {
    b.put(s.type).put(s.buffer).put(s.offset);
    digital ? b.put<std::uint8_t>(0) : b.put<std::uint32_t>(0);
    b.put(s.scale);
  }
  b.put(static_cast<std::uint32_t>(widths.size()));
  for (const std::uint32_t w : widths) b.put(w);
  return b.str();
}
std::vector<std::string> waveform(const std::string& unit, double slope, double offset) {
  return {property("wf_increment", 0.0005),
          property("wf_start_offset", 0.0),
          property("unit_string", unit),
          property("NI_Number_Of_Scales", std::uint32_t{2}),
          property("NI_Scaling_Status", std::string("unscaled")),
          property("NI_Scale[1]_Scale_Type", std::string("Linear")),
          property("NI_Scale[1]_Linear_Slope", slope),
          property("NI_Scale[1]_Linear_Y_Intercept", offset),
          property("NI_Scale[1]_Linear_Input_Source", std::uint32_t{0})};
}

/// Rows of a 16-bit and a 24-in-32-bit channel in one buffer, a counter in a second one; several chunks a segment.
TEST(TdmsDevice, RawDataOfDaqmxDevicesAreReadThroughTheirScales) {
  for (unsigned seed = 1; seed <= 8; ++seed) {
    std::mt19937 random(seed);
    const int rows = 5 + static_cast<int>(random() % 40), chunks = 1 + static_cast<int>(random() % 4);
    std::vector<std::int16_t> a;
    std::vector<std::int32_t> b;
    std::vector<std::uint32_t> c;
    std::string raw;
    for (int chunk = 0; chunk < chunks; ++chunk) {
      Bytes first, second;
      for (int i = 0; i < rows; ++i) {
        a.push_back(static_cast<std::int16_t>(random()));
        b.push_back(static_cast<std::int32_t>(random()) >> 8);
        c.push_back(static_cast<std::uint32_t>(random()));
        first.put(a.back()).put(b.back());
        second.put(c.back());
      }
      raw += first.str() + second.str();
    }
    const std::vector<std::uint32_t> widths{6, 4};
    const auto n = static_cast<std::uint64_t>(rows);
    const auto missing = random() % 2 == 0 ? 0u : 4u * (1 + random() % 3);  // of the last rows of the counter
    const std::string bytes = segment(kMeta | kList | kRaw | kDevice,
                                      {{"acc", device_index(n, {{3, 0, 0, 0}}, widths), waveform("g", 0.01, 0.5)},
                                       {"x", device_index(n, {{5, 0, 2, 0}}, widths), waveform("mm", 1e-6, 0)},
                                       {"count",
                                        device_index(n, {{4, 1, 0, 0}}, widths),
                                        {property("wf_increment", 0.0005), property("unit_string", std::string("V"))}}},
                                      raw, missing);
    const auto file = saved("task.tdms", bytes);
    const SignalFile read = read_signals(file);
    const Recording record = recording_of(read);
    const auto kept = static_cast<Eigen::Index>(a.size()) - static_cast<Eigen::Index>(missing / 4);
    ASSERT_EQ(record.size(), kept) << seed;
    for (Eigen::Index i = 0; i < kept; ++i) {
      const auto k = static_cast<std::size_t>(i);
      ASSERT_NEAR(record["acc"][i], 9.80665 * (0.01 * a[k] + 0.5), 1e-9) << seed;
      ASSERT_NEAR(record["x"][i], 1e-9 * b[k], 1e-15) << seed;
      ASSERT_EQ(read.tables[0].signals[2].value[i], c[k]) << seed;
    }
    EXPECT_EQ(!read.findings.empty(), missing > 0);
  }
}

TEST(TdmsDevice, ADigitalLineIsItsBit) {
  Bytes raw;
  const unsigned char rows[] = {0x00, 0x20, 0x3F, 0xDF, 0xFF, 0x20};
  for (const unsigned char r : rows) raw.put(r);
  const std::string bytes = segment(kMeta | kList | kRaw | kDevice,
                                    {{"key",
                                      device_index(6, {{0, 0, 5, 0}}, {1}, true),
                                      {property("wf_increment", 0.001), property("unit_string", std::string("V"))}}},
                                    raw.str());
  const Recording record = read_recording(saved("line.tdms", bytes));
  ASSERT_EQ(record.size(), 6);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(record["key"][i], (rows[i] >> 5) & 1) << i;
}

TEST(TdmsDevice, ADescriptionThatDoesNotFitItsRowsIsRefused) {
  const std::string outside =
      segment(kMeta | kList | kRaw | kDevice, {{"a", device_index(4, {{5, 0, 2, 0}}, {4})}}, std::string(16, '\0'));
  EXPECT_THAT(error_of([&] { (void)read_signals(saved("outside.tdms", outside)); }), HasSubstr("outside of the row"));
  const std::string type =
      segment(kMeta | kList | kRaw | kDevice, {{"a", device_index(4, {{77, 0, 0, 0}}, {4})}}, std::string(16, '\0'));
  EXPECT_THAT(error_of([&] { (void)read_signals(saved("type.tdms", type)); }), HasSubstr("DAQmx type 77"));
  // More rows than the file holds: the rows that are there.
  const std::string huge =
      segment(kMeta | kList | kRaw | kDevice,
              {{"a", device_index(~0ull / 2, {{3, 0, 0, 0}}, {2}), waveform("V", 1, 0)}}, std::string(16, '\1'));
  EXPECT_EQ(read_recording(saved("huge.tdms", huge)).size(), 8);
}

std::string doubles(int first, int count) {
  Bytes b;
  for (int i = 0; i < count; ++i) b.put(static_cast<double>(first + i));
  return b.str();
}
std::string plain_index(std::uint64_t count) {
  return Bytes().put<std::uint32_t>(20).put<std::uint32_t>(10).put<std::uint32_t>(1).put(count).str();
}

/// A segment without a new list in which an object says that it has no data: it went on being read, and took the data
/// of the others.
TEST(TdmsDevice, AnObjectThatIsSwitchedOffHasNoDataUntilItComesBack) {
  const std::string off = Bytes().put<std::uint32_t>(0xFFFFFFFF).str(), as_before = Bytes().put<std::uint32_t>(0).str();
  const std::vector<std::string> wave = {property("wf_increment", 0.001), property("unit_string", std::string("mm"))};
  const std::string bytes = segment(kMeta | kList | kRaw, {{"x", plain_index(4), wave}, {"y", plain_index(4), wave}},
                                    doubles(0, 4) + doubles(100, 4)) +
                            segment(kMeta | kRaw, {{"x", off}}, doubles(104, 4)) +  // y alone
                            segment(kRaw, {}, doubles(108, 4)) +                    // the list as it was: y alone
                            segment(kMeta | kRaw, {{"x", as_before}}, doubles(4, 4) + doubles(112, 4));
  const SignalFile file = read_signals(saved("off.tdms", bytes));
  std::map<std::string, Eigen::VectorXd> found;
  for (const SignalTable& t : file.tables)
    for (const Signal& s : t.signals) found[s.name] = s.value;
  ASSERT_EQ(found["x"].size(), 8);
  ASSERT_EQ(found["y"].size(), 16);
  for (int i = 0; i < 8; ++i) EXPECT_DOUBLE_EQ(found["x"][i], 1e-3 * i);
  for (int i = 0; i < 16; ++i) EXPECT_DOUBLE_EQ(found["y"][i], 1e-3 * (100 + i));
}

}  // namespace
