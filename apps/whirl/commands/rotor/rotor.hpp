#pragma once
#include <string>
#include <vector>

#include "command.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/shaft/system.hpp"

namespace whirl::app {

/// `whirl rotor ...`: flexible rotors from a rotor file. `whirl centrifuge ...`: those with [centrifuge].
void add_rotor(CommandLine& app, Session& session);
void add_centrifuge(CommandLine& app, Session& session);

void add_centrifuge_runup(CommandLine& centrifuge, Session& session);
void add_rotor_modes(CommandLine& rotor, Session& session);
void add_rotor_campbell(CommandLine& rotor, Session& session);
void add_rotor_control(CommandLine& rotor, Session& session);
void add_rotor_criticals(CommandLine& rotor, Session& session);
void add_rotor_response(CommandLine& rotor, Session& session);
void add_rotor_fit(CommandLine& rotor, Session& session);
void add_rotor_run(CommandLine& rotor, Session& session);
void add_rotor_which(CommandLine& rotor, Session& session);
void add_rotor_trend(CommandLine& rotor, Session& session);

/// A rotor file and its model.
struct LoadedRotor {
  shaft::Rotor rotor;
  shaft::System system;
};
LoadedRotor load_rotor(const std::string& file);

/// "forward", "backward", or "mixed" where neither has 9 tenths of the motion.
std::string whirl_word(double direction);

}  // namespace whirl::app
