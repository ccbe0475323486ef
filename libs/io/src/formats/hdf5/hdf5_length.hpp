#pragma once
#include <cstddef>
#include <filesystem>
#include <string_view>

namespace whirl::io {

/// Throws Error naming the input when its superblock states more bytes than are there. The library would refuse it too,
/// in a process of its own and without the numbers. One that is still being written, or that has no superblock, is left
/// to it.
void refuse_cut_hdf5(std::string_view bytes, std::string_view name);
void refuse_cut_hdf5(const std::filesystem::path& path, std::string_view name);

}  // namespace whirl::io
