#pragma once
#include <string>
#include <vector>

namespace whirl::signal {

/// The edge of a pulse that counts. `automatic`: the leading one, away from the level on which the signal rests
/// (falling for a notch that pulls it down).
enum class Edge { automatic, rising, falling, both };

/// What is known of the marks of a tacho before its record is looked at.
struct TachoOptions {
  int pulses = 0;    ///< places a turn, those without a mark included; 0: from the record
  int missing = -1;  ///< places of them without a mark (36-1: 1); -1: from the record
  Edge edge = Edge::automatic;

  bool stated() const { return pulses > 0 || missing >= 0 || edge != Edge::automatic; }
};

/// The marks of one turn, as stated or as the record shows them.
struct TachoPattern {
  int places = 1;                ///< a turn
  std::vector<double> marks{0};  ///< turns, ascending from 0; `places` less the missing ones
  bool assumed = false;          ///< one a turn by default: the pulses are even and do not tell their number

  int missing() const { return places - static_cast<int>(marks.size()); }
  /// Largest distance of a mark from its even place, in places.
  double unevenness() const;
  /// E.g. "36 places a turn, 1 without a pulse".
  std::string text() const;
};

}  // namespace whirl::signal
