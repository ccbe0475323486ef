#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "formats/arrays/bytes.hpp"

namespace whirl::io {

/// Bytes of a file or of memory at any place. Of a file a window is kept: any size costs the same memory. What is gzip
/// is unpacked first (1 GiB at most).
class RandomBytes {
 public:
  /// Throws Error when the file has more than `limit` bytes.
  explicit RandomBytes(const std::filesystem::path& path, std::uint64_t limit = ~std::uint64_t{0});
  RandomBytes(std::string bytes, std::string name);
  ~RandomBytes();
  RandomBytes(const RandomBytes&) = delete;
  RandomBytes& operator=(const RandomBytes&) = delete;

  std::uint64_t size() const { return size_; }
  const std::string& name() const { return name_; }
  /// Bytes that lie inside, as the caller has checked; valid until the next call. Throws Error where the file has
  /// become shorter.
  std::string_view view(std::uint64_t at, std::size_t count) const;
  std::string copy(std::uint64_t at, std::size_t count) const { return std::string(view(at, count)); }
  template <class T>
  T number(std::uint64_t at, bool big) const {
    return number_at<T>(view(at, sizeof(T)), 0, big);
  }

 private:
  std::string name_;
  std::uint64_t size_ = 0;
  int descriptor_ = -1;
  mutable std::string window_;  ///< all of it where there is no descriptor
  mutable std::uint64_t window_at_ = 0;
};

}  // namespace whirl::io
