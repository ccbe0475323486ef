#include "formats/hdf5/hdf5_chunks.hpp"

#include <zlib.h>

#include <algorithm>
#include <cstdint>
#include <vector>

namespace whirl::io {
namespace {

/// Bytes that a zlib stream unpacks to, counted up to one more than `most`; 0 where it is damaged.
std::size_t unpacked_size(const std::vector<unsigned char>& packed, std::size_t most) {
  z_stream z{};
  if (inflateInit(&z) != Z_OK) return 0;
  std::vector<unsigned char> piece(1 << 16);
  z.next_in = const_cast<unsigned char*>(packed.data());
  z.avail_in = static_cast<uInt>(packed.size());
  std::size_t count = 0;
  int state = Z_OK;
  while (state == Z_OK && count <= most) {
    z.next_out = piece.data();
    z.avail_out = static_cast<uInt>(piece.size());
    state = inflate(&z, Z_NO_FLUSH);
    count += piece.size() - z.avail_out;
  }
  inflateEnd(&z);
  return state == Z_STREAM_END || count > most ? count : 0;
}

}  // namespace

bool chunks_are_whole(hid_t dataset, hid_t plist, hid_t type, hid_t space, hsize_t file_bytes, int axis, hsize_t from,
                      hsize_t to) {
  const int rank = H5Sget_simple_extent_ndims(space);
  hsize_t sizes[H5S_MAX_RANK] = {}, side[H5S_MAX_RANK] = {}, at[H5S_MAX_RANK] = {};
  if (rank < 1 || H5Sget_simple_extent_dims(space, sizes, nullptr) != rank ||
      H5Pget_chunk(plist, H5S_MAX_RANK, side) != rank)
    return false;
  double bytes = static_cast<double>(H5Tget_size(type));
  for (int k = 0; k < rank; ++k) bytes *= static_cast<double>(side[k]);
  // Deflate gains a factor of 1032 at most; a chunk of the format itself is below 4 GiB.
  if (!(bytes < 4e9 && (bytes < 1 << 20 || bytes <= 1100 * static_cast<double>(file_bytes)))) return false;
  const auto whole = static_cast<std::size_t>(bytes);

  bool deflated = false;
  std::size_t checksum = 0;
  const int filters = H5Pget_nfilters(plist);
  unsigned deflate_bit = 0, checksum_bit = 0;
  for (int k = 0; k < filters; ++k) {
    unsigned flags = 0, config = 0;
    std::size_t values = 0;
    switch (H5Pget_filter2(plist, static_cast<unsigned>(k), &flags, &values, nullptr, 0, nullptr, &config)) {
      case H5Z_FILTER_DEFLATE:
        deflated = true;
        deflate_bit = 1U << k;
        break;
      case H5Z_FILTER_FLETCHER32:
        checksum = 4;
        checksum_bit = 1U << k;
        break;
      case H5Z_FILTER_SHUFFLE:
        break;
      default:
        return true;
    }
  }
  std::vector<unsigned char> stored;
  hsize_t begin[H5S_MAX_RANK] = {};
  if (axis < rank) {
    begin[axis] = at[axis] = from / side[axis] * side[axis];
    sizes[axis] = std::min(sizes[axis], to);
  }
  for (int k = rank - 1; k >= 0;) {
    unsigned skipped = 0;
    haddr_t address = HADDR_UNDEF;
    hsize_t size = 0;
    if (H5Dget_chunk_info_by_coord(dataset, at, &skipped, &address, &size) < 0 || size > file_bytes) return false;
    if (address != HADDR_UNDEF) {  // else never written: the fill value
      const std::size_t beside = (skipped & checksum_bit) == 0 ? checksum : 0;
      std::size_t count = size;
      if (deflated && (skipped & deflate_bit) == 0) {
        stored.resize(size);
        std::uint32_t mask = 0;
        if (H5Dread_chunk(dataset, H5P_DEFAULT, at, &mask, stored.data()) < 0) return false;
        count = unpacked_size(stored, whole + beside);
      }
      // The checksum may stand inside the packed bytes or behind them.
      if (count != whole && count != whole + beside) return false;
    }
    for (k = rank - 1; k >= 0; --k) {  // the next chunk, row by row
      if ((at[k] += side[k]) < sizes[k]) break;
      at[k] = begin[k];
    }
  }
  return true;
}

}  // namespace whirl::io
