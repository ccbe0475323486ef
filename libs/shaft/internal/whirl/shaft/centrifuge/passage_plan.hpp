#pragma once
#include <string>
#include <vector>

#include "whirl/core/summary.hpp"
#include "whirl/io/json.hpp"
#include "whirl/shaft/centrifuge/setup.hpp"
#include "whirl/shaft/rotor.hpp"

namespace whirl::shaft {

struct PassageOptions {
  double limit = 0;          ///< largest deflection of a probe (of a disc, where there is none), 0 to peak, m
  double highest = 0;        ///< speed that is run up to, rad/s
  double torque = 0;         ///< of the drive beyond its losses, N m; 0: not known
  double slowest = 3.14159;  ///< accelerations looked at, rad/s^2: 30 rpm/s
  double fastest = 3000;
};

/// The passage of one forward critical speed.
struct Passage {
  double critical = 0;      ///< rad/s
  double from = 0, to = 0;  ///< speeds between which the acceleration matters, rad/s
  double peak_slow = 0;     ///< largest deflection at `PassageOptions::slowest`, m
  double needed = 0;        ///< least acceleration that keeps the limit, rad/s^2; 0: `slowest` keeps it; infinite: none
  double peak = 0;          ///< at `needed`, at least `slowest` and at most `fastest`; m
  std::string place;        ///< where
  double peak_drive = 0;    ///< at what the drive can; NaN where that is not known
};

/// How fast through? The accelerations of a run-up that keep a limit.
struct PassagePlan {
  std::vector<Passage> passages;  ///< ascending
  double inertia = 0;             ///< of all that turns, kg m^2
  double drive = 0;               ///< acceleration that the torque gives, rad/s^2; NaN: not known
  Summary summary;  ///< not usable where a passage keeps the limit at no acceleration, or at none the drive can
};

/// With the allowed imbalance at the buckets in place of the file's unbalance and bow, and half the load; by simulation
/// of every passage with the model of few coordinates. Throws Error without [centrifuge], probes and discs, and for a
/// limit or speed that is not positive.
PassagePlan plan_passages(const Rotor& rotor, const CentrifugeSetup& setup, const PassageOptions& options);

/// `whirl.centrifuge_runup/1`.
io::Json to_json(const PassagePlan& plan);

}  // namespace whirl::shaft
