// Odd but legal files: what other writers make of the same formats.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "whirl/io/csv.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/uff.hpp"
#include "whirl/testing/error_of.hpp"
#include "whirl/testing/records/foreign_files.hpp"

namespace {

using namespace whirl;
using namespace whirl::io;
using namespace whirl::testing;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr int kRows = 60;
double wave(int i) { return 3 * std::sin(0.2 * i) + 0.1; }

std::filesystem::path keep(const std::string& name, const std::string& bytes) {
  const std::filesystem::path path = std::filesystem::path(::testing::TempDir()) / ("odd_" + name);
  std::ofstream(path, std::ios::binary) << bytes;
  return path;
}

// TDMS --------------------------------------------------------------------------------------------------------------

std::string text_of(const std::string& s) {
  Bytes b;
  return b.put(static_cast<std::uint32_t>(s.size())).text(s).str();
}
std::string property(const std::string& name, const std::string& value) {
  return text_of(name) + Bytes().put<std::uint32_t>(0x20).str() + text_of(value);
}
std::string property(const std::string& name, double value) {
  return text_of(name) + Bytes().put<std::uint32_t>(10).put(value).str();
}
struct Object {
  std::string name;
  std::vector<std::string> properties;
  int rows = kRows;
  std::uint32_t type = 10;  // double
};
// One segment of channels of 8-byte numbers; of `raw` the first `kept` bytes.
std::string segment(const std::vector<Object>& objects, const std::string& raw, std::size_t kept = 1u << 30) {
  Bytes meta, lead;
  meta.put(static_cast<std::uint32_t>(objects.size()));
  for (const Object& o : objects) {
    meta.text(text_of("/'g'/'" + o.name + "'"));
    meta.put<std::uint32_t>(20).put(o.type).put<std::uint32_t>(1);
    meta.put(static_cast<std::uint64_t>(o.rows)).put(static_cast<std::uint32_t>(o.properties.size()));
    for (const std::string& p : o.properties) meta.text(p);
  }
  lead.text("TDSm").put<std::uint32_t>(2u | 4u | 8u).put<std::uint32_t>(4713);
  lead.put<std::uint64_t>(meta.str().size() + raw.size()).put<std::uint64_t>(meta.str().size());
  return lead.str() + meta.str() + raw.substr(0, kept);
}
template <class Of>
std::string column(Of of) {
  Bytes b;
  for (int i = 0; i < kRows; ++i) b.put(of(i));
  return b.str();
}
const std::vector<std::string> kWaveform = {property("wf_increment", 0.002), property("wf_start_offset", 0.0),
                                            property("unit_string", std::string("mm"))};
std::vector<std::string> with(std::vector<std::string> more) {
  more.insert(more.begin(), kWaveform.begin(), kWaveform.end());
  return more;
}

// Raw counts were shown as millimetres where the scale was not a single first linear one.
TEST(OddFilesReference, TdmsScalesAreAppliedAsTheyAreStated) {
  const auto chain =
      with({property("NI_Number_Of_Scales", 2.0), property("NI_Scaling_Status", std::string("unscaled")),
            property("NI_Scale[1]_Scale_Type", std::string("Linear")), property("NI_Scale[1]_Linear_Slope", 0.25),
            property("NI_Scale[1]_Linear_Y_Intercept", 0.5), property("NI_Scale[1]_Linear_Input_Source", 0.0)});
  const auto polynomial =
      with({property("NI_Number_Of_Scales", 1.0), property("NI_Scale[0]_Scale_Type", std::string("Polynomial")),
            property("NI_Scale[0]_Polynomial_Coefficients_Size", 3.0),
            property("NI_Scale[0]_Polynomial_Coefficients[0]", 0.5),
            property("NI_Scale[0]_Polynomial_Coefficients[1]", 0.25),
            property("NI_Scale[0]_Polynomial_Coefficients[2]", 2.0)});
  const auto done =
      with({property("NI_Number_Of_Scales", 1.0), property("NI_Scaling_Status", std::string("scaled")),
            property("NI_Scale[0]_Scale_Type", std::string("Linear")), property("NI_Scale[0]_Linear_Slope", 0.25)});
  for (const auto& [properties, square, slope, offset] : {std::tuple{chain, 0.0, 0.25, 0.5},
                                                          {polynomial, 2.0, 0.25, 0.5},
                                                          {done, 0.0, 1.0, 0.0},
                                                          {with({}), 0.0, 1.0, 0.0}}) {
    const Recording record = read_recording(keep("scale.tdms", segment({{"x", properties}}, column(wave))));
    for (int i = 0; i < kRows; ++i)
      ASSERT_NEAR(record["x"][i], 1e-3 * (square * wave(i) * wave(i) + slope * wave(i) + offset), 1e-12);
  }
  // A scale that cannot be applied takes the unit away: the values are no millimetres.
  const auto gauge =
      with({property("NI_Number_Of_Scales", 1.0), property("NI_Scale[0]_Scale_Type", std::string("Strain"))});
  const auto file = keep("strain.tdms", segment({{"x", gauge}}, column(wave)));
  EXPECT_THAT(read_signals(file).findings, Contains(HasSubstr("'Strain', which cannot be applied")));
  EXPECT_THAT(error_of([&] { (void)read_recording(file); }), HasSubstr("has no unit"));
}

TEST(OddFilesReference, TdmsAbscissaeOtherThanASampledTime) {
  const auto spectrum =
      with({property("wf_xname", std::string("Frequency")), property("wf_xunit_string", std::string("kHz"))});
  const SignalFile file = read_signals(keep("hz.tdms", segment({{"S", spectrum}}, column(wave))));
  EXPECT_EQ(file.tables[0].abscissa, Quantity::frequency);
  EXPECT_NEAR(file.tables[0].step, 2, 1e-12);
  const auto xy = segment(
      {{"Time", {property("unit_string", std::string("ms"))}}, {"x", {property("unit_string", std::string("mm"))}}},
      column([](int i) { return 0.5 * i; }) + column(wave));
  const Recording record = read_recording(keep("xy.tdms", xy));
  ASSERT_EQ(record.channels.size(), 1u);
  EXPECT_NEAR(record.dt, 0.0005, 1e-12);
  EXPECT_NEAR(record["x"][7], 1e-3 * wave(7), 1e-15);
}

TEST(OddFilesReference, TdmsOfAKilledWriterKeepsWhatAllChannelsHave) {
  const std::string raw = column(wave) + column([](int i) { return 2 * wave(i); });
  const auto file = keep("killed.tdms", segment({{"x", kWaveform}, {"y", kWaveform}}, raw, 8 * (kRows + 21) + 3));
  const Recording record = read_recording(file);
  ASSERT_EQ(record.size(), 21);
  EXPECT_NEAR(record["x"][20], 1e-3 * wave(20), 1e-15);
  EXPECT_NEAR(record["y"][20], 2e-3 * wave(20), 1e-15);
  EXPECT_THAT(read_signals(file).findings, Contains(HasSubstr("21 are in all channels")));
}

// WAV ---------------------------------------------------------------------------------------------------------------

std::string wav(const std::string& riff, std::uint32_t size, const std::string& before = "") {
  Bytes data, format, all;
  for (int i = 0; i < kRows; ++i) data.put(static_cast<std::int16_t>(8000 * wave(i)));
  format.put<std::uint16_t>(1).put<std::uint16_t>(1).put<std::uint32_t>(500).put<std::uint32_t>(1000);
  format.put<std::uint16_t>(2).put<std::uint16_t>(16);
  all.text(riff).put<std::uint32_t>(riff == "RIFF" ? 300 : 0xFFFFFFFF).text("WAVE").text(before);
  all.text("fmt ").put<std::uint32_t>(16).text(format.str()).text("data").put(size).text(data.str());
  return all.str();
}

TEST(OddFilesReference, WavOfAKilledRecorderAndOfTheBroadcastForm) {
  Bytes sizes;
  sizes.text("ds64").put<std::uint32_t>(28).put<std::uint64_t>(300).put<std::uint64_t>(2 * kRows);
  sizes.put<std::uint64_t>(kRows).put<std::uint32_t>(0);
  const CsvOptions metres{.columns = {"1:x_m"}};
  for (const auto& [name, bytes] : {std::pair<std::string, std::string>{"killed.wav", wav("RIFF", 0)},
                                    {"rf64.wav", wav("RF64", 0xFFFFFFFF, sizes.str())},
                                    {"bw64.wav", wav("BW64", 0xFFFFFFFF, sizes.str())}}) {
    const Recording record = read_recording(keep(name, bytes), metres);
    ASSERT_EQ(record.size(), kRows) << name;
    EXPECT_EQ(record["x"][5], static_cast<std::int16_t>(8000 * wave(5)) / 32768.0) << name;
  }
  EXPECT_THAT(read_signals(keep("killed.wav", wav("RIFF", 0))).findings, Contains(HasSubstr("states no samples")));
}

// Universal files ---------------------------------------------------------------------------------------------------

UffFile two_functions() {
  Recording record;
  record.dt = 0.01;
  for (const char* name : {"1:+X", "2:-Y"}) {
    Eigen::VectorXd v(kRows);
    for (int i = 0; i < kRows; ++i) v[i] = wave(i) * (name[0] - '0');
    record.add(name, Quantity::acceleration, v);
  }
  return uff_from_recording(record);
}

std::string without_lines(const std::string& text, const std::vector<int>& marks) {
  std::string out;
  int mark = 0;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at) + 1;
    const std::string line = text.substr(at, end - at);
    const bool delimiter =
        line.find_first_not_of(" \r\n") != std::string::npos && line.find("-1") == 4 && line.size() < 9;
    mark += delimiter ? 1 : 0;
    if (!delimiter || std::find(marks.begin(), marks.end(), mark) == marks.end()) out += line;
    at = end;
  }
  return out;
}

