// How many bytes an HDF5 file states: "Superblock" of its format specification.
#include "formats/hdf5/hdf5_length.hpp"

#include <fmt/format.h>

#include <fstream>
#include <functional>

#include "formats/arrays/bytes.hpp"
#include "whirl/core/error.hpp"

namespace whirl::io {
namespace {

constexpr std::size_t kSuperblock = 64;  // bytes of a superblock that are looked at
constexpr std::string_view kSignature("\x89HDF\r\n\x1a\n", 8);

/// The end of the file as a superblock states it; 0 where it does not.
std::uint64_t stated_end(std::string_view superblock) {
  const auto byte = [&](std::size_t at) { return static_cast<unsigned char>(superblock[at]); };
  const unsigned version = byte(8);
  const bool old = version < 2, known = version < 4, wide = byte(old ? 13 : 9) == 8;
  const bool written = version == 3 && (byte(11) & 5) != 0;  // open for writing: its end is not yet stated
  if (!known || !wide || written) return 0;
  return number_at<std::uint64_t>(superblock, version == 0 ? 40 : version == 1 ? 44 : 28, false);
}

void refuse(std::string_view name, std::uint64_t size,
            const std::function<std::string(std::uint64_t, std::size_t)>& bytes) {
  for (std::uint64_t at = 0; at + kSuperblock <= size; at = at == 0 ? 512 : 2 * at) {
    const std::string superblock = bytes(at, kSuperblock);
    if (superblock.size() < kSuperblock) return;
    if (!superblock.starts_with(kSignature)) continue;
    const std::uint64_t stated = stated_end(superblock);
    if (stated > size && stated != ~std::uint64_t{0}) {
      throw Error::in_file(name, 0,
                           fmt::format("cut off: its superblock states {} bytes, {} are present", stated, size));
    }
    return;
  }
}

}  // namespace

void refuse_cut_hdf5(std::string_view bytes, std::string_view name) {
  refuse(name, bytes.size(), [&](std::uint64_t at, std::size_t count) { return std::string(bytes.substr(at, count)); });
}

void refuse_cut_hdf5(const std::filesystem::path& path, std::string_view name) {
  std::error_code none;
  const std::uintmax_t size = std::filesystem::file_size(path, none);
  std::ifstream in(path, std::ios::binary);
  if (none || !in) return;
  refuse(name, size, [&](std::uint64_t at, std::size_t count) {
    std::string head(count, '\0');
    in.seekg(static_cast<std::streamoff>(at));
    in.read(head.data(), static_cast<std::streamsize>(count));
    head.resize(static_cast<std::size_t>(in.gcount()));
    return head;
  });
}

}  // namespace whirl::io
