#pragma once
#include <string>

#include "whirl/report/figure.hpp"
#include "whirl/report/ticks.hpp"

namespace whirl::report {

/// Limits of one axis in shown units.
struct Limits {
  double low = 0, high = 1;
  bool logarithmic = false;
  bool degrees = false;                 ///< ticks at divisions of a turn
  double fraction(double shown) const;  ///< 0 at low, 1 at high; NaN where a logarithm does not exist
};

/// Limits of the axes of a panel; z only for projected panels.
struct PanelLimits {
  Limits x, y, z;
};

/// Automatic limits from the data, fixed ones from the axes. Throws Error when a panel has nothing to draw.
PanelLimits find_limits(const Panel& panel);
Limits color_limits(const HeatMap& map);

Ticks ticks_of(const Limits& limits, double pixels, double pixels_per_tick);
/// "label [10⁵ unit]"
std::string axis_text(const Axis& axis, int exponent);

/// Throws Error when a series has vectors of different size.
void check_panel(const Panel& panel);

}  // namespace whirl::report
