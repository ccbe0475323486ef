#pragma once
#include <optional>

#include "whirl/modal/oma.hpp"

namespace whirl::modal {

struct OrderOptions {
  int orders = 1;                      ///< multiples of the speed that excite: 1X, 2X, ...
  double band_low = 0, band_high = 0;  ///< Hz; 0 = what the orders run over
};

/// Modes from a run-up or run-down without a measured force: 1X, 2X, ... answer to unbalance (force with the square of
/// the speed) or to what else turns with the rotor (constant or with the square, whichever explains more). Per line of
/// speed the orders are fitted to the samples by the rotor's angle, with a linear change inside the line. The spectrum
/// of each order over that of its force is then a frequency response, exact however fast the sweep, and fitted as
/// `fit_modes` does; modes seen in several orders are joined. Shapes are relative, not scaled by mass.
/// `OperationalMode::orders` counts the orders that show the mode. Needs a channel with the rotor's angle; responses
/// must be one quantity. Throws Error for a record without one, of fewer than 40 turns, or whose speed changes by less
/// than a tenth.
OperationalModes identify_orders(const Recording& recording, const OrderOptions& options = {});

/// Records without the force, one or several set-ups.
struct SetupsOptions {
  std::string method = "ssi-data";  ///< ssi-data, ssi-cov, or orders: the 1X, 2X, ... of a run-up or run-down
  bool joint = false;               ///< one model of all records (identify_joint); else the modes of each are joined
  std::optional<int> orders = {};   ///< multiples of the speed: to subtract (none), with "orders" to use (1)
  OmaOptions oma = {};              ///< its method and orders are those above
};
/// Throws Error for another method, and for a joint model by orders.
OperationalModes identify_setups(const std::vector<Recording>& setups, const SetupsOptions& options = {});

}  // namespace whirl::modal
