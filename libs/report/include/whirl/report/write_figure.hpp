#pragma once
#include <filesystem>

#include "whirl/report/figure.hpp"

namespace whirl::report {

/// Writes a figure in the format of the file's name: `.svg`; `.png` (twice the drawing's pixels, white ground) and
/// `.pdf`, which run the program `rsvg-convert` (Debian: librsvg2-bin); `.csv`, the data behind it; `.txt`, for a
/// terminal. Throws Error for another ending, for a folder that does not exist, and for PNG and PDF when the program is
/// missing.
void write_figure(const Figure& figure, const std::filesystem::path& file);

/// Runs a program found in PATH without a shell, its input from `input_text`; what it prints goes to `output`, or is
/// discarded when that is null. Returns its exit code, 127 when it is not installed, 128 + n when signal n ended it.
int run_program(const std::vector<std::string>& arguments, const std::string& input_text = "",
                std::string* output = nullptr);

}  // namespace whirl::report
