#pragma once
#include <numbers>

// Angles and rotational speeds are in rad and rad/s inside; these factors say which way they convert.

namespace whirl {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kTwoPi = 2 * kPi;              ///< rad in one turn; rad/s in 1 Hz
inline constexpr double kRadPerDegree = kPi / 180;     ///< multiply degrees by it to get rad
inline constexpr double kRadPerSecPerRpm = kPi / 30;   ///< multiply rpm by it to get rad/s
inline constexpr double kRpmPerRadPerSec = 30 / kPi;   ///< multiply rad/s by it to get rpm
inline constexpr double kHzPerRadPerSec = 1 / kTwoPi;  ///< multiply rad/s by it to get Hz

}  // namespace whirl
