#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "whirl/io/csv.hpp"
#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::pages {

/// Synchronous vectors of a table of speeds. Either columns of a speed (`rpm`), amplitudes and phases:
///   amp[_1x][_pp|_rms][_PROBE]_UNIT   peak unless it says pp or rms; a displacement, a velocity or an acceleration
///   phase[_1x][_lag|_lead][_PROBE]_deg   the argument of Z in x(t) = Re(Z exp(j beta)) unless it says lag
/// or what `plot --what bode --out FILE.csv` wrote, with kind, unit, order and sign of the phase as its headers state
/// them. Empty: the file is something else.
/// `phase`, "lag" or "lead", says what the names of phases do not. Throws Error where one says the other.
std::vector<signal::SynchronousCurve> read_bode_table(const std::filesystem::path& file, const std::string& phase = {});

/// The vectors of three columns of a table, whose names say the kind of amplitude and the sign of the phase as above.
signal::SynchronousCurve curve_of_columns(const io::Table& table, const std::string& speed,
                                          const std::string& amplitude, const std::string& phase_column,
                                          const std::string& phase);

/// Sign by which a phase of that column becomes a lead: by its name (`phase_lag`), else by `stated`, else +1.
double phase_sign(const std::string& column, const std::string& stated);

}  // namespace whirl::pages