// Data sets that share a -1, or have none between them: the second one was lost without a word.
TEST(OddFilesReference, UniversalFilesWithMissingDelimitersKeepEveryDataSet) {
  const UffFile made = two_functions();
  const std::string text = format_uff(made);
  const UffFile whole = parse_uff(text, "a.uff");
  ASSERT_EQ(whole.functions.size(), 2u);
  const int blocks = static_cast<int>(2 + whole.units.size() + (whole.header.empty() ? 0 : 1));
  const int closing = 2 * (blocks - 1);  // of the first function, counted from 1
  for (const std::vector<int>& missing : {std::vector<int>{closing}, {closing + 1}, {closing, closing + 1}}) {
    const UffFile back = parse_uff(without_lines(text, missing), "a.uff");
    ASSERT_EQ(back.functions.size(), 2u) << missing.size();
    for (int k = 0; k < 2; ++k)
      EXPECT_NEAR((back.functions[k].value - made.functions[k].value).norm(), 0, 1e-9) << missing.size();
    EXPECT_THAT(back.warnings, Contains(HasSubstr("without -1 before it")));
  }
  EXPECT_TRUE(whole.warnings.empty());
}

TEST(OddFiles, ValuesBeyondThoseDeclaredAreTold) {
  UffFile made = two_functions();
  made.functions[0].declared = made.functions[1].declared = kRows;
  std::string text = format_uff(made);
  const std::string count = "        60";
  const std::size_t at = text.find(count);
  ASSERT_NE(at, std::string::npos);
  text.replace(at, count.size(), "        20");
  const UffFile back = parse_uff(text, "a.uff");
  EXPECT_EQ(back.functions[0].value.size(), 20);
  EXPECT_THAT(back.warnings, Contains(HasSubstr("more lines of its block are left out")));
}

