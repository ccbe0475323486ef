#pragma once
#include <span>
#include <string_view>

namespace whirl::monitor {

/// A file of the page, compiled into the program from libs/monitor/page.
struct PageFile {
  std::string_view path, type, text;
};
std::span<const PageFile> page_files();

}  // namespace whirl::monitor
