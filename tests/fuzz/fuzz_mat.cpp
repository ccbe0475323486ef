// MAT v5 files.
#include "signal_checks.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] { check(io::parse_mat(bytes, "fuzz.mat"), bytes.size(), 1100); });
  check_parts(file_of(bytes), bytes.size(), 1100);
}
