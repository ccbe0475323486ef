// What happens to files when writing them goes wrong: full and broken disks, interrupted and short writes, kills,
// missing memory. WHIRL_FAULTS=all tries every write of every command (tools/fault_table.sh) and not three of them.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <thread>
#include <vector>

#include "program.hpp"

namespace whirl::testing {
namespace {

struct Case {
  std::string name, command, file;
};

class OutputE2e : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    folder = std::make_unique<Folder>();
    std::string csv = "t_s,x_mm,y_mm,beta_rad\n";
    for (int k = 0; k < 4000; ++k) {
      const double t = 1e-3 * k, b = 40 * t;
      csv += std::to_string(t) + "," + std::to_string(std::sin(b)) + "," + std::to_string(std::cos(b)) + "," +
             std::to_string(b) + "\n";
    }
    folder->write("r.csv", csv);
    std::string design = slurp(source_dir() + "/tests/fuzz/corpus/json/controller.json");
    for (const auto& [from, to] : {std::pair<std::string, std::string>{"\"C\"", "\"surface_gain\""},
                                   {"\"gain\": 0,", "\"gain\": 0.5,"},
                                   {"\"gain\":0,", "\"gain\":0.5,"}}) {
      if (const std::size_t at = design.find(from); at != std::string::npos) design.replace(at, from.size(), to);
    }
    folder->write("controller.json", design);
  }
  static void TearDownTestSuite() { folder.reset(); }
  static Outcome with(const std::string& environment, const std::string& arguments) {
    return folder->shell(environment + " LD_PRELOAD='" + binary_dir() + "/tests/libwhirl_fault_shim.so' '" + program() +
                         "' " + arguments);
  }
  /// Counts of writes, fsyncs, renames and large allocations of a sound run.
  static std::array<long, 4> count(const std::string& arguments) {
    std::filesystem::remove(*folder / "count.txt");
    const Outcome o = with("WHIRL_FAULT_COUNT=count.txt", arguments);
    EXPECT_EQ(o.exit_code, 0) << arguments << "\n" << o.err;
    std::array<long, 4> n{}, line{};
    std::ifstream in(*folder / "count.txt");
    while (in >> line[0] >> line[1] >> line[2] >> line[3]) {
      for (std::size_t i = 0; i < 4; ++i) n[i] = std::max(n[i], line[i]);  // children of the program count too
    }
    return n;
  }
  static std::vector<std::string> left_behind() {
    std::vector<std::string> out;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(*folder / "")) {
      if (entry.path().extension() == ".part") out.push_back(entry.path().filename());
    }
    return out;
  }
  static void forget_parts() {
    for (const std::string& name : left_behind()) std::filesystem::remove(*folder / name);
  }
  static std::unique_ptr<Folder> folder;
};
std::unique_ptr<Folder> OutputE2e::folder;

std::vector<Case> cases() {
  std::vector<Case> out;
  for (const char* ending : {"csv", "csv.gz", "h5", "wav", "mat", "unv", "lvm"})
    out.push_back({std::string("convert ") + ending, std::string("convert --force r.csv o.") + ending,
                   std::string("o.") + ending});
  for (const char* ending : {"csv", "h5"})
    out.push_back({std::string("parts to ") + ending, std::string("convert --force --stream r.csv o.") + ending,
                   std::string("o.") + ending});
  for (const char* ending : {"svg", "csv", "txt"})
    out.push_back({std::string("plot ") + ending, std::string("plot --force r.csv --out p.") + ending,
                   std::string("p.") + ending});
  out.push_back({"rig record", "rig record --force --out rec.csv --quiet", "rec.csv"});
  out.push_back({"report", "report --force r.csv --out page.html --quiet", "page.html"});
  return out;
}

TEST_F(OutputE2e, NoFaultLosesDataSilentlyDestroysAFileOrEndsInASignal) {
  const char* const which = std::getenv("WHIRL_FAULTS");
  const bool all = which != nullptr && std::string(which) == "all";
  long runs = 0, refused = 0, unharmed = 0;
  std::map<std::string, std::array<long, 3>> table;
  for (const Case& c : cases()) {
    const auto n = count(c.command);
    const std::string good = slurp(*folder / c.file);
    ASSERT_GT(good.size(), 10u) << c.name;
    ASSERT_GE(n[0], 1) << c.name << ": the shim saw no write";
    ASSERT_GE(n[1], 1) << c.name << ": nothing was flushed to the disk";
    const std::array<std::pair<const char*, long>, 8> faults{{{"enospc", n[0]},
                                                              {"eio", n[0]},
                                                              {"kill", n[0]},
                                                              {"fsync", 1},
                                                              {"rename", n[2]},
                                                              {"memory", n[3]},
                                                              {"eintr", 1},
                                                              {"short", 1}}};
    for (const auto& [kind, last] : faults) {
      std::vector<long> at;
      for (long k = 1; k <= last; ++k) {
        if (all || k == 1 || k == last) at.push_back(k);
      }
      for (const long k : at) {
        forget_parts();
        folder->write(c.file, "OLD");
        const std::string fault = std::string(kind) + ":" + std::to_string(k);
        const Outcome o = with("WHIRL_FAULT=" + fault, c.command);
        const std::string now = slurp(*folder / c.file), where = c.name + " " + fault + "\n" + o.err;
        ++runs;
        auto& row = table[c.name];
        ++row[0];
        if (o.exit_code == 0) {
          EXPECT_EQ(now == good, true) << where << ": success, but the file is another";
          ++unharmed, ++row[1];
        } else if (std::string(kind) == "kill") {
          EXPECT_EQ(o.exit_code, 137) << where;
          EXPECT_TRUE(now == "OLD" || now == good) << where << ": destroyed";
          ++refused, ++row[2];
        } else {
          EXPECT_EQ(o.exit_code, 2) << where;
          EXPECT_EQ(now, "OLD") << where << ": destroyed";
          EXPECT_TRUE(left_behind().empty()) << where;
          if (std::string(kind) != "memory") {
            EXPECT_NE(o.err.find(c.file), std::string::npos) << where << ": does not name the file";
          }
          ++refused, ++row[2];
        }
        if (std::string(kind) == "eintr" || std::string(kind) == "short") {
          EXPECT_EQ(o.exit_code, 0) << where;
        }
      }
    }
  }
  forget_parts();
  for (const auto& [name, row] : table)
    std::printf("%-20s %5ld faults  %5ld carried on with the same file  %5ld refused, file as before\n", name.c_str(),
                row[0], row[1], row[2]);
  std::printf("%ld faults: %ld carried on, %ld refused\n", runs, unharmed, refused);
}

