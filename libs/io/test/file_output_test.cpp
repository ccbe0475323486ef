#include <dlfcn.h>
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/temporary.hpp"

namespace {

/// What the next calls of the C library answer instead of doing their work, in this order; 0: as ever.
struct Faults {
  std::vector<int> fsync, rename, close;
  std::size_t shortest = SIZE_MAX;  ///< write() takes no more
  std::vector<int> write;
  bool swallow = false;                ///< write() takes all and writes nothing
  std::vector<std::size_t> swallowed;  ///< how much each time
  std::vector<std::string> calls;
} faults;

int next_of(std::vector<int>& planned) {
  if (planned.empty()) return 0;
  const int code = planned.front();
  planned.erase(planned.begin());
  return code;
}

template <class F>
F* real(const char* name) {
  return reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int fsync(int descriptor) {
  struct stat s {};
  fstat(descriptor, &s);
  faults.calls.push_back(S_ISDIR(s.st_mode) ? "fsync folder" : "fsync");
  if (const int code = next_of(faults.fsync)) return errno = code, -1;
  return real<int(int)>("fsync")(descriptor);
}
extern "C" int rename(const char* from, const char* to) noexcept {
  faults.calls.emplace_back("rename");
  if (const int code = next_of(faults.rename)) return errno = code, -1;
  return real<int(const char*, const char*)>("rename")(from, to);
}
extern "C" ssize_t write(int descriptor, const void* from, size_t size) {
  if (const int code = next_of(faults.write)) return errno = code, code == -1 ? 0 : -1;
  if (faults.swallow) return faults.swallowed.push_back(size), static_cast<ssize_t>(size);
  return real<ssize_t(int, const void*, size_t)>("write")(descriptor, from, std::min(size, faults.shortest));
}
extern "C" int close(int descriptor) {
  const int done = real<int(int)>("close")(descriptor);
  if (const int code = next_of(faults.close)) return errno = code, -1;
  return done;
}

namespace whirl::io {
namespace {

namespace fs = std::filesystem;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class FileOutput : public ::testing::Test {
 protected:
  FileOutput() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    faults = {};
  }
  ~FileOutput() override {
    faults = {};
    fs::remove_all(folder_);
  }
  fs::path at(const std::string& name) const { return folder_ / name; }
  static std::string content(const fs::path& p) {
    std::ifstream in(p, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  std::vector<std::string> names() const {
    std::vector<std::string> out;
    for (const auto& e : fs::directory_iterator(folder_)) out.push_back(e.path().filename().string());
    std::sort(out.begin(), out.end());
    return out;
  }
  static std::string refusal(const fs::path& p, const std::string& text = "new") {
    try {
      write_text(p, text);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }
  static std::string long_text(std::size_t size) {
    std::mt19937 random(7);
    std::string text(size, ' ');
    for (char& c : text) c = static_cast<char>('a' + random() % 26);
    return text;
  }

  const fs::path folder_ = fs::path(::testing::TempDir()) / ("whirl_output_" + std::to_string(::getpid()));
};

TEST_F(FileOutput, IsOnTheDiskBeforeItHasItsNameAndTheFolderAfter) {
  write_text(at("a"), "text");
  EXPECT_THAT(faults.calls, ElementsAre("fsync", "rename", "fsync folder"));
  EXPECT_EQ(content(at("a")), "text");
  EXPECT_THAT(names(), ElementsAre("a"));
}

TEST_F(FileOutput, EveryFailureKeepsTheOldFileAndLeavesNothingBeside) {
  for (const std::size_t size : {std::size_t{3}, std::size_t{200000}}) {
    const std::string text = long_text(size);
    const auto fails = [&](auto plan, int code) {
      std::ofstream(at("a")) << "old";
      faults = {};
      plan();
      EXPECT_THAT(refusal(at("a"), text),
                  ::testing::AllOf(HasSubstr("/a: cannot be written: "), HasSubstr(strerror(code))));
      EXPECT_EQ(content(at("a")), "old");
      EXPECT_THAT(names(), ElementsAre("a"));
    };
    fails([] { faults.write = {ENOSPC}; }, ENOSPC);
    fails([] { faults.write = {-1}; }, EIO);  // nothing written, no reason
    fails([] { faults.fsync = {EIO}; }, EIO);
    fails([] { faults.fsync = {EINVAL}; }, EINVAL);  // only what has no disk may say so
    fails([] { faults.close = {EDQUOT}; }, EDQUOT);
    fails([] { faults.rename = {EACCES}; }, EACCES);
  }
}

TEST_F(FileOutput, InterruptedAndShortCallsGoOn) {
  const std::string text = long_text(200001);
  faults.write = {EINTR, 0, EINTR};
  faults.shortest = 1000;
  faults.fsync = {EINTR, EINTR};
  EXPECT_EQ(refusal(at("a"), text), "");
  EXPECT_TRUE(content(at("a")) == text);
  faults.close = {EINTR};  // closed nevertheless
  EXPECT_EQ(refusal(at("a"), "again"), "");
  EXPECT_EQ(content(at("a")), "again");
}

// Systems write 2 GiB in one call at most. The bytes are pages that nobody touches.
TEST_F(FileOutput, NoCallIsAskedForMoreThanAGibibyte) {
  constexpr std::size_t kGibibyte = std::size_t{1} << 30;
  void* const pages = mmap(nullptr, kGibibyte + 5, PROT_READ, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  if (pages == MAP_FAILED) GTEST_SKIP() << "no address space";
  ByteSink sink(at("a"));
  faults.swallow = true;
  sink.write({static_cast<const char*>(pages), kGibibyte + 5});
  faults.swallow = false;
  EXPECT_THAT(faults.swallowed, ElementsAre(kGibibyte, 5u));
  munmap(pages, kGibibyte + 5);
}

// A program started with its input closed gets descriptor 0 for the first file that it opens.
TEST_F(FileOutput, TheDescriptorOfAClosedInputIsAFileLikeAnyOther) {
  const int kept = dup(0);
  write_text(at("a"), "old");
  ::close(0);
  errno = EEXIST;  // of something before
  const std::string to_file = refusal(at("a"));
  ::close(0);
  errno = EEXIST;
  const std::string to_device = refusal("/dev/null");
  if (kept >= 0) dup2(kept, 0), ::close(kept);
  EXPECT_EQ(to_file, "");
  EXPECT_EQ(to_device, "");
  EXPECT_EQ(content(at("a")), "new");
  EXPECT_THAT(names(), ElementsAre("a"));
}

TEST_F(FileOutput, AnyPiecesGiveTheSameBytes) {
  const std::string text = long_text(300000);
  for (const std::size_t piece :
       {std::size_t{1}, std::size_t{777}, std::size_t{65535}, std::size_t{65536}, text.size()}) {
    for (const char* name : {"plain", "packed.gz"}) {
      ByteSink sink(at(name));
      for (std::size_t from = 0; from < text.size(); from += piece)
        sink.write(std::string_view(text).substr(from, piece));
      sink.write("");
      sink.close();
    }
    EXPECT_TRUE(content(at("plain")) == text) << piece;
    std::string unpacked(text.size() + 1, ' ');
    gzFile packed = gzopen(at("packed.gz").c_str(), "rb");
    EXPECT_EQ(gzread(packed, unpacked.data(), static_cast<unsigned>(unpacked.size())), static_cast<int>(text.size()));
    unpacked.pop_back();
    EXPECT_TRUE(unpacked == text) << piece;
    gzclose(packed);
    EXPECT_LT(fs::file_size(at("packed.gz")), text.size());
  }
}

TEST_F(FileOutput, LinksAreFollowedAlsoDanglingOnesAndARingOfThemIsNamed) {
  fs::create_directory(at("deep"));
  fs::create_symlink("deep/target", at("relative"));
  fs::create_symlink(at("relative"), at("absolute"));
  write_text(at("absolute"), "one");
  EXPECT_EQ(content(at("deep/target")), "one");
  write_text(at("relative"), "two");
  EXPECT_EQ(content(at("deep/target")), "two");
  EXPECT_TRUE(fs::is_symlink(at("relative")) && fs::is_symlink(at("absolute")));
  EXPECT_EQ(regular_target(at("absolute")), at("deep/target"));
  fs::create_symlink("ring2", at("ring1"));
  fs::create_symlink("ring1", at("ring2"));
  EXPECT_THAT(refusal(at("ring1")), HasSubstr(strerror(ELOOP)));
  for (int i = 0; i < 40; ++i)
    fs::create_symlink(i == 0 ? "deep/target" : "l" + std::to_string(i - 1), at("l" + std::to_string(i)));
  EXPECT_EQ(refusal(at("l39")), "") << "forty links are as many as the system follows";
}

TEST_F(FileOutput, PermissionsStayAndANewFileHasTheUsualOnes) {
  const mode_t before = ::umask(022);
  write_text(at("a"), "one");
  struct stat s {};
  ::stat(at("a").c_str(), &s);
  EXPECT_EQ(s.st_mode & 07777, 0644U);
  ::chmod(at("a").c_str(), 0600);
  write_text(at("a"), "two");
  ::stat(at("a").c_str(), &s);
  EXPECT_EQ(s.st_mode & 07777, 0600U);
  ::umask(before);
}

TEST_F(FileOutput, FoldersAreRefusedAndAnEmptyName) {
  fs::create_directory(at("folder"));
  EXPECT_THAT(refusal(at("folder")), HasSubstr(strerror(EISDIR)));
  EXPECT_THAT(refusal(at("missing/a")), HasSubstr(strerror(ENOENT)));
  EXPECT_THAT(refusal(""), HasSubstr("its name is empty"));
  EXPECT_THAT(refusal(at(std::string(300, 'n'))), HasSubstr(strerror(ENAMETOOLONG)));
  std::ofstream(at("file")) << "x";
  EXPECT_THAT(refusal(at("file/a")), HasSubstr(strerror(ENOTDIR)));
  EXPECT_THROW(regular_target(at("folder")), Error);
}

TEST_F(FileOutput, AnOpenDescriptorIsWrittenFromItsPlaceAndStaysOpen) {
  const int open_file = ::open(at("log").c_str(), O_RDWR | O_CREAT, 0644);
  ASSERT_EQ(::write(open_file, "first ", 6), 6);
  write_text("/dev/fd/" + std::to_string(open_file), "second ");
  write_text("/proc/self/fd/" + std::to_string(open_file), "third");
  EXPECT_EQ(content(at("log")), "first second third");
  EXPECT_EQ(::write(open_file, "!", 1), 1);
  EXPECT_THROW(regular_target("/dev/fd/" + std::to_string(open_file)), Error);
  ::close(open_file);
  const int other = ::open(at("other").c_str(), O_RDWR | O_CREAT, 0644);
  EXPECT_NE(refusal("/dev/fd/" + std::to_string(other) + "x"), "") << "no number";
  EXPECT_EQ(content(at("other")), "");
  ::close(other);
  for (const char* none : {"/dev/fd/1048576", "/dev/fd/-1", "/dev/fd/", "/dev/fd/7x", "/dev/fd/999"})
    EXPECT_NE(refusal(none), "") << none;
  fs::create_symlink("/dev/fd/" + std::to_string(::dup(1)), at("link"));
  EXPECT_EQ(refusal(at("link"), ""), "");
}

TEST_F(FileOutput, StandardOutputIsWrittenBehindWhatWasPrinted) {
  std::fflush(stdout);  // what this program has printed itself
  const int kept[] = {::dup(1), ::dup(2)};
  const int captured = ::open(at("out").c_str(), O_RDWR | O_CREAT, 0644);
  ::dup2(captured, 1);
  ::dup2(captured, 2);
  std::fputs("printed ", stdout);
  const std::string out = refusal("/dev/stdout", "file "), err = refusal("/dev/stderr", "error");
  std::fflush(stdout);
  ::dup2(kept[0], 1);
  ::dup2(kept[1], 2);
  for (const int f : {kept[0], kept[1], captured}) ::close(f);
  EXPECT_EQ(out + err, "");
  EXPECT_EQ(content(at("out")), "printed file error");
}

TEST_F(FileOutput, APipeIsWrittenThroughAndADeviceNeedsNoDisk) {
  ASSERT_EQ(::mkfifo(at("pipe").c_str(), 0600), 0);
  const int reader = ::open(at("pipe").c_str(), O_RDONLY | O_NONBLOCK);
  EXPECT_EQ(refusal(at("pipe"), "through"), "");
  char read_back[20] = {};
  EXPECT_EQ(::read(reader, read_back, sizeof read_back), 7);
  EXPECT_STREQ(read_back, "through");
  ::close(reader);
  EXPECT_TRUE(fs::is_fifo(at("pipe")));
  EXPECT_EQ(refusal("/dev/null"), "");
  EXPECT_THAT(refusal("/dev/full"), HasSubstr(strerror(ENOSPC)));
  EXPECT_TRUE(fs::is_character_file("/dev/null") && fs::is_character_file("/dev/full"));
  faults.fsync = {EIO};
  EXPECT_THAT(refusal("/dev/null"), HasSubstr(strerror(EIO)));
  EXPECT_THROW(regular_target(at("pipe")), Error);
}

TEST_F(FileOutput, ASinkThatIsNotClosedLeavesTheOldFile) {
  std::ofstream(at("a")) << "old";
  {
    ByteSink sink(at("a"));
    sink.write("half");
    EXPECT_EQ(names().size(), 2U) << "beside it";
  }
  EXPECT_EQ(content(at("a")), "old");
  EXPECT_THAT(names(), ElementsAre("a"));
}

// Before the process is gone: nobody may find half a file afterwards.
TEST_F(FileOutput, ASignalRemovesWhatIsHalfWritten) {
  const pid_t child = ::fork();
  if (child == 0) {
    clean_up_on_signals();
    ByteSink sink(at("a"));
    sink.write("half");
    ::raise(names().size() == 1 ? SIGTERM : SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  EXPECT_TRUE(names().empty());
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGTERM);
}

TEST_F(FileOutput, ANameBesideThatIsTakenIsLeftAlone) {
  const std::string start = ".whirl-" + std::to_string(::getpid()) + "-";
  for (int i = 0; i < 3000; ++i) std::ofstream(at(start + std::to_string(i) + ".part")) << "mine";
  write_text(at("a"), "text");
  EXPECT_EQ(content(at("a")), "text");
  for (int i = 0; i < 3000; ++i) EXPECT_EQ(content(at(start + std::to_string(i) + ".part")), "mine");
}

TEST_F(FileOutput, AGroupGivesItsNamesTogetherOrNot) {
  std::ofstream(at("a")) << "old";
  {
    OutputGroup group;
    write_text(at("a"), "new");
    write_text(at("b"), "new");
    EXPECT_EQ(content(at("a")), "old");
    EXPECT_FALSE(fs::exists(at("b")));
  }
  EXPECT_THAT(names(), ElementsAre("a"));
  EXPECT_EQ(content(at("a")), "old");
  OutputGroup outer;
  {
    OutputGroup inner;
    write_text(at("a"), "new");
    inner.commit();
    EXPECT_EQ(content(at("a")), "old") << "the outer group has it";
  }
  write_text(at("b"), "new");
  faults.calls.clear();
  outer.commit();
  EXPECT_EQ(content(at("a")) + content(at("b")), "newnew");
  EXPECT_THAT(faults.calls, ElementsAre("rename", "fsync folder", "rename", "fsync folder"));
  EXPECT_THAT(names(), ElementsAre("a", "b"));
}

TEST_F(FileOutput, FilesOfAFolderAndTheFolderItselfGoWhenOneFails) {
  EXPECT_EQ(write_files(at("new/deep"), {{"a", "1"}, {"sub/b", "2"}}).size(), 2U);
  EXPECT_EQ(content(at("new/deep/a")) + content(at("new/deep/sub/b")), "12");
  fs::create_directories(at("old"));
  faults.fsync = {0, EIO};
  EXPECT_THROW(write_files(at("old/made"), {{"a", "1"}, {"sub/b", "2"}}), Error);
  EXPECT_TRUE(fs::exists(at("old")));
  EXPECT_FALSE(fs::exists(at("old/made")));
  std::ofstream(at("file")) << "x";
  EXPECT_THROW(make_folder(at("file")), Error);
  EXPECT_THROW(make_folder(at("file/below")), Error);
}

TEST_F(FileOutput, AFileThatIsChangedInPlaceMustBeRegular) {
  std::ofstream(at("a")) << "x";
  EXPECT_EQ(regular_target(at("a")), at("a"));
  EXPECT_EQ(regular_target(at("new")), at("new"));
}

}  // namespace
}  // namespace whirl::io
