#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace whirl::io {

/// SHA-256 (FIPS 180-4) as 64 hexadecimal digits.
std::string sha256(std::string_view bytes);
/// Of the file's bytes as they are (a `.gz` is not unpacked). Throws Error when it cannot be read.
std::string sha256_file(const std::filesystem::path& path);
/// "name sha256:..." as kept in Provenance::inputs; the name without its folder.
std::string input_record(const std::filesystem::path& path);

}  // namespace whirl::io
