#include "rotor_runs.hpp"

#include <filesystem>

#include "whirl/io/signals.hpp"
#include "whirl/pages/rotor_runs.hpp"

namespace whirl::app {
shaft::OrderRun load_run(const std::string& file, const shaft::Rotor& rotor) {
  return pages::probe_run(io::read_recording(file, {}), rotor, std::filesystem::path(file).stem().string());
}

ShownUnit shown_unit(shaft::UnknownKind kind) {
  using Kind = shaft::UnknownKind;
  switch (kind) {
    case Kind::stiffness:
      return {1, "N/m"};
    case Kind::damping:
      return {1, "N s/m"};
    case Kind::material_damping:
      return {1e6, "us"};
    case Kind::joint_damping:
      return {1, "N m s/rad"};
    case Kind::youngs_modulus:
      return {1e-9, "GPa"};
    case Kind::diameter:
    case Kind::disc_position:
      return {1e3, "mm"};
    case Kind::disc_mass:
      return {1, "kg"};
    case Kind::unbalance:
      return {1e6, "gmm"};
    case Kind::bow:
    case Kind::runout:
      return {1e6, "um"};
    case Kind::gain:
      break;
  }
  return {1, ""};
}

}  // namespace whirl::app
