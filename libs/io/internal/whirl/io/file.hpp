#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

namespace whirl::io {

/// Bytes of a file or of memory in order, decompressed when they are gzip (recognised by content, not by
/// name). Constant memory. Throws Error naming the source when it cannot be read or the gzip data are damaged
/// or cut off.
class ByteSource {
 public:
  explicit ByteSource(const std::filesystem::path& path);
  /// The bytes must outlive the source.
  ByteSource(std::string_view bytes, std::string name);
  ~ByteSource();
  ByteSource(ByteSource&&) noexcept;
  ByteSource& operator=(ByteSource&&) noexcept;

  /// Reads up to `size` bytes; fewer only at the end.
  std::size_t read(char* to, std::size_t size);
  const std::string& name() const;
  bool compressed() const;
  /// Bytes of the file that are taken, as they stand there.
  std::uint64_t taken() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The whole file as text, decompressed. Throws Error when it is larger than `limit` bytes.
std::string read_text(const std::filesystem::path& path, std::size_t limit = std::size_t{1} << 30);
/// The same from memory.
std::string decompress(std::string_view bytes, std::string_view name, std::size_t limit = std::size_t{1} << 30);

/// Writes bytes to a file, as gzip when its name ends in `.gz`. The file appears under its name only when
/// `close()` has written everything; a writer destroyed before that leaves nothing. Throws Error naming the
/// file.
class ByteSink {
 public:
  explicit ByteSink(const std::filesystem::path& path);
  ~ByteSink();
  ByteSink(const ByteSink&) = delete;
  ByteSink& operator=(const ByteSink&) = delete;
  void write(std::string_view bytes);
  /// Bytes at a place of the file, in any order. Not together with `write`. Throws Error for a pipe and for `.gz`.
  void write_at(std::uint64_t at, std::string_view bytes);
  void close();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

void write_text(const std::filesystem::path& path, std::string_view text);

}  // namespace whirl::io
