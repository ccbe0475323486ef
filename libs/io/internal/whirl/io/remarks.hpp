#pragma once
#include <functional>
#include <string>
#include <string_view>

namespace whirl::io {

/// What a remark is about, for those who decide by it.
enum class RemarkCode {
  other,
  open_last_line,  ///< a text file does not end with a line end: its last number may be cut off
};
std::string_view to_string(RemarkCode code);
/// Nothing was lost, as far as can be told.
bool is_information(RemarkCode code);

/// Told of everything that reading or writing a file lost, guessed or found odd: file and one sentence.
using RemarkHandler = std::function<void(const std::string& file, const std::string& remark, RemarkCode code)>;

/// One handler per program, null at the start; returns the one before. Not while files are read in other threads.
RemarkHandler set_remark_handler(RemarkHandler handler);

/// Tells the handler; without one nothing happens.
void remark(const std::string& file, const std::string& text, RemarkCode code = RemarkCode::other);

}  // namespace whirl::io
