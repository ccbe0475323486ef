// Files that were made to harm, and files that are cut off.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <hdf5.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <random>

#include "file_kinds.hpp"
#include "whirl/io/atfx.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/formats.hpp"
#include "whirl/io/record_stream.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/uff.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

/// Name, unit, length and sum of every signal.
std::string summary(const SignalFile& file) {
  std::string out;
  for (const SignalTable& table : file.tables) {
    for (const Signal& s : table.signals)
      out += fmt::format("{} {} {} {};", s.name, s.unit, s.value.size(), s.value.sum());
  }
  return out;
}

std::string content_of(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// An HDF5 file to which `add` gives what it holds, as HDF5 or, behind MATLAB's block, as MAT v7.3.
std::filesystem::path made_hdf5(const testing::TemporaryFolder& folder, const char* name, bool matlab,
                                const std::function<void(hid_t)>& add) {
  const std::filesystem::path path = folder.path() / name;
  const hid_t created = H5Pcreate(H5P_FILE_CREATE);
  if (matlab) H5Pset_userblock(created, 512);
  const hid_t file = H5Fcreate(path.c_str(), H5F_ACC_TRUNC, created, H5P_DEFAULT);
  add(file);
  H5Fclose(file);
  H5Pclose(created);
  if (matlab) {
    std::fstream block(path, std::ios::binary | std::ios::in | std::ios::out);
    block << "MATLAB 7.3 MAT-file, by a test";
  }
  return path;
}

void add_numbers(hid_t file, const char* name, hid_t plist) {
  const hsize_t size = 8;
  const hid_t space = H5Screate_simple(1, &size, nullptr);
  const hid_t data = H5Dcreate2(file, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, plist, H5P_DEFAULT);
  const double values[8] = {1, 2, 3, 4, 5, 6, 7, 8};
  if (plist == H5P_DEFAULT) H5Dwrite(data, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values);
  H5Dclose(data);
  H5Sclose(space);
}

// Whoever makes a file chooses what is read with it: another file of the machine is none of its business.
TEST(HostileFiles, HdfDatasetsThatStandInOtherFilesAreRefused) {
  const testing::TemporaryFolder folder;
  folder.write("secret.txt", std::string(64, 's'));
  const std::filesystem::path source =
      made_hdf5(folder, "source.h5", false, [](hid_t file) { add_numbers(file, "x", H5P_DEFAULT); });
  for (const bool matlab : {false, true}) {
    const char* const name = matlab ? "a.mat" : "a.h5";
    const auto external = made_hdf5(folder, name, matlab, [&](hid_t file) {
      const hid_t plist = H5Pcreate(H5P_DATASET_CREATE);
      H5Pset_external(plist, (folder.path() / "secret.txt").c_str(), 0, 64);
      add_numbers(file, "x", plist);
      H5Pclose(plist);
    });
    EXPECT_THAT(testing::error_of([&] { (void)read_signals(external); }),
                AllOf(HasSubstr(name), HasSubstr("dataset 'x' keeps its values in another file")));
    EXPECT_THAT(testing::error_of([&] { (void)read_hdf5_rows(external, 0, 4); }), HasSubstr("in another file"));
    const auto put_together = made_hdf5(folder, name, matlab, [&](hid_t file) {
      const hid_t plist = H5Pcreate(H5P_DATASET_CREATE);
      const hsize_t size = 8;
      const hid_t space = H5Screate_simple(1, &size, nullptr);
      H5Pset_virtual(plist, space, source.c_str(), "x", space);
      add_numbers(file, "x", plist);
      H5Sclose(space);
      H5Pclose(plist);
    });
    EXPECT_THAT(testing::error_of([&] { (void)read_signals(put_together); }),
                HasSubstr("put together from other files"));
    const auto linked = made_hdf5(folder, name, matlab, [&](hid_t file) {
      add_numbers(file, "y", H5P_DEFAULT);
      H5Lcreate_external(source.c_str(), "x", file, "x", H5P_DEFAULT, H5P_DEFAULT);
    });
    const SignalFile file = read_signals(linked);
    EXPECT_THAT(file.findings, ::testing::Contains(HasSubstr("1 links to other files (not followed)")));
    ASSERT_EQ(file.tables.size(), 1U);
    EXPECT_EQ(file.tables[0].signals.size(), 1U);
  }
}

// Deep and wide trees are sound files.
TEST(HostileFiles, NestedGroupsAndManyScalarsAreRead) {
  const testing::TemporaryFolder folder;
  const auto path = made_hdf5(folder, "deep.h5", false, [](hid_t file) {
    hid_t at = file;
    for (int i = 0; i < 3000; ++i) {
      const hid_t next = H5Gcreate2(at, "g", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
      if (at != file) H5Gclose(at);
      at = next;
    }
    H5Gclose(at);
    add_numbers(file, "x", H5P_DEFAULT);
  });
  EXPECT_EQ(read_signals(path).tables.size(), 1U);
}

// One array of a megabyte of zeros packs into a kilobyte; a hundred entries that share it are a hundred megabytes.
TEST(HostileFiles, MembersOfAnArchiveMayNotShareTheirBytes) {
  const testing::TemporaryFolder folder;
  const std::string member = testing::npy("'<f8'", "(1000,)", std::string(8000, '\0'));
  const std::string sound = testing::zip({{"a.npy", member}, {"b.npy", member}}, true);
  folder.write("sound.npz", sound);
  EXPECT_EQ(read_signals(folder.path() / "sound.npz").tables.size(), 1U);
  std::string shared = sound;  // the second entry of the directory points to the first member
  const std::size_t second = shared.rfind("PK\x01\x02");
  std::memset(shared.data() + second + 42, 0, 4);
  folder.write("shared.npz", shared);
  EXPECT_THAT(testing::error_of([&] { (void)read_signals(folder.path() / "shared.npz"); }),
              HasSubstr("member 'b.npy' lies inside another"));
}

TEST(HostileFiles, TheSizeIsLookedAtBeforeReading) {
  const testing::TemporaryFolder folder;
  folder.write("big.wav", "RIFF\xff\xff\xff\xffWAVEfmt ");
  std::filesystem::resize_file(folder.path() / "big.wav", std::uintmax_t{10} << 30);  // sparse
  EXPECT_THAT(testing::error_of([&] { (void)read_signals(folder.path() / "big.wav"); }),
              HasSubstr("larger than the limit of 1073741824 bytes"));
}

// The binary parts of an ATFX stand beside it: what it names elsewhere is another file of the machine.
TEST(HostileFiles, BinaryPartsStandBesideTheirAtfx) {
  const testing::TemporaryFolder folder;
  folder.write("a/part.bin", std::string(64, 's'));
  folder.write("secret.bin", std::string(64, 's'));
  const auto read = [&](const std::string& part) {
    folder.write("a/a.atfx",
                 "<atfx_file><files><component><identifier>c</identifier><filename>" + part +
                     "</filename></component></files><application_model><application_element><name>lc</name>"
                     "<basetype>AoLocalColumn</basetype>"
                     "<application_attribute><name>n</name><base_attribute>name</base_attribute>"
                     "</application_attribute>"
                     "<application_attribute><name>v</name><base_attribute>values</base_attribute>"
                     "</application_attribute></application_element></application_model>"
                     "<instance_data><lc><n>x</n><v><component><identifier>c</identifier>"
                     "<datatype>ieeefloat8</datatype><length>8</length><inioffset>0</inioffset></component></v>"
                     "</lc></instance_data></atfx_file>");
    return testing::error_of([&] { EXPECT_EQ(read_atfx(folder.path() / "a/a.atfx").columns[0].size(), 8); });
  };
  EXPECT_EQ(read("part.bin"), "no error");
  for (const std::string& part :
       {(folder.path() / "secret.bin").string(), std::string("../secret.bin"), std::string("b/../../secret.bin")})
    EXPECT_THAT(read(part), HasSubstr("must be beside it or below"));
}

TEST(CutFiles, AWavSaysHowManySamplesAreMissing) {
  const testing::TemporaryFolder folder;
  Recording record;
  record.dt = 1e-3;
  record.add("x", Quantity::displacement, Eigen::VectorXd::LinSpaced(3000, 0, 1));
  write_wav(folder.path() / "whole.wav", record);
  const std::string whole = content_of(folder.path() / "whole.wav");
  EXPECT_TRUE(parse_wav(whole, "a.wav").findings.empty());
  const SignalFile cut = parse_wav(std::string_view(whole).substr(0, whole.size() - 8 * 1503), "a.wav");
  ASSERT_EQ(cut.findings.size(), 1U);
  EXPECT_EQ(cut.findings[0], "cut off: its header states 3000 samples, 1497 are present, 1503 are missing");
}

// Every format written here, cut at 60 places: an error, a finding, or nothing of it is missing. CSV alone cannot know
// that a line more was to come.
TEST(CutFilesProperty, NothingIsShorterInSilence) {
  Recording record;
  record.dt = 1e-3;
  record.add("x", Quantity::displacement, Eigen::VectorXd::LinSpaced(200, 0, 1e-3));
  record.add("y", Quantity::displacement, Eigen::VectorXd::LinSpaced(200, 1e-3, -2e-3));
  record.add("speed", Quantity::angular_velocity, Eigen::VectorXd::LinSpaced(200, 100, 120));
  for (const std::string ending : {".csv.gz", ".h5", ".mat", ".npz", ".wav", ".lvm", ".uff", ".lvm.gz", ".uff.gz"}) {
    const testing::TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / ("record" + ending);
    write_recording(path, record);
    const std::string whole = content_of(path), expected = summary(read_signals(path));
    std::vector<std::size_t> places;
    for (std::size_t i = 1; i <= 40; ++i) places.push_back(whole.size() * i / 41);
    for (std::size_t i = 1; i <= 20; ++i) places.push_back(whole.size() - i);
    for (const std::size_t place : places) {
      std::ofstream(path, std::ios::binary) << whole.substr(0, place);
      int remarks = 0;
      const RemarkHandler before =
          set_remark_handler([&](const std::string&, const std::string&, RemarkCode) { ++remarks; });
      try {
        const SignalFile file = read_signals(path);
        if (file.findings.empty() && remarks == 0 && !file.tables.empty()) {
          EXPECT_EQ(summary(file), expected) << ending << " cut at " << place << " of " << whole.size();
        }
      } catch (const Error&) {
      }
      set_remark_handler(before);
    }
  }
}

/// What of 60 cuts of a file came to what.
struct CutCounts {
  int refused = 0, told = 0, at_a_line = 0;  ///< at the end of a line: what another writer could have meant
};

CutCounts cut_everywhere(const testing::FileKind& kind, const testing::TemporaryFolder& folder, std::mt19937_64 random,
                         const std::function<SignalFile(const std::filesystem::path&)>& read) {
  constexpr std::size_t kCuts = 60, kAtTheEnd = 20;
  int remarks = 0;
  const RemarkHandler before =
      set_remark_handler([&](const std::string&, const std::string&, RemarkCode) { ++remarks; });
  const std::filesystem::path path = folder.path() / kind.name;
  folder.write(kind.name, kind.bytes);
  const SignalFile whole = read(path);
  EXPECT_FALSE(whole.tables.empty()) << kind.name;
  EXPECT_EQ(remarks, 0) << kind.name;
  CutCounts counts;
  for (std::size_t k = 0; k < kCuts; ++k) {
    const std::size_t size = kind.bytes.size(), place = k < kAtTheEnd ? size - 1 - k : 1 + random() % (size - 1);
    folder.write(kind.name, kind.bytes.substr(0, place));
    remarks = 0;
    try {
      const SignalFile file = read(path);
      if (file.findings.size() > whole.findings.size() || remarks > 0) {
        ++counts.told;
      } else if (kind.plain_lines && kind.bytes[place - 1] == '\n') {
        ++counts.at_a_line;
      } else {
        EXPECT_EQ(summary(file), summary(whole)) << kind.name << " cut at " << place << " of " << size;
      }
    } catch (const Error&) {
      ++counts.refused;
    }
  }
  set_remark_handler(before);
  return counts;
}

// 40 kinds of files, each read whole and in parts: refused, or said to be shorter.
TEST(CutFilesProperty, NoKindOfFileIsShorterInSilence) {
  std::mt19937_64 random(20);
  Recording record;
  record.dt = 1.0 / 1000;
  for (const char* name : {"x", "y"}) {
    std::uniform_real_distribution<double> value(-0.9, 0.9);
    record.add(name, Quantity::displacement, Eigen::VectorXd::NullaryExpr(240, [&] { return value(random); }));
  }
  const testing::TemporaryFolder folder;
  const std::vector<testing::FileKind> kinds = testing::readable_kinds(record, folder.path());
  EXPECT_GE(kinds.size(), 35U);
  CutCounts sum;
  for (const testing::FileKind& kind : kinds) {
    for (const bool parts : {false, true}) {
      const CutCounts counts = cut_everywhere(kind, folder, random, [&](const std::filesystem::path& path) {
        return parts ? read_signal_rows(path, {}, {.each = 150}) : read_signals(path);
      });
      sum.refused += counts.refused;
      sum.told += counts.told;
      sum.at_a_line += counts.at_a_line;
    }
    random.discard(60);
  }
  EXPECT_GT(sum.refused, 1000);
  EXPECT_GT(sum.told, 1000);
  EXPECT_LT(sum.at_a_line, 60);
}

// The number that is cut is read as another one: with the line end nothing is said.
TEST(CutFiles, ALastLineWithoutItsEndIsTold) {
  const testing::TemporaryFolder folder;
  std::vector<std::pair<std::string, RemarkCode>> told;
  const RemarkHandler before = set_remark_handler(
      [&](const std::string&, const std::string& text, RemarkCode code) { told.emplace_back(text, code); });
  for (const char* text : {"t_s,x_m\n0,1.5\n1,2.5\n2,3.2", "t_s,x_m\r\n0,1.5\r\n1,2.5\r\n2,3.25\r"}) {
    told.clear();
    folder.write("a.csv", text);
    (void)read_csv(folder.path() / "a.csv");
    ASSERT_EQ(told.size(), 1U) << text;
    EXPECT_EQ(told[0].first, "line 4 has no line end: its last number may be cut off");
    EXPECT_EQ(to_string(told[0].second), "open_last_line");
    EXPECT_TRUE(is_information(told[0].second));
  }
  for (const char* text : {"t_s,x_m\n0,1.5\n1,2.5\n", "t_s;x_m;\n0;1.5;\n1;2.5;"}) {
    told.clear();
    folder.write("a.csv", text);
    (void)read_csv(folder.path() / "a.csv");
    EXPECT_TRUE(told.empty()) << text;
  }
  set_remark_handler(before);
}

// What is left of a dataset is the -1 before it.
TEST(CutFiles, AUniversalFileThatEndsWithAnOpeningMarkIsTold) {
  Recording record;
  record.dt = 1e-3;
  record.add("x", Quantity::displacement, Eigen::VectorXd::LinSpaced(50, 0, 1e-3));
  const std::string whole = format_uff(uff_from_recording(record));
  EXPECT_TRUE(parse_uff(whole, "a.uff").warnings.empty());
  EXPECT_THAT(parse_uff(whole + "    -1\n", "a.uff").warnings,
              ::testing::Contains(HasSubstr("the file ends: cut off?")));
}

// A universal file holds one block a channel: a cut between two leaves a sound file of fewer channels.
TEST(CutFilesProperty, AUniversalFileStatesTheNumberOfItsFunctions) {
  Recording record;
  record.dt = 1e-3;
  for (const char* name : {"x", "y", "z"})
    record.add(name, Quantity::displacement, Eigen::VectorXd::LinSpaced(50, 0, 1e-3));
  const testing::TemporaryFolder folder;
  const std::filesystem::path path = folder.path() / "a.uff";
  write_recording(path, record);
  const std::string whole = content_of(path);
  EXPECT_TRUE(read_uff(path).warnings.empty());
  int silent = 0;
  for (std::size_t place = 1; place < whole.size(); ++place) {
    try {
      const UffFile file = parse_uff(std::string_view(whole).substr(0, place), "a.uff");
      if (file.functions.empty()) continue;  // no record: an error to whoever wants one
      const bool complete = file.functions.size() == 3 && file.functions.back().value.size() == 50;
      if (file.warnings.empty() && !complete && ++silent == 1) ADD_FAILURE() << place << " of " << whole.size();
    } catch (const Error&) {
    }
  }
  EXPECT_EQ(silent, 0);
}

}  // namespace
}  // namespace whirl::io
