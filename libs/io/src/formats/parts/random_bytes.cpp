#include "formats/parts/random_bytes.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/input.hpp"

namespace whirl::io {
namespace {

constexpr std::uint64_t kWindow = std::uint64_t{1} << 16;

}  // namespace

RandomBytes::RandomBytes(std::string bytes, std::string name) : name_(std::move(name)), window_(std::move(bytes)) {
  size_ = window_.size();
}

RandomBytes::RandomBytes(const std::filesystem::path& path, std::uint64_t limit) : name_(path.string()) {
  if (ByteSource(path).compressed()) {
    window_ = read_text(path);
    size_ = window_.size();
    return;
  }
  descriptor_ = open(input_path(path).c_str(), O_RDONLY | O_CLOEXEC);
  struct stat there {};
  if (descriptor_ < 0 || fstat(descriptor_, &there) != 0)
    throw Error::in_file(name_, 0, std::string("cannot be opened: ") + std::strerror(errno));
  size_ = static_cast<std::uint64_t>(std::max<off_t>(there.st_size, 0));
  if (size_ > limit) {
    (void)close(descriptor_);
    throw Error::in_file(
        name_, 0,
        fmt::format("{} bytes: larger than the limit of {} bytes; `whirl info` and `whirl convert` read it "
                    "in parts, other commands its rows (--rows FIRST:END)",
                    size_, limit));
  }
}

RandomBytes::~RandomBytes() {
  if (descriptor_ >= 0) (void)close(descriptor_);
}

std::string_view RandomBytes::view(std::uint64_t at, std::size_t count) const {
  if (at >= window_at_ && at + count <= window_at_ + window_.size())
    return std::string_view(window_).substr(static_cast<std::size_t>(at - window_at_), count);
  if (descriptor_ < 0 || at > size_ || count > size_ - at)
    throw Error::in_file(name_, 0, fmt::format("byte {}: file ends before {} bytes that it states", at, count));
  window_.resize(static_cast<std::size_t>(std::max<std::uint64_t>(count, std::min(kWindow, size_ - at))));
  window_at_ = at;
  for (std::size_t done = 0; done < window_.size();) {
    const ssize_t n = pread(descriptor_, window_.data() + done, window_.size() - done, static_cast<off_t>(at + done));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) {
      window_.clear();
      throw Error::in_file(name_, 0,
                           n < 0 ? std::string("cannot be read: ") + std::strerror(errno)
                                 : fmt::format("byte {}: the file has become shorter while it is read", at + done));
    }
    done += static_cast<std::size_t>(n);
  }
  return std::string_view(window_).substr(0, count);
}

}  // namespace whirl::io
