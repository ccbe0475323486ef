// WAV files.
#include "signal_checks.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] { check(io::parse_wav(bytes, "fuzz.wav"), bytes.size(), 2); });
  check_parts(file_of(bytes), bytes.size(), 2);
}
