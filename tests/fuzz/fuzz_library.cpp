// Candidate libraries: what is read is written and read back to the same text.
#include "harness.hpp"
#include "whirl/io/library_toml.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const std::string once = io::to_toml(io::parse_library_toml(bytes, "fuzz.toml"));
    std::string twice;
    require(only_errors([&] { twice = io::to_toml(io::parse_library_toml(once, "once")); }));
    require(once == twice);
  });
}
