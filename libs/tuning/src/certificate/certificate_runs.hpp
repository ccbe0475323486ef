#pragma once
#include <string>

#include "runs/design_scenarios.hpp"

namespace whirl::tuning {

/// What data sheets of actuators leave open, either way: relative error of the force, angle of its axes in rad.
inline constexpr double kGainTolerance = 0.05, kAxisTolerance = 0.045;

/// How a design does on the plants its certificate speaks for.
struct CertificateRuns {
  std::string refused;  ///< why the judge fails it on one of them; empty: it passes on all
  double peak = 0;      ///< largest whole-run peak on any of them, m
};

/// Runs `trial` on the scenario `ringing` with the actuators at the limits of their tolerance, with the profile
/// reversed, the critical speed held and the speed swinging about it, with structural modes of every sign that may
/// be, 1.5 times as strong and a little off in frequency. The judge looks at runs that begin with the structure at rest
/// (what stands is then the loop's own), the peak is that with and without its ringing. Refused, too, when the
/// tolerance of the actuators makes the peak more than twice `nominal_peak` (m) and 30 um.
CertificateRuns certificate_runs(const ControllerDesign& trial, const TuningScenario& ringing, double nominal_peak,
                                 const RotorModel& model, const Hardware& hardware, std::uint64_t seed, int threads);

/// Why the watch of this design would take back a sound run, begun with a ringing structure and with the actuators at
/// the limits of their tolerance too; empty: it stays quiet.
std::string nominal_alarm(const ControllerDesign& supervised, const TuningScenario& ringing, const RotorModel& model,
                          const Hardware& hardware, std::uint64_t seed, int threads);

}  // namespace whirl::tuning
