#pragma once
#include <filesystem>

#include "whirl/io/record_stream.hpp"

namespace whirl::io {

/// As write_hdf5 of signals.hpp, in memory for a part: each channel has its place in the file before it comes.
void write_hdf5_parts(const std::filesystem::path& path, const Recording& first, RecordStream& rest, Eigen::Index rows);

}  // namespace whirl::io
