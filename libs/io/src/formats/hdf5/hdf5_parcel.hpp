#pragma once
#include <string>

#include "formats/arrays/arrays.hpp"
#include "whirl/io/apart.hpp"

namespace whirl::io {

/// What follows one another in the parcel of the process that reads (read_apart).
enum class Piece : char { array, contents, finding, end };

void put(ParcelWriter& out, const NamedArray& array);
void put(ParcelWriter& out, const std::string& text, Piece piece = Piece::contents);
/// Throws Error for sizes that are none.
NamedArray take_array(ParcelReader& in);

}  // namespace whirl::io
