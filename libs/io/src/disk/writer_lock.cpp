#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <utility>

#include "whirl/core/error.hpp"
#include "whirl/io/output.hpp"

namespace whirl::io {

WriterLock::WriterLock(const std::filesystem::path& path) {
  for (;;) {
    descriptor_ = open(path.c_str(), O_RDONLY | O_CLOEXEC);
    if (descriptor_ < 0) return;  // not there, or a reason that reading it will tell
    int code;
    do {
      code = flock(descriptor_, LOCK_EX | LOCK_NB);
    } while (code != 0 && errno == EINTR);
    if (code != 0 && errno == EWOULDBLOCK) {
      close(descriptor_);
      throw Error::in_file(path.string(), 0, "another program is writing it: nothing was changed; try again after it");
    }
    // Files are replaced, not changed: whoever held the lock may have put a new one in this place since.
    struct stat mine {
    }, there{};
    if (fstat(descriptor_, &mine) != 0 || stat(path.c_str(), &there) != 0 || mine.st_ino == there.st_ino) return;
    close(std::exchange(descriptor_, -1));
  }
}

WriterLock::~WriterLock() {
  if (descriptor_ >= 0) close(descriptor_);
}

}  // namespace whirl::io
