// Equations of a rotor from a run-down, checked on a run-up that was not used. Usage: identify_and_validate RUNDOWN
// RUNUP
#include <cstdio>
#include <whirl/whirl.hpp>

int main(int argc, char** argv) try {
  if (argc != 3) return 2;
  const whirl::Identification id = whirl::identify(whirl::io::read(argv[1]));
  for (const auto& [name, value] : id.model.parameters) std::printf("%s = %g\n", name.c_str(), value.value);
  for (const std::string& warning : id.summary.warnings) std::printf("warning: %s\n", warning.c_str());
  const whirl::Validation other = whirl::validate(id.model, whirl::io::read(argv[2]));
  whirl::io::save("model.json", id.model);
  return id.usable() && other.summary.status != whirl::Status::unusable ? 0 : 1;
} catch (const whirl::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
