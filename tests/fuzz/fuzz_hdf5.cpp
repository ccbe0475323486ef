// HDF5 and MAT v7.3 files.
#include "signal_checks.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] { check(io::parse_hdf5(bytes, "fuzz.hdf5"), bytes.size(), 1100); });
  check_parts(file_of(bytes), bytes.size(), 1100, true);
}
