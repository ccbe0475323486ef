#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace whirl::io {

/// SHA-256 (FIPS 180-4). Written by hand: 60 lines instead of a cryptography library in every program that
/// reads a file.
class Sha256 {
 public:
  void update(std::string_view bytes);
  /// The digest as 64 hexadecimal digits. The object is used up.
  std::string hex();

 private:
  void block(const unsigned char* data);
  std::array<std::uint32_t, 8> h_{0x6a09e667, 0xbb67ae85, 0x3c6ef372, 0xa54ff53a,
                                  0x510e527f, 0x9b05688c, 0x1f83d9ab, 0x5be0cd19};
  std::array<unsigned char, 64> buffer_{};
  std::size_t used_ = 0;
  std::uint64_t total_ = 0;
};

std::string sha256(std::string_view bytes);
/// Of the file's bytes as they are (a `.gz` is not unpacked). Throws Error when it cannot be read.
std::string sha256_file(const std::filesystem::path& path);
/// "name sha256:..." as kept in Provenance::inputs; the name without its folder.
std::string input_record(const std::filesystem::path& path);

}  // namespace whirl::io
