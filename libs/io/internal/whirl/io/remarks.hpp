#pragma once
#include <functional>
#include <string>

namespace whirl::io {

/// Told of everything that reading or writing a file lost, guessed or found odd: file and one sentence.
using RemarkHandler = std::function<void(const std::string& file, const std::string& remark)>;

/// One handler per program, null at the start; returns the one before. Not while files are read in other threads.
RemarkHandler set_remark_handler(RemarkHandler handler);

/// Tells the handler; without one nothing happens.
void remark(const std::string& file, const std::string& text);

}  // namespace whirl::io
