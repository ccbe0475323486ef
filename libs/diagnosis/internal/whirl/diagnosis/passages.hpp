#pragma once
#include <vector>

#include "whirl/signal/synchronous_curve.hpp"

namespace whirl::diagnosis {

/// The passage of a run through a critical speed.
struct Passage {
  Eigen::Index at = 0;   ///< index of the largest vector in the curve
  double speed = 0;      ///< rad/s there
  double amplitude = 0;  ///< m peak there
  double ringing = 0;    ///< rad/s, frequency of the free vibration after it; the speed where none is seen
};

/// Critical speeds passed by a run, in the order of the curve. After a passage the rotor rings on at its natural
/// frequency; against the turning mark this beats, and every beat is a maximum of the 1X amplitude. Maxima which the
/// ringing of a larger passage explains are left out: around each one the vector is a straight line in time plus a
/// ringing exp(j (w t - beta)) of every passage found so far, and only what the line keeps counts. Two critical speeds
/// closer than 1.5 sqrt(sweep rate) (Hz, Hz/s) pass as one. Of a curve without times (a
/// table) each row is taken as one turn.
/// A maximum counts when it stands out by `prominence` of the largest amplitude.
std::vector<Passage> passages(const signal::SynchronousCurve& curve, double prominence = 0.08);

}  // namespace whirl::diagnosis
