// Files as MATLAB, Octave, NumPy, h5py and LabVIEW write them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <zlib.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/remarks.hpp"
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

class File {
 public:
  File(const std::string& name, const std::string& bytes)
      : path_(std::filesystem::path(::testing::TempDir()) / ("foreign_" + name)) {
    std::ofstream(path_, std::ios::binary) << bytes;
  }
  ~File() { std::filesystem::remove(path_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;
  operator std::filesystem::path() const { return path_; }
  std::string string() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

constexpr int kSamples = 50, kLines = 40;

std::vector<double> wave(double a, int n = kSamples) {
  std::vector<double> v;
  for (int i = 0; i < n; ++i) v.push_back(a * std::sin(0.3 * i) + 0.01 * i);
  return v;
}
std::vector<double> times() {
  std::vector<double> v;
  for (int i = 0; i < kSamples; ++i) v.push_back(0.002 * i);
  return v;
}
std::vector<double> frequencies() {
  std::vector<double> v;
  for (int i = 0; i < kLines; ++i) v.push_back(5 + 0.25 * i);
  return v;
}
double part(int o, int r, int line, bool imaginary) { return (imaginary ? -1 : 1) * (100 * o + 10 * r) + 0.5 * line; }
template <class T>
std::string bytes_of(const std::vector<T>& values, bool big = false) {
  Bytes b(big);
  for (const T v : values) b.put(v);
  return b.str();
}

// Three responses to two references, line by line.
void expect_matrix(const FrequencyResponse& frf) {
  ASSERT_EQ(frf.channels.size(), 6u);
  ASSERT_EQ(frf.frequency.size(), kLines);
  EXPECT_NEAR(frf.frequency[1] - frf.frequency[0], 0.25, 1e-12);
  EXPECT_NEAR(frf.frequency[0], 5, 1e-12);
  EXPECT_EQ(frf.kind, FrfKind::accelerance);
  for (int o = 1; o <= 3; ++o) {
    for (int r = 1; r <= 2; ++r) {
      bool found = false;
      for (const FrfChannel& c : frf.channels) {
        if (!c.response.ends_with("out" + std::to_string(o)) || !c.reference.ends_with("in" + std::to_string(r)))
          continue;
        found = true;
        for (int i = 0; i < kLines; ++i)
          ASSERT_EQ(c.value[i], std::complex<double>(part(o, r, i, false), part(o, r, i, true))) << o << r << i;
      }
      EXPECT_TRUE(found) << o << r;
    }
  }
}

TEST(ForeignFormatsReference, MatVersion4InBothByteOrders) {
  for (const bool big : {false, true}) {
    std::vector<double> two = wave(1e-3);
    const std::vector<double> second = wave(2e-3);
    two.insert(two.end(), second.begin(), second.end());
    const File file("v4.mat", mat4_matrix("t_s", kSamples, 1, times(), {}, big) +
                                  mat4_matrix("x_mm", 1, kSamples, wave(2.0), {}, big) +
                                  mat4_matrix("acc_m_s2", kSamples, 2, two, {}, big));
    const SignalFile signals = read_signals(file);
    EXPECT_EQ(signals.format, "MAT v4");
    EXPECT_THAT(signals.findings, ::testing::IsEmpty());
    const Recording record = recording_of(signals);
    EXPECT_NEAR(record.dt, 0.002, 1e-15);
    ASSERT_EQ(record.channels.size(), 3u);
    EXPECT_NEAR(record["x"][7], 1e-3 * wave(2.0)[7], 1e-15);
    EXPECT_EQ(record["acc(2)"][9], second[9]);
  }
}

TEST(ForeignFormatsReference, MatVersion4HoldsFrequencyResponses) {
  std::vector<double> re, im;
  for (int c = 1; c <= 2; ++c) {
    for (int i = 0; i < kLines; ++i) re.push_back(part(c, 1, i, false)), im.push_back(part(c, 1, i, true));
  }
  const File file("frf4.mat", mat4_matrix("freq", kLines, 1, frequencies()) + mat4_matrix("H", kLines, 2, re, im));
  EXPECT_THAT(error_of([&] { (void)read_responses(file); }), HasSubstr("state --kind"));
  const auto frf = read_responses(file, FrfKind::mobility);
  ASSERT_TRUE(frf);
  ASSERT_EQ(frf->channels.size(), 2u);
  EXPECT_EQ(frf->kind, FrfKind::mobility);
  EXPECT_EQ(frf->channels[1].value[3], std::complex<double>(part(2, 1, 3, false), part(2, 1, 3, true)));
}

// The axis as most scripts call it: f in Hz, w or omega in rad/s; what is no axis of complex lines stays a signal.
TEST(ForeignFormatsReference, FrequencyAxesCalledByALetter) {
  std::vector<double> re, im, angular;
  for (int i = 0; i < kLines; ++i) re.push_back(part(1, 1, i, false)), im.push_back(part(1, 1, i, true));
  for (const double f : frequencies()) angular.push_back(2 * std::numbers::pi * f);
  for (const std::string name : {"f", "w", "Omega"}) {
    const File file("axis.mat", mat4_matrix(name, 1, kLines, name == "f" ? frequencies() : angular) +
                                    mat4_matrix("H", kLines, 1, re, im));
    const auto frf = read_responses(file, FrfKind::receptance);
    ASSERT_TRUE(frf) << name;
    EXPECT_NEAR(frf->frequency[0], 5, 1e-9) << name;
    EXPECT_NEAR(frf->frequency[kLines - 1], frequencies().back(), 1e-9) << name;
    ASSERT_EQ(frf->summary.warnings.size(), 1u) << name;
    EXPECT_THAT(frf->summary.warnings[0], HasSubstr(name == "f" ? "taken as Hz" : "taken as rad/s"));
  }
  // A force beside them, and a record without complex lines.
  const File force("force.mat", mat4_matrix("freq", 1, kLines, frequencies()) + mat4_matrix("f", 1, kLines, re) +
                                    mat4_matrix("H", kLines, 1, re, im));
  EXPECT_EQ(read_responses(force, FrfKind::receptance)->channels.size(), 1u);
  const File record("record.mat", mat4_matrix("f", 1, kLines, frequencies()) + mat4_matrix("x_m", 1, kLines, re));
  EXPECT_FALSE(read_responses(record, FrfKind::receptance));
}

TEST(ForeignFormatsReference, MatVersion5StructuresAndCells) {
  const std::string run =
      mat5_struct("run", {{"t_s", mat5_double("", {kSamples, 1}, times())},
                          {"sensors", mat5_struct("", {{"x_mm", mat5_double("", {kSamples, 1}, wave(3.0))}})},
                          {"note", mat5_array(4, "", {1, 2}, mat5_element(4, std::string("a\0b\0", 4)))}});
  const std::string cells =
      mat5_array(1, "parts", {1, 2}, mat5_double("", {kSamples, 1}, wave(4.0)) + mat5_double("", {1, 1}, {7}));
  const File file("struct.mat",
                  mat5_file(run + cells + mat5_array(16, "handle", {1, 1}, mat5_double("", {1, 1}, {1}))));
  const SignalFile signals = read_signals(file);
  std::vector<std::string> names;
  for (const SignalTable& table : signals.tables) {
    for (const Signal& signal : table.signals) names.push_back(signal.name);
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("x", "parts{1}"));  // no function handle
  EXPECT_THAT(signals.contents, Contains(HasSubstr("function handle")));
  EXPECT_THAT(signals.contents, Contains(HasSubstr("run.note")));
  const Recording record = recording_of(signals, {.columns = {"x"}});
  EXPECT_NEAR(record.dt, 0.002, 1e-15);
  EXPECT_NEAR(record["x"][11], 1e-3 * wave(3.0)[11], 1e-15);
}

TEST(ForeignFormatsReference, MatVersion5FrequencyResponseMatrix) {
  // outputs x inputs x lines, first index fastest.
  std::vector<double> re, im;
  for (int i = 0; i < kLines; ++i) {
    for (int r = 1; r <= 2; ++r) {
      for (int o = 1; o <= 3; ++o) re.push_back(part(o, r, i, false)), im.push_back(part(o, r, i, true));
    }
  }
  const File file("frf5.mat", mat5_file(mat5_struct("test", {{"freq", mat5_double("", {1, kLines}, frequencies())},
                                                             {"H", mat5_double("", {3, 2, kLines}, re, im)}})));
  const auto frf = read_responses(file, FrfKind::accelerance);
  ASSERT_TRUE(frf);
  expect_matrix(*frf);
}

TEST(ForeignFormatsProperty, DamagedMatFilesGiveAnErrorOrAResult) {
  const std::string good = mat5_file(
      mat5_struct("run", {{"t_s", mat5_double("", {kSamples, 1}, times())},
                          {"inner", mat5_struct("", {{"x_mm", mat5_double("", {kSamples, 1}, wave(3.0))}})}}));
  const std::string old = mat4_matrix("t_s", kSamples, 1, times()) + mat4_matrix("x_mm", kSamples, 1, wave(1));
  const std::string waves = tdms({{"a", "g", wave(1)}, {"b", "N", wave(2)}}, 0.001, 2);
  const std::string numpy = zip(
      {{"t_s.npy", npy("'<f8'", "(50,)", bytes_of(times()))}, {"x_mm.npy", npy("'<f8'", "(50,)", bytes_of(wave(1)))}},
      true);
  std::mt19937 random(20240117);
  for (const std::string& whole : {good, old, waves, numpy}) {
    for (int k = 0; k < 400; ++k) {
      std::string bad = whole;
      for (int n = 0; n < 1 + k % 4; ++n) bad[random() % bad.size()] = static_cast<char>(random());
      if (k % 5 == 0) bad.resize(random() % bad.size());
      const File file("damaged", bad);
      try {
        (void)read_signals(file);
      } catch (const Error&) {
      }
    }
  }
}

TEST(ForeignFormatsReference, NumpyArraysOfEveryType) {
  const auto check = [](const std::string& descr, const std::string& data, double scale) {
    const File file("one.npy", npy("'" + descr + "'", "(3,)", data));
    const SignalFile signals = read_signals(file);
    ASSERT_EQ(signals.tables.size(), 1u) << descr;
    for (int i = 0; i < 3; ++i) EXPECT_EQ(signals.tables[0].signals[0].value[i], scale * (i + 1)) << descr;
  };
  check("<f8", bytes_of<double>({0.5, 1, 1.5}), 0.5);
  check(">f8", bytes_of<double>({0.5, 1, 1.5}, true), 0.5);
  check("<f4", bytes_of<float>({0.5, 1, 1.5}), 0.5);
  check("<f2", bytes_of<std::uint16_t>({0x3800, 0x3C00, 0x3E00}), 0.5);
  check("<i2", bytes_of<std::int16_t>({-1, -2, -3}), -1);
  check(">i4", bytes_of<std::int32_t>({-2, -4, -6}, true), -2);
  check("<i8", bytes_of<std::int64_t>({3, 6, 9}), 3);
  check("|u1", bytes_of<std::uint8_t>({1, 2, 3}), 1);
}

TEST(ForeignFormatsReference, NumpyArchivesStoredAndDeflated) {
  for (const bool deflated : {false, true}) {
    const File file("archive.npz", zip({{"t_s.npy", npy("'<f8'", "(50,)", bytes_of(times()))},
                                        {"x_mm.npy", npy("'<f8'", "(50, 1)", bytes_of(wave(3)), true)}},
                                       deflated));
    const Recording record = read_recording(file);
    EXPECT_NEAR(record.dt, 0.002, 1e-15);
    EXPECT_NEAR(record["x"][49], 1e-3 * wave(3)[49], 1e-15);
  }
  const File fields(
      "fields.npy",
      npy("[('t_s', '<f8'), ('x_mm', '<i2')]", "(3,)",
          Bytes().put(0.0).put<std::int16_t>(1).put(0.1).put<std::int16_t>(2).put(0.2).put<std::int16_t>(3).str()));
  EXPECT_NEAR(read_recording(fields)["x"][2], 3e-3, 1e-15);
  // lines x outputs x inputs, last index fastest, complex
  std::vector<double> h;
  for (int i = 0; i < kLines; ++i) {
    for (int o = 1; o <= 3; ++o) {
      for (int r = 1; r <= 2; ++r) h.push_back(part(o, r, i, false)), h.push_back(part(o, r, i, true));
    }
  }
  const File frf("frf.npz", zip({{"freq.npy", npy("'<f8'", "(40,)", bytes_of(frequencies()))},
                                 {"H.npy", npy("'<c16'", "(40, 3, 2)", bytes_of(h))}},
                                true));
  const auto found = read_responses(frf, FrfKind::accelerance);
  ASSERT_TRUE(found);
  expect_matrix(*found);
}

TEST(ForeignFormatsReference, ARecordComesBackFromItsArchiveToTheLastBit) {
  Recording record;
  record.dt = 1.0 / 4096;
  record.t0 = 0.25;
  Eigen::VectorXd x = Eigen::VectorXd::Random(300);
  record.add("x", Quantity::displacement, x);
  const File file("back.npz", "");
  write_recording(file, record);
  const Recording back = read_recording(file);
  EXPECT_EQ(back["x"], x);
  EXPECT_NEAR(back.dt, record.dt, 1e-16);
  EXPECT_NEAR(back.t0, record.t0, 1e-15);
}

TEST(ForeignFormatsReference, Hdf5BehindAUserBlockWithRatesOfTheGroupAndResponses) {
  const File file("h5py.h5", "");
  std::filesystem::remove(file);
  const hid_t create = H5Pcreate(H5P_FILE_CREATE);
  H5Pset_userblock(create, 2048);
  const hid_t h = H5Fcreate(file.string().c_str(), H5F_ACC_TRUNC, create, H5P_DEFAULT);
  const hid_t group = H5Gcreate2(h, "run1", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
  const hid_t scalar = H5Screate(H5S_SCALAR);
  const double rate = 500;
  const hid_t attribute = H5Acreate2(group, "sample_rate", H5T_IEEE_F64LE, scalar, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, H5T_NATIVE_DOUBLE, &rate);
  H5Aclose(attribute);
  const auto write = [&](hid_t where, const char* name, std::vector<hsize_t> sizes, hid_t type, hid_t memory,
                         const void* data) {
    const hid_t space = H5Screate_simple(static_cast<int>(sizes.size()), sizes.data(), nullptr);
    const hid_t set = H5Dcreate2(where, name, type, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(set, memory, H5S_ALL, H5S_ALL, H5P_DEFAULT, data);
    H5Dclose(set);
    H5Sclose(space);
  };
  write(group, "x_mm", {kSamples}, H5T_IEEE_F32LE, H5T_NATIVE_DOUBLE, wave(2).data());
  write(h, "freq", {kLines}, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, frequencies().data());
  const hid_t complex = H5Tcreate(H5T_COMPOUND, 16);
  H5Tinsert(complex, "r", 0, H5T_NATIVE_DOUBLE);
  H5Tinsert(complex, "i", 8, H5T_NATIVE_DOUBLE);
  std::vector<double> values;
  for (int o = 1; o <= 3; ++o) {
    for (int r = 1; r <= 2; ++r) {
      for (int i = 0; i < kLines; ++i) values.push_back(part(o, r, i, false)), values.push_back(part(o, r, i, true));
    }
  }
  write(h, "H", {3, 2, kLines}, complex, complex, values.data());
  H5Tclose(complex);
  H5Sclose(scalar);
  H5Gclose(group);
  H5Fclose(h);
  H5Pclose(create);
  const Recording record = recording_of(read_signals(file));
  EXPECT_NEAR(record.dt, 0.002, 1e-15);
  EXPECT_NEAR(record["x"][3], 1e-3 * wave(2)[3], 1e-9);
  const auto frf = read_responses(file, FrfKind::accelerance);
  ASSERT_TRUE(frf);
  expect_matrix(*frf);
}

// The library takes for granted that a chunk holds what its size says, and reads beyond its end where it does not.
TEST(ForeignFormats, AnHdf5ChunkShorterThanItsSizeIsRefused) {
  constexpr hsize_t kRows = 1000, kChunk = 400;
  for (const bool deflated : {false, true}) {
    const File file("chunk.h5", "");
    std::filesystem::remove(file);
    const hid_t h = H5Fcreate(file.string().c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    const hid_t space = H5Screate_simple(1, &kRows, nullptr), create = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(create, 1, &kChunk);
    H5Pset_shuffle(create);
    H5Pset_deflate(create, 6);
    const hid_t set = H5Dcreate2(h, "x_mm", H5T_IEEE_F64LE, space, H5P_DEFAULT, create, H5P_DEFAULT);
    const std::vector<double> values(kRows, 1.5);
    H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data());
    H5Fflush(h, H5F_SCOPE_LOCAL);
    EXPECT_EQ(read_signals(file).tables.at(0).rows(), static_cast<Eigen::Index>(kRows));
    std::vector<unsigned char> chunk(80, 7);
    if (deflated) {
      uLongf size = compressBound(chunk.size());
      std::vector<unsigned char> packed(size);
      compress(packed.data(), &size, chunk.data(), chunk.size());
      packed.resize(size);
      chunk = packed;
    }
    const hsize_t second = kChunk;
    H5Dwrite_chunk(set, H5P_DEFAULT, deflated ? 0 : 3, &second, chunk.size(), chunk.data());
    H5Dclose(set);
    H5Pclose(create);
    H5Sclose(space);
    H5Fclose(h);
    EXPECT_THAT(error_of([&] { read_signals(file); }), HasSubstr("shorter than it says"));
  }
}

TEST(ForeignFormatsReference, TdmsSegmentsInterleavedAndCutOff) {
  for (const bool interleaved : {false, true}) {
    const File file("run.tdms", tdms({{"a", "g", wave(1)}, {"b", "N", wave(2)}}, 0.001, 5, interleaved));
    const Recording record = read_recording(file);
    ASSERT_EQ(record.channels.size(), 2u);
    EXPECT_NEAR(record.dt, 0.001, 1e-15);
    EXPECT_EQ(record.size(), kSamples);
    EXPECT_NEAR(record["a"][33], 9.80665 * wave(1)[33], 1e-12);
    EXPECT_EQ(record["b"][49], wave(2)[49]);
  }
  const File cut("cut.tdms", tdms({{"a", "g", wave(1)}}, 0.001, 5, false, 17));
  const SignalFile signals = read_signals(cut);
  EXPECT_THAT(signals.findings, Contains(HasSubstr("cut off")));
  EXPECT_EQ(signals.tables[0].signals[0].value.size(), kSamples - 3);
}

TEST(ForeignFormats, RemarksOfReadersAreTold) {
  std::vector<std::string> told;
  const auto before =
      set_remark_handler([&](const std::string&, const std::string& text, RemarkCode) { told.push_back(text); });
  const File cut("cut.tdms", tdms({{"a", "g", wave(1)}}, 0.001, 5, false, 17));
  (void)read_recording(cut);
  set_remark_handler(before);
  EXPECT_THAT(told, Contains(HasSubstr("cut off")));
}

TEST(ForeignFormats, StepOfAUniversalFileIsExact) {
  Recording record;
  record.dt = 1.0 / 12800 * (1 + 2.6e-6);
  record.t0 = 0.1234567890123;
  record.add("x", Quantity::displacement, Eigen::VectorXd::Random(64));
  std::vector<std::string> told;
  const auto before =
      set_remark_handler([&](const std::string&, const std::string& text, RemarkCode) { told.push_back(text); });
  const File file("exact.uff", "");
  write_recording(file, record);
  set_remark_handler(before);
  EXPECT_THAT(told, Contains(HasSubstr("six digits")));
  const Recording back = read_recording(file);
  EXPECT_DOUBLE_EQ(back.dt, record.dt);
  EXPECT_DOUBLE_EQ(back.t0, record.t0);
}

TEST(ForeignFormats, ImplicitColumnsOfManyRows) {
  const auto file = [](const std::string& rows, const std::string& second) {
    return "<?xml version=\"1.0\"?><atfx_file><application_model>"
           "<application_element><name>Sub</name><basetype>AoSubmatrix</basetype>"
           "<application_attribute><name>Id</name><base_attribute>id</base_attribute></application_attribute>"
           "<application_attribute><name>Rows</name><base_attribute>number_of_rows</base_attribute></"
           "application_attribute>"
           "</application_element><application_element><name>Col</name><basetype>AoLocalColumn</basetype>"
           "<application_attribute><name>Name</name><base_attribute>name</base_attribute></application_attribute>"
           "<application_attribute><name>Rep</name><base_attribute>sequence_representation</base_attribute></"
           "application_attribute>"
           "<application_attribute><name>Par</name><base_attribute>generation_parameters</base_attribute></"
           "application_attribute>"
           "<application_attribute><name>Values</name><base_attribute>values</base_attribute></application_attribute>"
           "<relation_attribute><name>Of</name><base_relation>submatrix</base_relation></relation_attribute>"
           "</application_element></application_model><instance_data><Sub><Id>1</Id><Rows>" +
           rows +
           "</Rows></Sub><Col><Name>ramp</Name><Of>1</Of><Rep>implicit_linear</Rep><Par>0 0.5</Par></Col>"
           "<Col><Name>bad</Name><Of>1</Of><Rep>" +
           second + "</Rep><Par>0 1</Par></Col></instance_data></atfx_file>";
  };
  const File many("many.atfx", file("250000", "implicit_cubic"));
  const SignalFile signals = read_signals(many);
  ASSERT_EQ(signals.tables.size(), 1u);
  EXPECT_EQ(signals.tables[0].rows(), 250000);
  EXPECT_EQ(signals.tables[0].signals[0].value[249999], 0.5 * 249999);
  EXPECT_THAT(signals.findings, Contains(HasSubstr("left out: column 'bad'")));
  const File endless("endless.atfx", file("999999999999", "implicit_linear"));
  EXPECT_THAT(error_of([&] { (void)read_signals(endless); }), HasSubstr("rows"));
}

}  // namespace
