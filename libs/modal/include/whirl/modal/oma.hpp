#pragma once
#include <Eigen/Core>
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::modal {

/// Stochastic subspace identification: from the correlations themselves, or from the projection of future on past
/// outputs (unweighted principal components).
enum class SubspaceMethod { covariance, data };

struct OmaOptions {
  SubspaceMethod method = SubspaceMethod::data;
  double band_low = 0, band_high = 0;  ///< Hz; 0 = 0.5 % and 90 % of half the sample rate
  int max_order = 0;                   ///< states; 0 = by the number of channels, at most 60
  int block_rows = 0;                  ///< block rows of the Hankel matrix; 0 = over two periods of the mean frequency
  int blocks = 20;                     ///< of the record, for the variances
  double max_damping = 0.1;
  double presence = 0.33;       ///< share of the orders that show a mode
  double largest_spread = 1.0;  ///< largest sd of a damping ratio, relative to it
  /// Subtract tones before the identification, steady ones and those whose frequency wanders, and what turns with them.
  bool remove_harmonics = true;
  /// Multiples of the speed to subtract where the record holds the rotor's angle (a channel in rad); 0 = those that the
  /// record shows.
  int orders = 0;
  std::vector<double> tones;  ///< Hz; known ones, e.g. from a tachometer, told and subtracted in any case
};

/// A mode seen under unknown broad-band excitation.
struct OperationalMode {
  Estimate frequency;      ///< Hz, undamped
  Estimate damping;        ///< ratio
  Eigen::VectorXcd shape;  ///< per channel, largest component 1; not scaled by mass
  int orders = 0;          ///< model orders that show it
};

/// A tone: not a mode, but the machine's speed or another periodic force.
struct Tone {
  double frequency = 0;       ///< Hz
  Eigen::VectorXd amplitude;  ///< per channel, peak, unit of the record
  double kurtosis = 0;        ///< of the band-passed response: 1.5 for a tone, 3 for a mode under random forces
  std::string evidence;       ///< what tells it from a mode
};

struct OperationalModes {
  std::vector<std::string> channels;
  std::vector<OperationalMode> modes;  ///< ascending in frequency
  std::vector<Tone> tones;             ///< ascending in frequency
  Summary summary;
};

/// Modes from outputs alone (SSI-cov or SSI-data; Peeters and De Roeck, 1999). All orders from one decomposition;
/// variances by first-order perturbation from blocks of the record (Reynders, Pintelon, De Roeck, 2008; Doehler and
/// Mevel, 2013): the eigenvalue's change is bilinear in that of the Hankel matrix. Automatic: poles stable over orders
/// whose damping is known to a factor. Tones are told by their spectral line, by their steady envelope where their
/// frequency wanders (chance below 1e-6), by standing at a multiple of another tone, or by the kurtosis of the
/// band-passed response (Jacobsen, 2007) and a damping interval that reaches zero; they are subtracted and listed
/// apart. A wandering tone is followed by a Kalman smoother; its size and phase are a function of its speed, so that
/// little of the modes beside it goes with it. Channels must be of one quantity. Throws Error for too short records.
OperationalModes identify_operational(const Recording& recording, const OmaOptions& options = {});

/// One model of several set-ups (PreGER): records of one rate that share channels (by name) and each have channels of
/// their own. Correlations with the shared ones are brought to one excitation before the identification, so size and
/// direction of the forces may differ from set-up to set-up; the structure may not, and a warning names the modes whose
/// frequencies do differ. Shapes hold the shared channels first, then those of each set-up (Mevel, Basseville,
/// Benveniste and Goursat, 2002; Doehler and Mevel, 2012). Throws Error without a shared channel, for records of
/// differing rates or quantities, and for too short ones.
OperationalModes identify_joint(const std::vector<Recording>& setups, const OmaOptions& options = {});

/// Joins set-ups of which each shares channels (by name) with the first (PoSER): frequencies and damping are means
/// weighted by variance, shapes are scaled on the shared channels. Modes seen in one set-up only are left out, with a
/// warning. Throws Error when a set-up shares no channel.
OperationalModes merge_setups(const std::vector<OperationalModes>& setups);

}  // namespace whirl::modal
