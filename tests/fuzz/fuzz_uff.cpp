// Universal files: what is read is written, and read again with the same counts.
#include "signal_checks.hpp"
#include "whirl/io/uff.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const io::UffFile file = io::parse_uff(bytes, "fuzz.uff");
    check(io::signals_from_uff(file), bytes.size(), bytes.starts_with("\x1f\x8b") ? 1100 : 2);
    only_errors([&] { io::frf_from_uff(file); });
    const std::string written = io::format_uff(file);
    if (written.empty()) return;  // datasets that are passed over only
    io::UffFile again;
    require(only_errors([&] { again = io::parse_uff(written, "again.uff"); }));
    require(again.functions.size() == file.functions.size() && again.nodes.size() == file.nodes.size());
  });
}
