#pragma once
#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

#include "whirl/tuning/design.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::tuning {

/// What ends the further delay that a controller stands as it is delivered.
enum class DelayLimit : int {
  none = 0,         ///< nothing within the delays that are tried
  stability = 1,    ///< the loop itself: its motion grows or stands
  supervision = 2,  ///< its supervision steps in
  bound = 3,        ///< the motion leaves the displacement that ends a run
};
std::string_view name_of(DelayLimit limit);

struct DeliveredDelay {
  double delay = 0;  ///< s
  DelayLimit limit = DelayLimit::none;
};

/// The smallest further delay that the controller with its supervision does not stand, found by stepping it through its
/// profile: a sample later, two samples, ... up to `stability` (s, that of the loop alone). The delay is there from the
/// start, or comes at one of four instants in mid-run. Half a sample below the first that fails, or `stability`.
/// `seed`: of the certificate's runs.
DeliveredDelay delivered_delay(const ControllerDesign& delivered, double stability, const RotorModel& model,
                               const Hardware& hardware, std::uint64_t seed, int threads);

/// The same for a finished design on a model, as `design` states it, up to the least delay of the loop of all studies.
/// Nothing where one of them does not hold.
std::optional<DeliveredDelay> delivered_delay(const ControllerDesign& design, const std::vector<MarginStudy>& studies,
                                              const IdentifiedModel& model, const DesignOptions& plant);

/// The delay that `design` states: at most 12 samples are tried.
double stated_delay(double stability, double sample_time);

}  // namespace whirl::tuning