TEST(OddFilesReference, BinaryFunctionsWithSingleAbscissaeBesideDoubleValues) {
  for (const bool single : {true, false}) {
    Bytes raw;
    for (int i = 0; i < kRows; ++i) {
      if (single) raw.put(static_cast<float>(0.25 * i * i));
      if (!single) raw.put(0.25 * i * i);
      raw.put(wave(i));
    }
    const std::string text = format_uff(two_functions());
    std::vector<std::string> lines;
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = text.find('\n', at) + 1;
      lines.push_back(text.substr(at, end - at));
      at = end;
    }
    const auto first =
        std::find_if(lines.begin(), lines.end(), [](const std::string& l) { return l.starts_with("    58"); });
    ASSERT_NE(first, lines.end());
    std::string file = "    -1\n    58b     1     2          11";
    const std::string bytes = std::to_string(raw.str().size());
    file += std::string(12 - bytes.size(), ' ') + bytes + "     0     0           0           0\n";
    for (int k = 1; k <= 11; ++k) {
      std::string line = *(first + k);
      if (k == 7) line = "         4        60         0" + line.substr(30);
      file += line;
    }
    const UffFile back = parse_uff(file + raw.str() + "\n    -1\n", "b.uff");
    ASSERT_EQ(back.functions.size(), 1u);
    ASSERT_EQ(back.functions[0].value.size(), kRows) << single;
    EXPECT_EQ(back.functions[0].x[7], 0.25 * 49) << single;
    EXPECT_EQ(back.functions[0].value[7].real(), wave(7)) << single;
  }
}

