#pragma once
#include <string>
#include <vector>

namespace whirl::report {

/// Positions and texts of the ticks of one axis, in shown units.
struct Ticks {
  std::vector<double> major;
  std::vector<std::string> labels;  ///< one per major tick
  std::vector<double> minor;        ///< without text
  int exponent = 0;                 ///< labels are to be multiplied by 10^exponent (stands at the axis label)
};

/// Ticks at 1, 2 or 5 (2.5 where 5 would leave a single tick) times a power of ten inside [low, high], about `most` of
/// them and at most four where `most` is 3. low < high, most >= 2.
Ticks linear_ticks(double low, double high, int most);
/// Decades inside [low, high] (0 < low < high), thinned to at most `most`; where fewer than two decades fit, 1-2-5
/// steps. Minor ticks at 2..9 of each decade.
Ticks log_ticks(double low, double high, int most);
/// Ticks in degrees at steps of 5, 15, 30, 45, 90, 180 or multiples of 360.
Ticks degree_ticks(double low, double high, int most);
/// Limits widened by 5 % on each side; a single value gets a range around it.
void widen(double& low, double& high);

}  // namespace whirl::report
