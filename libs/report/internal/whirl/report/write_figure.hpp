#pragma once
#include <filesystem>

#include "whirl/report/figure.hpp"

namespace whirl::report {

/// Writes a figure in the format of the file's name: `.svg`; `.png` (twice the drawing's pixels, white ground) and
/// `.pdf`, which run the program `rsvg-convert` (Debian: librsvg2-bin); `.csv`, the data behind it; `.txt`, for a
/// terminal. Throws Error for another ending, for a folder that does not exist, and for PNG and PDF when the program is
/// missing.
void write_figure(const Figure& figure, const std::filesystem::path& file);

}  // namespace whirl::report
