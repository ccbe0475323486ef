#pragma once
#include <cstddef>
#include <memory>
#include <string>
#include <string_view>

#include "whirl/io/file.hpp"

namespace whirl::io::detail {

/// The lines of a text file of any size, one after the other. What lies from `begin` to `end` in the buffer is read and
/// not yet taken: who looks ahead may take of it, and counts the lines.
struct CsvLines {
  explicit CsvLines(ByteSource s) : source(std::move(s)) {}

  /// Reads more behind what is not yet taken. Throws Error for a line longer than the buffer.
  void refill();
  std::string_view untaken() const { return {buffer.get() + begin, end - begin}; }
  /// The next line without its end; false at the end of the file. Valid until the next call.
  bool get_line(std::string_view& out);

  ByteSource source;
  long line = 0;                ///< number of the line taken last
  bool open_line = false;       ///< that has no line end
  bool blanks_between = false;  ///< values are parted by blanks: several of them, or tabs, come as one
  std::unique_ptr<char[]> buffer;
  std::size_t begin = 0, end = 0;

 private:
  bool eof_ = false;
  std::string even_blanks_;
};

}  // namespace whirl::io::detail