// Axes without a unit are in the one unit system that dataset 164 states.
TEST(OddFilesReference, UniversalFilesInAnotherUnitSystem) {
  for (const auto& [code, length, force] :
       {std::tuple{5, 1e3, 1e3}, {7, 1 / 0.0254, 1 / 4.4482216152605}, {1, 1.0, 1.0}}) {
    UffFile file = two_functions();
    file.units = {{code, "system", length, force, 1, 273.15}};
    for (UffFunction& f : file.functions) {
      f.ordinate.unit = "NONE";
      f.value *= length;
    }
    file.functions[1].ordinate.type = 13;
    file.functions[1].value *= force / length;
    const Recording record = recording_of(signals_from_uff(parse_uff(format_uff(file), "a.uff")));
    EXPECT_EQ(record.at("1:+X").quantity, Quantity::acceleration);
    EXPECT_EQ(record.at("2:-Y").quantity, Quantity::force);
    EXPECT_NEAR(record["1:+X"][7], wave(7), 1e-9) << code;
    EXPECT_NEAR(record["2:-Y"][7], 2 * wave(7), 1e-9) << code;

    FrequencyResponse frf;
    frf.kind = FrfKind::receptance;
    frf.frequency = Eigen::VectorXd::LinSpaced(20, 1, 20);
    frf.channels = {{"1:+X", "1:+X", Eigen::VectorXcd::Constant(20, {2e-6, 1e-6}), {}, {}}};
    UffFile responses = uff_from_frf(frf);
    responses.units = file.units;
    responses.functions[0].ordinate.unit = responses.functions[0].denominator.unit = "";
    responses.functions[0].value *= length / force;
    const FrequencyResponse back = frf_from_uff(responses);
    EXPECT_NEAR(back.channels[0].value[3].real(), 2e-6, 1e-15) << code;
    EXPECT_EQ(back.kind, FrfKind::receptance);
    EXPECT_THAT(error_of([&] { (void)frf_from_uff(responses, FrfKind::mobility); }), HasSubstr("--kind says velocity"));
    responses.units.push_back(file.units[0]);  // two systems: which?
    EXPECT_THAT(error_of([&] { (void)frf_from_uff(responses); }), HasSubstr("has no unit"));
  }
}

// Points of universal files are the names of channels: a table of them can be written, and read back.
TEST(OddFiles, PointsOfUniversalFilesAreHeadingsOfATable) {
  const auto folder = std::filesystem::path(::testing::TempDir());
  write_uff(folder / "odd_points.uff", two_functions());
  const Recording record = read_recording(folder / "odd_points.uff");
  write_recording(folder / "odd_points.csv", record);
  const Recording back = read_recording(folder / "odd_points.csv");
  ASSERT_EQ(back.channels.size(), 2u);
  EXPECT_EQ(back.channels[1].name, "2:-Y");
  EXPECT_EQ(back["1:+X"], record["1:+X"]);
  EXPECT_EQ(read_recording(folder / "odd_points.csv", {.columns = {"t_s", "2:-Y_m_s2"}}).channels.size(), 1u);
}

