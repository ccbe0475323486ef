#pragma once
#include <hdf5.h>

namespace whirl::io {

/// True when each stored chunk of a chunked dataset unpacks to the bytes of a whole chunk. The library takes that for
/// granted and otherwise reads beyond the end of what was unpacked. Known: deflate, shuffle and Fletcher's checksum;
/// with other filters the answer is true. False too when a chunk cannot stand in a file of that many bytes. Of the
/// chunks those are looked at that have a value within `from` and `to` of dimension `axis`.
bool chunks_are_whole(hid_t dataset, hid_t plist, hid_t type, hid_t space, hsize_t file_bytes, int axis, hsize_t from,
                      hsize_t to);

}  // namespace whirl::io
