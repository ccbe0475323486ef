#pragma once
#include <filesystem>

namespace whirl::io {

/// Where the bytes of an input can be read more than once: the path itself, or, for `-` (standard input), a pipe or a
/// character device, a temporary file with everything that came out of it (1 GiB at most; removed at the end of the
/// program). Throws Error for a folder, a block device, a socket, and when reading fails.
std::filesystem::path input_path(const std::filesystem::path& path);

}  // namespace whirl::io