// NumPy, MAT, HDF5 --------------------------------------------------------------------------------------------------

TEST(OddFilesReference, NumpyFieldsWithPaddingAndPartsAndArraysInFolders) {
  Bytes b;
  for (int i = 0; i < kRows; ++i)
    b.put(0.002 * i).put(static_cast<float>(wave(i))).put<float>(77).put(wave(i)).put(-wave(i));
  const auto fields = keep(
      "fields.npy", npy("[('t_s', '<f8'), ('x_mm', '<f4'), ('', '|V4'), ('yz_um', '<f8', (2,))]", "(60,)", b.str()));
  const Recording record = read_recording(fields);
  ASSERT_EQ(record.channels.size(), 3u);
  EXPECT_NEAR(record.dt, 0.002, 1e-12);
  EXPECT_NEAR(record["x"][9], 1e-3 * static_cast<float>(wave(9)), 1e-12);
  EXPECT_NEAR(record["yz(2)"][9], -1e-6 * wave(9), 1e-15);
  Bytes flags;
  for (int i = 0; i < kRows; ++i) flags.put<std::uint8_t>(wave(i) > 0);
  const auto times = npy("'<f8'", "(60,)", column([](int i) { return 0.002 * i; }));
  const auto folder = keep("folder.npz", zip({{"run/t_s.npy", times},
                                              {"run/x_mm.npy", npy("'<f8'", "(60,)", column(wave))},
                                              {"run/above.npy", npy("'|b1'", "(60,)", flags.str())},
                                              {"image.npy", npy("'<f8'", "(2, 3, 5, 2)", column(wave))},
                                              {"when.npy", npy("'<M8[s]'", "(60,)", column(wave))},
                                              {"names.npy", npy("'<U1'", "(120,)", column(wave))}},
                                             true));
  const SignalFile file = read_signals(folder);
  EXPECT_THAT(file.findings, Contains(HasSubstr("'image': 4 dimensions (passed over)")));
  EXPECT_THAT(file.findings, Contains(HasSubstr("'when'")));
  EXPECT_EQ(file.findings.size(), 2u);  // text is no loss
  const Recording inside = recording_of(file);
  ASSERT_EQ(inside.channels.size(), 2u);
  EXPECT_NEAR(inside.dt, 0.002, 1e-12);
  EXPECT_EQ(inside["above"][3], 1);
}

