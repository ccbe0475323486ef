// `whirl derive`: system.toml to a candidate library. Oracles: the library is written and read back unchanged, its
// terms use declared names only, and a parameter in another SI unit of the same kind gives the same equations.
#include <string>

#include "harness.hpp"
#include "whirl/io/library_toml.hpp"
#include "whirl/lagrange/lagrange_file.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const lagrange::LagrangeFile file = lagrange::parse_lagrange_file(bytes, "fuzz.toml");
    const expr::CandidateLibrary library = lagrange::derive(file.problem).library;
    const std::string once = io::to_toml(library);
    try {
      require(io::to_toml(io::parse_library_toml(once, "once")) == once);
    } catch (const Error&) {
      // A system whose terms are all known has nothing to identify.
      require(library.groups.empty());
    }
  });
}
