#pragma once
#include <filesystem>
#include <string>

namespace whirl::pages {

/// A self-contained HTML page as the bytes of a PDF, printed by the browser chromium in its sandbox; where the system
/// lets no sandbox start, without one, and stderr says so. Nothing is loaded. `pdf`: the file that it is for, named in
/// errors. Throws Error when there is no browser or it makes no complete PDF.
std::string printed_page(const std::string& page, const std::filesystem::path& pdf);

}  // namespace whirl::pages