TEST(OddFilesReference, Hdf5TablesOfRecords) {
  const auto path = std::filesystem::path(::testing::TempDir()) / "odd_records.h5";
  struct Row {
    double t, x;
    std::int32_t n;
  };
  std::vector<Row> rows;
  for (int i = 0; i < kRows; ++i) rows.push_back({0.002 * i, wave(i), i});
  for (const bool two : {false, true}) {
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t type = H5Tcreate(H5T_COMPOUND, sizeof(Row));
    H5Tinsert(type, "t_s", offsetof(Row, t), H5T_NATIVE_DOUBLE);
    H5Tinsert(type, "x_mm", offsetof(Row, x), H5T_NATIVE_DOUBLE);
    if (!two) H5Tinsert(type, "n_1", offsetof(Row, n), H5T_NATIVE_INT32);
    const hsize_t size = kRows;
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t data = H5Dcreate2(file, "run", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(data, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, rows.data());
    H5Dclose(data), H5Sclose(space), H5Tclose(type), H5Fclose(file);
    const Recording record = read_recording(path);  // of two fields: no complex numbers
    ASSERT_EQ(record.channels.size(), two ? 1u : 2u);
    EXPECT_NEAR(record.dt, 0.002, 1e-12);
    EXPECT_NEAR(record["x"][11], 1e-3 * wave(11), 1e-15);
  }
}

// Counters and times since an epoch: what a double does not hold was rounded without a word.
TEST(OddFiles, IntegersBeyond53BitsAreTold) {
  const auto told = [](const std::filesystem::path& path) {
    const SignalFile file = read_signals(path);
    return std::any_of(file.findings.begin(), file.findings.end(), [](const std::string& finding) {
      return finding.find("60 of 60 integers are 2^53 or more: rounded to 53 bits") != std::string::npos;
    });
  };
  const auto hdf5 = [](const std::string& name, hid_t type, const std::vector<std::int64_t>& values) {
    const auto path = std::filesystem::path(::testing::TempDir()) / name;
    const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hsize_t size = kRows;
    const hid_t space = H5Screate_simple(1, &size, nullptr);
    const hid_t data = H5Dcreate2(file, "n_1", type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(data, H5T_NATIVE_INT64, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Dclose(data), H5Sclose(space), H5Fclose(file);
    return path;
  };
  for (const std::int64_t sign : {1, -1}) {
    const auto counter = [&](std::int64_t i) { return sign * ((std::int64_t{1} << 53) + i); };
    std::vector<std::int64_t> counts;
    Bytes raw, big(true);
    for (int i = 0; i < kRows; ++i) {
      counts.push_back(counter(i));
      raw.put(counts.back());
      big.put(counts.back());
    }
    EXPECT_TRUE(told(keep("count.npy", npy("'<i8'", "(60,)", raw.str()))));
    EXPECT_TRUE(told(keep("count_big.npy", npy("'>i8'", "(60,)", big.str()))));
    EXPECT_TRUE(told(keep("count.npz", zip({{"n_1.npy", npy("'<i8'", "(60,)", raw.str())}}, true))));
    EXPECT_TRUE(told(keep("count.mat", mat5_file(mat5_array(14, "n_1", {kRows, 1}, mat5_element(12, raw.str()))))));
    EXPECT_TRUE(told(keep("count.tdms", segment({{"n", kWaveform, kRows, 4}}, raw.str()))));
    EXPECT_TRUE(told(hdf5("odd_count.h5", H5T_STD_I64LE, counts)));
    // Floating-point numbers of that size are what they are, and smaller integers too.
    EXPECT_FALSE(told(hdf5("odd_count_real.h5", H5T_IEEE_F64LE, counts)));
    EXPECT_FALSE(told(keep("real.npy", npy("'<f8'", "(60,)", column([&](int i) { return double(counter(i)); })))));
    EXPECT_FALSE(told(keep("small.npy", npy("'<i8'", "(60,)", column([](int i) { return std::int64_t{i} << 40; })))));
  }
}

TEST(OddFiles, AFileWithoutARecordSaysWhatItHolds) {
  const auto file = keep("objects.npy", npy("'|O'", "(2,)", "whatever"));
  EXPECT_THAT(error_of([&] { (void)read_recording(file); }), HasSubstr("type '|O' (passed over)"));
}

// CSV ---------------------------------------------------------------------------------------------------------------

TEST(OddFiles, LinesThatEndWithCarriageReturnsAloneAreNamed) {
  const auto file = keep("cr.csv", "t_s,x_mm\r0,1\r0.001,2\r0.002,3\r");
  EXPECT_THAT(error_of([&] { (void)read_recording(file); }), HasSubstr("lines end with CR alone"));
}

TEST(OddFilesReference, HeadingsInLatinOne) {
  std::string text = "Zeit [s];Weg [\xB5m];Winkel [\xB0];a [m/s\xB2]\r\n";
  for (int i = 0; i < kRows; ++i) text += "0," + std::to_string(1000 + i).substr(1) + ";1,5;90;2\r\n";
  const Recording record = read_recording(keep("latin.csv", text));
  ASSERT_EQ(record.channels.size(), 3u);
  EXPECT_NEAR(record["Weg"][3], 1.5e-6, 1e-18);
  EXPECT_NEAR(record["Winkel"][3], std::acos(0.0), 1e-12);
  EXPECT_EQ(record["a"][3], 2);
}

}  // namespace
