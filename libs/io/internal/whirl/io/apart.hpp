#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>

namespace whirl::io {

/// Values on their way out of a process of its own (read_apart).
class ParcelWriter {
 public:
  explicit ParcelWriter(int descriptor) : descriptor_(descriptor) {}
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void value(const T& v) { bytes(std::as_bytes(std::span(&v, 1))); }
  /// With their number before them.
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void values(std::span<const T> v) {
    value(static_cast<std::uint64_t>(v.size()));
    bytes(std::as_bytes(v));
  }
  void text(std::string_view t) { values(std::span(t.data(), t.size())); }
  void flush();

 private:
  void bytes(std::span<const std::byte> b);
  void write(std::string_view left) const;
  int descriptor_;
  std::string buffer_;
};

/// What a ParcelWriter wrote, in the same order. Throws Error naming the input when it ends before.
class ParcelReader {
 public:
  ParcelReader(const std::string& name, std::span<const std::byte> bytes) : name_(name), left_(bytes) {}
  template <class T>
  requires std::is_trivially_copyable_v<T> T value() {
    T v;
    copy(&v, sizeof v);
    return v;
  }
  /// Number of the values that follow; they are there.
  template <class T>
  requires std::is_trivially_copyable_v<T> std::size_t count() {
    const auto n = value<std::uint64_t>();
    require(n, sizeof(T));
    return static_cast<std::size_t>(n);
  }
  void copy(void* to, std::size_t size);
  std::string text() {
    std::string t(count<char>(), '\0');
    copy(t.data(), t.size());
    return t;
  }

 private:
  void require(std::uint64_t n, std::size_t size) const;
  std::string name_;
  std::span<const std::byte> left_;
};

/// Runs `read` in a process of its own with limits of computing time and memory, and `take` here on what it wrote: a
/// damaged file makes the HDF5 library crash, read beyond its memory or wait without end, and then it is the other
/// process. `file_bytes`, the size of the input, bounds time and output; `least_seconds` is the time that an empty file
/// may take. Throws Error naming the input when that process does not come to its end, and what `read` throws, as
/// Error.
void read_apart(const std::string& name, std::size_t file_bytes, const std::function<void(ParcelWriter&)>& read,
                const std::function<void(ParcelReader&)>& take, unsigned least_seconds = 20);

}  // namespace whirl::io
