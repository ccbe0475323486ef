#pragma once
#include <fcntl.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <utility>

namespace whirl::rt::recording {

/// Room on the disk that is taken before the library needs it: it does not survive a disk that becomes full under it.
/// With the room of the last step the file can still be closed.
class Reserve {
 public:
  void open(const std::filesystem::path& path) { descriptor_ = ::open(path.c_str(), O_WRONLY | O_CLOEXEC); }
  ~Reserve() { give_back(); }
  /// Makes sure of some megabytes behind what is there. 0, or the system's reason.
  int ensure() {
    const off_t size = lseek(descriptor_, 0, SEEK_END);
    if (descriptor_ < 0 || size < 0) return errno;
    if (size + kLeast <= end_) return 0;
    int code;
    do {
      code = fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, size + 2 * kLeast);
    } while (code != 0 && errno == EINTR);
    if (code == 0) {
      end_ = size + 2 * kLeast;
      return 0;
    }
    if (errno != EOPNOTSUPP && errno != ENOSYS) return errno;
    struct statvfs space {};  // a file system that cannot reserve: ask each time
    if (fstatvfs(descriptor_, &space) != 0) return errno;
    return space.f_bavail * space.f_frsize < static_cast<fsblkcnt_t>(4 * kLeast) ? ENOSPC : 0;
  }
  /// 0, or the system's reason.
  int sync() const { return descriptor_ < 0 || fdatasync(descriptor_) == 0 || errno == EINTR ? 0 : errno; }
  void give_back() {
    if (descriptor_ < 0) return;
    const off_t size = lseek(descriptor_, 0, SEEK_END);
    if (size >= 0 && ftruncate(descriptor_, size) != 0) errno = 0;  // costs room, not data
    (void)fsync(descriptor_);
    ::close(std::exchange(descriptor_, -1));
  }

 private:
  static constexpr off_t kLeast = off_t{1} << 21;
  int descriptor_ = -1;
  off_t end_ = 0;
};

}  // namespace whirl::rt::recording
