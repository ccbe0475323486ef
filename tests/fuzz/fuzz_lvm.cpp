// LabVIEW measurement files.
#include "signal_checks.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] { check(io::parse_lvm(bytes, "fuzz.lvm"), bytes.size(), 1); });
}
