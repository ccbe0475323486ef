#pragma once
#include <filesystem>
#include <functional>
#include <string>

namespace whirl::io {

/// Where the bytes of an input can be read more than once: the path itself, or, for `-` (standard input), a pipe or a
/// character device, a temporary file with everything that came out of it (1 GiB at most; removed at the end of the
/// program). Throws Error for a folder, a block device, a socket, and when reading fails.
std::filesystem::path input_path(const std::filesystem::path& path);

/// Runs `read` in a process of its own with limits of time first: a damaged file makes the HDF5 library crash or wait
/// without end, and then it is the other process. Throws Error naming the file in that case; what `read` throws by
/// itself is left to the caller's own reading.
void probe_hdf5(const std::string& name, const std::function<void()>& read);

}  // namespace whirl::io
