// ATFX files; every binary part they name holds the same 64 bytes.
#include "signal_checks.hpp"
#include "whirl/io/atfx.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const io::AtfxFile file =
        io::parse_atfx(bytes, "fuzz.atfx", [](const std::string&) { return std::string(64, '\x11'); });
    io::signals_from_atfx(file);
    check(io::signals_from_atfx(file), bytes.size(), 100000);
  });
}
