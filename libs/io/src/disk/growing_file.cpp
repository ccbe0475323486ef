#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include "whirl/core/error.hpp"
#include "whirl/io/output.hpp"

namespace whirl::io {
namespace {

Error growing_failure(const std::filesystem::path& path, int code) {
  return Error::in_file(path.string(), 0, std::string("cannot be written: ") + std::strerror(code));
}

}  // namespace

GrowingFile::~GrowingFile() {
  if (descriptor_ >= 0) (void)::close(descriptor_);
}

void GrowingFile::create(const std::filesystem::path& path, std::size_t reserve) {
  path_ = path;
  size_ = 0;
  descriptor_ = open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666);
  if (descriptor_ < 0) throw growing_failure(path_, errno);
  if (reserve > 0) (void)fallocate(descriptor_, FALLOC_FL_KEEP_SIZE, 0, static_cast<off_t>(reserve));
}

void GrowingFile::append(std::string_view bytes) {
  std::string_view left = bytes;
  while (!left.empty()) {
    const ssize_t n = ::write(descriptor_, left.data(), left.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      const int why = n < 0 ? errno : EIO;
      if (ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) errno = 0;
      throw growing_failure(path_, why);
    }
    left.remove_prefix(static_cast<std::size_t>(n));
  }
  size_ += bytes.size();
}

void GrowingFile::close() {
  if (descriptor_ < 0) return;
  const int synced = fsync(descriptor_), why = errno;
  (void)::close(std::exchange(descriptor_, -1));
  if (synced != 0 && why != EINVAL && why != EROFS && why != ENOTSUP) throw growing_failure(path_, why);
}

}  // namespace whirl::io
