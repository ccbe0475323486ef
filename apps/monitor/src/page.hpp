#pragma once
#include <array>
#include <string_view>

namespace whirl::monitor {

/// A file of the page, compiled into the program from apps/monitor/page.
struct PageFile {
  std::string_view path, type, text;
};
const std::array<PageFile, 3>& page_files();

}  // namespace whirl::monitor
