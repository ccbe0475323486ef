#pragma once
#include <Eigen/Core>
#include <limits>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/nan.hpp"
#include "whirl/core/recording.hpp"

namespace whirl::diagnosis {

/// What the vibration of a rotor holds.
enum class VibrationCode {
  first_order,           ///< 1X: turns with the shaft
  second_order,          ///< 2X
  harmonics,             ///< 3X and above
  half_orders,           ///< 0.5X, 1.5X, ...
  subsynchronous,        ///< a line between 0.38X and 0.495X
  line_frequency,        ///< the frequency of the electric supply
  twice_line_frequency,  ///< twice that
  sidebands,             ///< a pair of lines at equal distances from 1X or 2X
  phase_scatter,         ///< the 1X vector wanders at steady speed beyond the noise
  run_out,               ///< the 1X vector does not vanish towards standstill
};
inline constexpr int kVibrationCodes = 10;
/// As it stands in JSON and Python, e.g. "second_order".
std::string_view to_string(VibrationCode code);

/// What a finding may mean. A record of vibration alone does not decide between them.
enum class Cause {
  unbalance,
  bent_shaft,
  misalignment,
  unequal_stiffness,  ///< of the shaft's cross section (a crack, keyways)
  oil_whirl,
  oil_whip,  ///< oil whirl locked to a natural frequency
  looseness,
  rub,
  electric,        ///< of a motor or generator: air gap, supply
  pickup,          ///< of the measuring chain: shielding, ground
  modulation,      ///< an amplitude or a speed that changes periodically
  run_out,         ///< of the surface under the probe
  thermal,         ///< a bow or a unbalance that changes as the shaft warms
  other_machine,   ///< vibration from outside
  free_vibration,  ///< at the natural frequency, dying out after the passage of the critical speed
};
std::string_view to_string(Cause cause);

struct VibrationFinding {
  VibrationCode code = VibrationCode::first_order;
  std::string channel;
  Quantity quantity = Quantity::displacement;  ///< of the channel
  /// Amplitude of the largest line, zero to peak, in the SI unit of the channel. Of `phase_scatter` the standard
  /// deviation of the phase beyond the noise, rad.
  double size = 0;
  /// Chance that noise alone shows this anywhere in the record: that of the test, times the number of all tests made.
  double chance = 1;
  double order = kNaN;      ///< of the largest line; NaN where it has none
  double frequency = kNaN;  ///< Hz, of a line of fixed frequency; of sidebands their distance
  double nominal = kNaN;    ///< Hz, of an electric line: of the supply, or twice that
  /// Of an electric line: farther from `nominal` than a large grid goes. A small grid, or a two-pole motor with slip.
  bool off_supply = false;
  std::vector<double> orders = {};  ///< of `harmonics` and `half_orders`: those seen; of `sidebands`: that between them
  double speed = kNaN;              ///< rad/s, where `size` was read
  double low_speed = kNaN;          ///< rad/s, slowest and fastest speed at which it was seen
  double high_speed = kNaN;
  double ratio = kNaN;  ///< to the 1X amplitude at `speed`
  /// An order and an electric line too close to be told apart in this record: the distance in Hz needs a longer one, or
  /// another speed.
  bool ambiguous = false;
  std::vector<Cause> causes = {};
  /// Neither small (below a tenth of the largest line of its channel) nor always there (1X).
  bool remarkable = false;
};

/// Why something was not looked for.
enum class UnjudgedReason {
  no_angle,        ///< no rotor angle, and the vibration does not tell one
  too_few_turns,   ///< fewer than 33 turns; for sidebands and phase scatter fewer than 64
  gaps,            ///< more than 2 % of the samples are missing
  speed_changes,   ///< needs eight blocks of eight turns within 3 % of one speed
  line_beside_1x,  ///< an electric line within a quarter of an order of 1X beats with it
  no_slow_turns,   ///< needs turns below 0.45 of the speed of the largest 1X
  few_slow_turns,  ///< the run passes these speeds within a few turns
  half_or_first,   ///< without an angle: of two lines an octave apart the lower may be 0.5X or 1X
};
std::string_view to_string(UnjudgedReason reason);

struct Unjudged {
  std::string channel;
  std::optional<VibrationCode> code;  ///< nothing: the channel as a whole
  UnjudgedReason reason = UnjudgedReason::no_angle;
};

/// Where the angle comes from to which orders are counted.
enum class AngleSource {
  none,       ///< there is none: nothing was judged
  measured,   ///< encoder, tacho or speed channel
  vibration,  ///< taken as that of the largest line that is not electric; no phase
};

/// An electric line as it stands through the record: x(t) = Re(vector(t) exp(2 pi j frequency t)), t from the begin.
struct ElectricLine {
  std::string channel;
  double frequency = 0;     ///< Hz
  Eigen::VectorXd time;     ///< s from the begin of the record, ascending
  Eigen::VectorXcd vector;  ///< at these times, peak, in the SI unit of the channel
  /// The samples less the line, its vector interpolated between the times; `dt` s > 0.
  Eigen::VectorXd taken_off(const Eigen::VectorXd& samples, double dt) const;
};

struct VibrationFindings {
  AngleSource angle = AngleSource::none;
  double low_speed = kNaN, high_speed = kNaN;  ///< rad/s
  std::vector<VibrationFinding> findings;      ///< by channel, in the order of the codes
  std::vector<Unjudged> unjudged;
  std::vector<ElectricLine> electric;  ///< of the findings `line_frequency` and `twice_line_frequency`

  /// First finding of a code; nullptr when there is none.
  const VibrationFinding* find(VibrationCode code, std::string_view channel = {}) const;
};

struct VibrationOptions {
  std::vector<double> mains{50, 60};  ///< Hz, electric supplies looked for, 0.4 % to either side; then 2 %
  double chance = 0.01;               ///< of a false finding anywhere in a record of noise, in (0, 0.5]
};

/// Looks for orders, electric lines, sidebands, a 1X vector that wanders and run-out in every channel of displacement,
/// velocity or acceleration, at steady speed and through run-ups.
///
/// The channel is resampled over the angle and cut into blocks of whole turns (16 to 1024, as far as the speed stays).
/// In each, all orders and the electric lines found are fitted together under a Hann window, so that 2X at 98.6 Hz and
/// a line of 100 Hz share nothing; a line is compared with the lines free of orders on either side of it, the higher
/// side counting. The chances of the blocks are combined by Fisher's method (1932), over the record and over stretches
/// of it, without the best block of each. An order keeps its order from block to block, an electric line its frequency.
///
/// Without an angle, a record of steady speed is judged by the angle of its largest line that is not electric,
/// or of the line at half its frequency where that is larger than half of it; of any other nothing is judged. Lines
/// below 2e-3 of the largest one, or half a step of the converter, do not count. Throws Error for a record without a
/// sample time, and as `rotation_of`.
VibrationFindings find_vibration(const Recording& record, const VibrationOptions& options = {});

}  // namespace whirl::diagnosis
