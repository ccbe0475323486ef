#pragma once
#include <string>
#include <vector>

#include "command.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/shaft/system.hpp"

namespace whirl::app {

/// `whirl rotor ...`: flexible rotors from a rotor file. `whirl centrifuge ...`: those with [centrifuge].
void add_rotor(CommandLine& app, Session& session);
void add_centrifuge(CommandLine& app, Session& session);

void add_rotor_modes(CommandLine& rotor, Session& session);
void add_rotor_campbell(CommandLine& rotor, Session& session);
void add_rotor_criticals(CommandLine& rotor, Session& session);
void add_rotor_response(CommandLine& rotor, Session& session);
void add_rotor_fit(CommandLine& rotor, Session& session);
void add_rotor_run(CommandLine& rotor, Session& session);

/// A rotor file and its model.
struct LoadedRotor {
  shaft::Rotor rotor;
  shaft::System system;
};
LoadedRotor load_rotor(const std::string& file);

/// A name that may stand in the header of a CSV file: letters, digits and underscores.
std::string column_name(std::string text);

/// A record with the angle of its shaft.
struct TurningRecord {
  Recording record;
  Eigen::Index first = 0;  ///< sample of the first angle
  Eigen::VectorXd angle;   ///< rad
};
/// Throws Error where no channel shows a turning shaft.
TurningRecord load_turning_record(const std::string& file);
/// The channel of a probe: its name, as it is or as `whirl rotor run` writes it; "" where there is none.
std::string channel_of(const Recording& record, const std::string& name);

/// "forward", "backward", or "mixed" where neither has 9 tenths of the motion.
std::string whirl_word(double direction);

}  // namespace whirl::app