TEST_F(OutputE2e, LinksAreFollowedAndKeptPermissionsToo) {
  std::filesystem::create_directory(*folder / "real");
  folder->write("real/target.csv", "OLD");
  chmod((*folder / "real/target.csv").c_str(), 0640);
  std::filesystem::create_symlink("real/target.csv", *folder / "link.csv");
  ASSERT_EQ(folder->whirl("convert r.csv link.csv").exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(*folder / "link.csv"));
  EXPECT_GT(slurp(*folder / "real/target.csv").size(), 1000u);
  struct stat now {};
  stat((*folder / "real/target.csv").c_str(), &now);
  EXPECT_EQ(now.st_mode & 0777, 0640u);
  // A link whose file is still missing.
  std::filesystem::create_symlink("real/new.h5", *folder / "dangling.h5");
  ASSERT_EQ(folder->whirl("convert r.csv dangling.h5").exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_symlink(*folder / "dangling.h5"));
  EXPECT_TRUE(std::filesystem::is_regular_file(*folder / "real/new.h5"));
}

TEST_F(OutputE2e, PipesAndDevicesAreWrittenThroughAndNeverReplaced) {
  const auto fifo = *folder / "fifo.svg";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  std::string got;
  std::thread reader([&] { got = slurp(fifo); });
  EXPECT_EQ(folder->whirl("plot r.csv --out fifo.svg").exit_code, 0) << slurp(*folder / "stderr.txt");
  reader.join();
  EXPECT_TRUE(std::filesystem::is_fifo(fifo));
  EXPECT_NE(got.find("</svg>"), std::string::npos);
  for (const char* ending : {"csv", "h5", "wav", "mat"}) {
    const std::string name = std::string("full.") + ending;
    std::filesystem::create_symlink("/dev/full", *folder / name);
    const Outcome o = folder->whirl("convert r.csv " + name);
    EXPECT_EQ(o.exit_code, 2) << name;
    EXPECT_NE(o.err.find(name), std::string::npos) << o.err;
    EXPECT_NE(o.err.find("No space left"), std::string::npos) << o.err;
    EXPECT_TRUE(std::filesystem::is_character_file("/dev/full"));
  }
  std::filesystem::create_symlink("/dev/null", *folder / "null.csv");
  EXPECT_EQ(folder->whirl("convert r.csv null.csv").exit_code, 0);
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/null"));
  // Standard output that is a file keeps what was printed.
  std::filesystem::create_symlink("/dev/stdout", *folder / "std.svg");
  const Outcome o = folder->whirl("plot r.csv --out std.svg");
  EXPECT_EQ(o.exit_code, 0) << o.err;
  EXPECT_NE(o.out.find("</svg>"), std::string::npos);
  EXPECT_LT(o.out.find("</svg>"), o.out.find("figure:")) << "nothing is written over";
}

TEST_F(OutputE2e, StandardOutputThatIsFullIsAnError) {
  for (const char* command : {"info r.csv --json", "rig parameters", "--help", "info r.csv"}) {
    const Outcome o = folder->whirl("--version > /dev/null; '" + program() + "' " + command +
                                    " >/dev/full 2>err.txt; echo $? > code.txt; true");
    EXPECT_EQ(slurp(*folder / "code.txt"), "2\n") << command;
    EXPECT_NE(slurp(*folder / "err.txt").find("standard output"), std::string::npos) << command;
    (void)o;
  }
}

TEST_F(OutputE2e, FoldersAreWrittenAsAWholeAndRefusalsLeaveNone) {
  ASSERT_EQ(folder->whirl("export c controller.json --out out_c --prefix d").exit_code, 0)
      << slurp(*folder / "stderr.txt");
  std::map<std::string, std::string> before;
  for (const auto& f : std::filesystem::directory_iterator(*folder / "out_c")) {
    folder->write("out_c/" + f.path().filename().string(), "OLD");
  }
  const auto n = count("export c controller.json --out out_count --prefix d");
  const Outcome o =
      with("WHIRL_FAULT=enospc:" + std::to_string(n[0]), "export c controller.json --out out_c --prefix d");
  EXPECT_EQ(o.exit_code, 2);
  for (const auto& f : std::filesystem::directory_iterator(*folder / "out_c"))
    EXPECT_EQ(slurp(f.path()), "OLD") << f.path();
  EXPECT_EQ(with("WHIRL_FAULT=enospc:1", "export c controller.json --out deep/new/c --prefix d").exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists(*folder / "deep"));
}

}  // namespace
}  // namespace whirl::testing
