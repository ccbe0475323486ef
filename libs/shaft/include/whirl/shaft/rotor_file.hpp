#pragma once
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/shaft/centrifuge/setup.hpp"
#include "whirl/shaft/fit/setup.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// Rotor from TOML; docs/rotor.md lists the keys. Throws Error with file, line, key, value and what is allowed.
Rotor read_rotor(const std::filesystem::path& file);
/// The same with what a fit is to find, [fit] and [[trial]], and what a centrifuge is, [centrifuge] and
/// [[accelerometer]].
struct RotorJob {
  Rotor rotor;
  FitSetup fit;
  CentrifugeSetup centrifuge;
};
RotorJob read_rotor_job(const std::filesystem::path& file);
RotorJob parse_rotor_job(std::string_view text, std::string_view name);
/// From text; `name` stands in messages.
Rotor parse_rotor(std::string_view text, std::string_view name);

/// A rotor that ROSS saved (Rotor.save, TOML, versions 1 and 2), with its elements and its mesh. `remarks`: what does
/// not mean quite the same here. Throws Error with file, line and key for what a rotor file cannot hold.
struct ImportedRotor {
  Rotor rotor;
  std::vector<std::string> remarks;
};
ImportedRotor import_ross_rotor(const std::filesystem::path& file);

/// Names of the rotors to begin with: jeffcott, two-disc, overhung, centrifuge, kit, and with actuators
/// active-centrifuge, levitated.
std::vector<std::string> rotor_templates();
/// TOML text of one of them, with comments. Throws Error for another name.
std::string rotor_template(std::string_view name);

/// The rotor as a file that `read_rotor` reads back.
std::string rotor_text(const Rotor& rotor);

}  // namespace whirl::shaft
