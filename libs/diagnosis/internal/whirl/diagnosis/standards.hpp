#pragma once
#include <Eigen/Core>
#include <optional>
#include <string_view>

#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::diagnosis {

/// Numbers by which engineers judge a rotor. The limits are those of the standards as commonly quoted, not copied from
/// the documents: guidance, not a statement of compliance.

/// Half-power reading of a peak of the 1X amplitude over speed (API 617, API 684).
struct Amplification {
  double critical = 0;       ///< speed of the largest amplitude, rad/s
  double amplitude = 0;      ///< there, SI unit of the curve's quantity, peak
  double low = 0, high = 0;  ///< speeds at 0.707 of it, rad/s
  double factor = 0;         ///< AF = critical / (high - low); critically damped below 2.5
  double sweep_rate = 0;     ///< d Omega / dt at the peak, rad/s^2, from one vector per revolution
  double sweep = 0;          ///< |sweep_rate| / critical^2: AF of a run is biased where sweep AF^2 is not small
};
/// Nothing when the amplitude does not fall to 0.707 of the peak on both sides. `turns` revolutions per vector.
std::optional<Amplification> amplification(const signal::SynchronousCurve& curve, int turns = 1);

/// Separation margin asked for between a critical speed and the operating range, fraction of the operating speed:
/// 17 (1 - 1/(AF - 1.5)) %, at most 16 % for a critical below the range; 10 % more, at most 26 %, for one above it; 0
/// for AF < 2.5.
double required_margin(double amplification_factor, bool critical_below);

/// Zone A to D of shaft vibration, ISO 20816-3: peak-to-peak against 4800, 9000, 13200 / sqrt(rpm) um. For steady
/// running. `peak_to_peak` m, `speed` rad/s > 0.
char shaft_vibration_zone(double peak_to_peak, double speed);
/// Upper limit of zone 'A', 'B' or 'C' at a speed, m peak-to-peak.
double shaft_vibration_limit(char zone, double speed);

/// Class of a machine for the zones of housing vibration, ISO 20816-3:2022, Annex A.
struct MachineClass {
  /// 1: above 300 kW (to 50 MW), or an electrical machine with a shaft height of 315 mm or more; 2: above 15 kW to
  /// 300 kW, or a shaft height from 160 to 315 mm.
  int group = 1;
  /// Rigid support: the lowest natural frequency of machine and support, in the direction measured, is at least 25 %
  /// above the main frequency of excitation; flexible otherwise.
  bool flexible = false;
};
/// "1-rigid", "1-flexible", "2-rigid", "2-flexible"; nothing for another word.
std::optional<MachineClass> machine_class(std::string_view word);
std::string_view to_string(const MachineClass& machine);

/// Upper limit of zone 'A', 'B' or 'C' of housing vibration, m/s rms from 10 Hz to 1 kHz, steady running (ISO
/// 20816-3:2022, Tables A.1 and A.2, the values of ISO 10816-3):
///   group 1 rigid 2.3, 4.5, 7.1 mm/s, flexible 3.5, 7.1, 11.0; group 2 rigid 1.4, 2.8, 4.5, flexible 2.3, 4.5, 7.1.
double housing_vibration_limit(char zone, const MachineClass& machine);
/// Zone A to D of a broad-band velocity, m/s rms.
char housing_vibration_zone(double velocity_rms, const MachineClass& machine);

/// Balance grade of ISO 21940-11: e Omega, in m/s (G 6.3 is 6.3e-3 m/s). `eccentricity` m.
double balance_grade(double eccentricity, double speed);
/// The smallest grade of the series 0.4, 1, 2.5, 6.3, ... 4000 (mm/s) that holds it; infinity above.
double balance_grade_class(double grade);

}  // namespace whirl::diagnosis
