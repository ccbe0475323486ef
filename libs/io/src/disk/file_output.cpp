#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <utility>

#include "disk/temporary_slots.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"

namespace whirl::io {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kDiskBuffer = std::size_t{1} << 16;

[[noreturn]] void refuse(const fs::path& path, int code) {
  throw Error::in_file(path.string(), 0, std::string("cannot be written: ") + std::strerror(code));
}

/// The number of an open descriptor when the path names one (/dev/stdout, /dev/fd/5, /proc/self/fd/5). Opening it by
/// name would start at its beginning, over what the program has printed.
std::optional<int> descriptor_of(const fs::path& path) {
  const std::string name = path.lexically_normal().string();
  if (name == "/dev/stdout") return STDOUT_FILENO;
  if (name == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view folder : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!name.starts_with(folder)) continue;
    char* end = nullptr;
    const long number = std::strtol(name.c_str() + folder.size(), &end, 10);
    if (*end == '\0' && end != name.c_str() + folder.size() && number >= 0 && number < 1 << 20)
      return static_cast<int>(number);
  }
  return std::nullopt;
}

/// Where the bytes belong: links followed, also one whose target is still missing.
fs::path followed(const fs::path& path) {
  fs::path at = path;
  for (int links = 0;; ++links) {
    std::error_code failed;
    if (descriptor_of(at) || !fs::is_symlink(at, failed)) return at;
    const fs::path target = fs::read_symlink(at, failed);
    if (failed) refuse(path, failed.value());
    if (links > 40) refuse(path, ELOOP);
    at = target.is_absolute() ? target : at.parent_path() / target;
  }
}

int open_again(const char* path, int flags, mode_t mode = 0) {
  int descriptor;
  do {
    descriptor = open(path, flags | O_CLOEXEC, mode);
  } while (descriptor < 0 && errno == EINTR);
  return descriptor;
}

/// The name itself survives a loss of power once its folder is on the disk. Not every file system can do that.
void sync_folder(const fs::path& file) {
  const fs::path folder = file.parent_path().empty() ? fs::path(".") : file.parent_path();
  const int descriptor = open_again(folder.c_str(), O_RDONLY | O_DIRECTORY);
  if (descriptor < 0) return;
  (void)fsync(descriptor);
  (void)::close(descriptor);
}

}  // namespace

namespace {

class OutputFile {
 public:
  fs::path path;       // as the user named it
  fs::path target;     // links followed
  fs::path temporary;  // empty: written through
  int descriptor = -1;
  int slot = -1;
  bool ready = false, compressed = false;
  z_stream z{};
  std::string buffer;

