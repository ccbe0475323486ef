#pragma once
#include <filesystem>
#include <vector>

#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::pages {

/// Synchronous vectors of a table of speeds. Either columns of a speed (`rpm`), amplitudes and phases:
///   amp[_1x][_pp|_rms][_PROBE]_UNIT   peak unless it says pp or rms; a displacement, a velocity or an acceleration
///   phase[_1x][_lag|_lead][_PROBE]_deg   the argument of Z in x(t) = Re(Z exp(j beta)) unless it says lag
/// or what `plot --what bode --out FILE.csv` wrote, with kind, unit, order and sign of the phase as its headers state
/// them. Empty: the file is something else.
std::vector<signal::SynchronousCurve> read_bode_table(const std::filesystem::path& file);

}  // namespace whirl::pages
