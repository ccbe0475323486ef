#pragma once
#include <string>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/shaft/centrifuge/setup.hpp"
#include "whirl/shaft/fit/order_run.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

/// A sensor of a centrifuge: an accelerometer of its file, or a probe of the rotor.
struct CentrifugeSensor {
  std::string name;
  bool accelerometer = true;  ///< m/s^2; otherwise m
  std::size_t index = 0;      ///< in CentrifugeSetup::accelerometers or Rotor::probes
};
/// All of a file, accelerometers first.
std::vector<CentrifugeSensor> centrifuge_sensors(const Rotor& rotor, const CentrifugeSetup& setup);

/// Is a centrifuge loaded right?
enum class LoadVerdict {
  right,  ///< the imbalance is below the allowed one
  wrong,  ///< above
  open,   ///< the record does not tell
};
std::string_view to_string(LoadVerdict verdict);

/// What a bucket weighs too much against the one opposite.
struct BucketChange {
  int bucket = 0;  ///< 1 is the first
  Estimate mass;   ///< kg
};

struct LoadCheck {
  LoadVerdict verdict = LoadVerdict::open;
  double wrong_probability = 0;       ///< that the imbalance is above the allowed one
  Estimate imbalance;                 ///< mass at the buckets' radius, kg
  Estimate angle;                     ///< of the heavy side from the mark, rad; an interval of 2 pi: any
  std::vector<int> named;             ///< the bucket nearest to the heavy side, or the two it lies between; empty: open
  std::vector<BucketChange> changes;  ///< of the two buckets beside the heavy side
  double first_critical = 0;          ///< forward, of the model, rad/s
  double decided_at = 0;              ///< highest speed used, rad/s
  double seconds = 0;                 ///< of record used
  double smallest_found = 0;          ///< called wrong in 95 of 100 such records, kg; infinite: tolerances hide any
  double miss_rate = 0;               ///< of an imbalance of twice the allowed one that is not called wrong
  double seconds_more = 0;       ///< at the last speed until it is decided, where open; infinite: tolerances hide it
  double chi_square = 1;         ///< misfit of the record: variance of the residual over that of its differences
  double misfit_deviations = 0;  ///< its distance from 1 in standard deviations
  Summary summary;
};

/// Probabilities by which it decides. A wrong verdict is given where the imbalance is above the allowed one with 99 %,
/// so that at most 1 of 100 is a false alarm; a right one where it is below with 95 %. A bucket is named with 98 %.
inline constexpr double kWrongProbability = 0.99, kRightProbability = 0.95, kNameProbability = 0.98;

struct LoadCheckOptions {
  double highest = 0;  ///< speeds up to this are used, rad/s; 0: half the first critical speed
  int draws = 300;     ///< machines within the tolerances
  unsigned seed = 1;   ///< of the draws
};

/// Imbalance of a spin-up below the first critical speed, from the vectors of `sensors` (rows of the run). Posterior
/// over machines drawn within the tolerances, each with its least squares of imbalance (and runout of every
/// displacement probe) and a scale of the noise that the record's own scatter gives; every size of imbalance is as
/// probable before. Throws Error without [centrifuge], for a run that has no eight turns below the speed, and for
/// sensors it has not.
LoadCheck check_load(const Rotor& rotor, const CentrifugeSetup& setup, const OrderRun& run,
                     const std::vector<CentrifugeSensor>& sensors, const LoadCheckOptions& options = {});

}  // namespace whirl::shaft