  virtual ~OutputFile() {
    if (compressed) deflateEnd(&z);
    discard();
  }
  void discard() {
    if (descriptor >= 0) (void)::close(std::exchange(descriptor, -1));
    if (!temporary.empty()) unlink(temporary.c_str());
    temporary.clear();
    forget_temporary(std::exchange(slot, -1));
  }

  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;
  explicit OutputFile(const fs::path& p) : path(p), target(followed(p)) {
    if (path.empty()) throw Error("no file to write to: its name is empty");
    buffer.reserve(kDiskBuffer);  // before there is a file that a lack of memory would leave behind
    open_target();
    compressed = path.extension() == ".gz";
    // 15 + 16: gzip, not zlib.
    if (compressed && deflateInit2(&z, 6, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK) {
      compressed = false;
      discard();
      refuse(path, ENOMEM);
    }
  }

  void open_target() {
    if (const auto number = descriptor_of(target)) {
      std::fflush(nullptr);  // what was printed comes first
      descriptor = fcntl(*number, F_DUPFD_CLOEXEC, 3);
      if (descriptor < 0) refuse(path, errno);
      return;
    }
    struct stat there {};
    mode_t mode = 0;
    if (stat(target.c_str(), &there) == 0) {
      if (S_ISDIR(there.st_mode)) refuse(path, EISDIR);
      if (!S_ISREG(there.st_mode)) {
        descriptor = open_again(target.c_str(), O_WRONLY);
        if (descriptor < 0) refuse(path, errno);
        return;
      }
      if (access(target.c_str(), W_OK) != 0) refuse(path, errno);
      mode = there.st_mode & 07777;
    } else if (errno != ENOENT) {
      refuse(path, errno);
    }
    static std::atomic<unsigned> count{0};
    do {
      // Short: the longest name that the system knows still has one beside it.
      temporary = target.parent_path() / fmt::format(".whirl-{}-{}.part", getpid(), count++);
      descriptor = open_again(temporary.c_str(), O_WRONLY | O_CREAT | O_EXCL, 0666);
    } while (descriptor < 0 && errno == EEXIST);
    if (descriptor < 0) {
      const int why = errno;
      temporary.clear();
      refuse(path, why);
    }
    slot = remember_temporary(temporary.string(), false);
    if (mode != 0) {
      // Without the right to give a file away, it is the writer's.
      if (fchown(descriptor, there.st_uid, there.st_gid) != 0) errno = 0;
      if (fchmod(descriptor, mode) != 0) errno = 0;
    }
  }

  [[noreturn]] void fail(int code) {
    discard();
    refuse(path, code);
  }

  /// At a place of the file; without one behind what stands there.
  void put(const char* from, std::size_t size, std::optional<std::uint64_t> at = {}) {
    while (size > 0) {
      const std::size_t most = std::min<std::size_t>(size, std::size_t{1} << 30);
      const ssize_t n = at ? pwrite(descriptor, from, most, static_cast<off_t>(*at)) : ::write(descriptor, from, most);
      if (n < 0 && errno == EINTR) continue;
      if (n <= 0) fail(n < 0 ? errno : EIO);
      from += n;
      size -= static_cast<std::size_t>(n);
      if (at) *at += static_cast<std::uint64_t>(n);
    }
  }
  void flush() {
    put(buffer.data(), buffer.size());
    buffer.clear();
  }
  void plain(std::string_view bytes) {
    if (buffer.size() + bytes.size() >= kDiskBuffer) {
      flush();
      if (bytes.size() >= kDiskBuffer) return put(bytes.data(), bytes.size());
    }
    buffer.append(bytes);
  }
  void deflate_some(std::string_view bytes, int how) {
    char out[1 << 15];
    do {
      const std::size_t n = std::min<std::size_t>(bytes.size(), std::size_t{1} << 30);
      z.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
      z.avail_in = static_cast<uInt>(n);
      do {
        z.next_out = reinterpret_cast<Bytef*>(out);
        z.avail_out = sizeof out;
        if (deflate(&z, how) == Z_STREAM_ERROR) fail(EIO);
        plain({out, sizeof out - z.avail_out});
      } while (z.avail_out == 0);
      bytes.remove_prefix(n);
    } while (!bytes.empty());
  }

  void prepare() {
    if (ready || descriptor < 0) return;
    if (compressed) deflate_some({}, Z_FINISH);
    flush();
    int code;
    do {
      code = fsync(descriptor);
    } while (code != 0 && errno == EINTR);
    // Pipes and terminals have no disk behind them.
    if (code != 0 && !(temporary.empty() && (errno == EINVAL || errno == EROFS || errno == ENOTSUP))) fail(errno);
    // Linux frees the descriptor also when it says EINTR.
    if (::close(std::exchange(descriptor, -1)) != 0 && errno != EINTR) fail(errno);
    ready = true;
  }
  void close() {
    prepare();
    if (temporary.empty()) return;
    if (std::rename(temporary.c_str(), target.c_str()) != 0) fail(errno);
    temporary.clear();
    forget_temporary(std::exchange(slot, -1));
    sync_folder(target);
  }
  void write(std::string_view bytes) {
    if (bytes.empty()) return;
    if (compressed) {
      deflate_some(bytes, Z_NO_FLUSH);
    } else {
      plain(bytes);
    }
  }
};

}  // namespace

struct ByteSink::State : OutputFile {
  using OutputFile::OutputFile;
};

struct OutputGroup::State {
  std::vector<std::unique_ptr<OutputFile>> files;
  State* outer;
};

namespace {

thread_local OutputGroup::State* innermost = nullptr;

}  // namespace

OutputGroup::OutputGroup() : state_(std::make_unique<State>()) {
  state_->outer = std::exchange(innermost, state_.get());
}
OutputGroup::~OutputGroup() { innermost = state_->outer; }
void OutputGroup::commit() {
  auto files = std::exchange(state_->files, {});
  for (auto& file : files) {
    if (state_->outer == nullptr) {
      file->close();
    } else {
      state_->outer->files.push_back(std::move(file));
    }
  }
}

ByteSink::ByteSink(const fs::path& path) : state_(std::make_unique<State>(path)) {}
ByteSink::~ByteSink() = default;
void ByteSink::write(std::string_view bytes) { state_->write(bytes); }
void ByteSink::write_at(std::uint64_t at, std::string_view bytes) {
  if (state_->temporary.empty() || state_->compressed)
    throw Error::in_file(state_->path.string(), 0,
                         "must be a regular file without .gz: it is not written in its order");
  state_->put(bytes.data(), bytes.size(), at);
}
void ByteSink::close() {
  if (!state_) return;  // a group has it
  if (innermost == nullptr || state_->temporary.empty()) return state_->close();
  state_->prepare();
  innermost->files.push_back(std::move(state_));
}

void write_text(const fs::path& path, std::string_view text) {
  ByteSink sink(path);
  sink.write(text);
  sink.close();
}

fs::path regular_target(const fs::path& path) {
  const fs::path target = followed(path);
  struct stat there {};
  if (descriptor_of(target) || (stat(target.c_str(), &there) == 0 && !S_ISREG(there.st_mode))) {
    throw Error::in_file(path.string(), 0, "must be a regular file: it is read and changed again while it is written");
  }
  if (fs::exists(target) && access(target.c_str(), W_OK) != 0) refuse(path, errno);
  return target;
}

void make_folder(const fs::path& folder) {
  std::error_code failed;
  fs::create_directories(folder, failed);
  if (failed) throw Error::in_file(folder.string(), 0, "folder cannot be made: " + failed.message());
  if (!fs::is_directory(folder, failed)) throw Error::in_file(folder.string(), 0, "is no folder");
}

std::vector<fs::path> write_files(const fs::path& folder, const std::vector<FileText>& files) {
  // What this call makes, it takes away again when it fails; deepest last.
  std::vector<fs::path> made;
  const auto make = [&](const fs::path& wanted) {
    std::vector<fs::path> missing;
    std::error_code failed;
    for (fs::path at = wanted; !at.empty() && !fs::exists(at, failed); at = at.parent_path()) missing.push_back(at);
    make_folder(wanted);
    made.insert(made.end(), missing.rbegin(), missing.rend());
  };
  try {
    make(folder);
    OutputGroup together;
    std::vector<fs::path> paths;
    for (const FileText& f : files) {
      paths.push_back(folder / f.name);
      make(paths.back().parent_path());
      write_text(paths.back(), f.text);
    }
    together.commit();
    return paths;
  } catch (...) {
    std::error_code ignored;
    for (auto at = made.rbegin(); at != made.rend(); ++at) fs::remove(*at, ignored);  // a folder only when empty
    throw;
  }
}

}  // namespace whirl::io
