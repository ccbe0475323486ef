#pragma once
#include <vector>

#include "whirl/rt/drivers/tacho_search.hpp"

namespace whirl::rt {

/// What is known of a tacho on an analogue input when the loop begins.
struct TachoMarks {
  std::vector<double> marks{0};         ///< turns, ascending from 0, below 1
  double bottom = 0, top = 5;           ///< levels of the signal, V
  double arm = 0.3, middle = 0.5;       ///< shares of them: an edge crosses `middle` after the signal was beyond `arm`
  bool rising = true, falling = false;  ///< edges that are marks
  double bandwidth = 5;                 ///< of the speed, Hz
  double sample_time = 1e-3;            ///< s
};

/// Angle, speed and acceleration between the pulses of a tacho: at each mark the filter of `AngleTracker` with the time
/// since the last mark as its step, between marks constant acceleration. An edge far from every mark that is due is
/// left out (`extra`); a mark without an edge is passed over (`missing`). The tacho is lost, its angle stands, and a
/// rig takes that for a dead encoder,
/// - after three marks, or half a turn of marks, without an edge,
/// - after edges in a row that are no marks: two on a shaft thought to be at rest, five on one that turns,
/// - after edges that fit another mark or another speed,
/// - after ticks left out in which the shaft may have come near another mark.
/// It is found again where the marks show which is which (TachoSearch): one a turn, or uneven ones. Several even ones
/// do not; they stay lost.
class TachoTracker {
 public:
  /// The state at the tick before the first `update`: angle (rad, whole turns at marks[0]), rad/s, rad/s^2.
  TachoTracker(const TachoMarks& marks, double beta, double omega, double omega_dot);
  /// The voltage of a tick, `ticks` after the last one.
  void update(double volts, long ticks) noexcept;
  double beta() const noexcept;       ///< rad
  double omega() const noexcept;      ///< rad/s
  double omega_dot() const noexcept;  ///< rad/s^2
  bool lost() const noexcept { return lost_; }
  long missing() const noexcept { return missing_; }
  long extra() const noexcept { return extra_; }

 private:
  void advance(double time) noexcept;
  void take_edge() noexcept;
  void follow(double off) noexcept;
  void find() noexcept;
  void pass_marks() noexcept;
  void cross_gap(double time, bool edge) noexcept;
  double place(long mark) const noexcept;  ///< turns, of marks counted from marks[0] of turn 0
  double room() const noexcept;            ///< turns from the next mark to the nearer of its neighbours
  double deviation() const noexcept;       ///< turns, of the edges
  double unseen() const noexcept;          ///< turns/s^2 by which the acceleration may have been another one
  double gate() const noexcept;            ///< turns about the next mark

  TachoMarks tacho_;
  TachoSearch search_;
  double most_missing_, least_room_ = 1;
  double turn_, speed_, acceleration_ = 0;  ///< turns, 1/s, 1/s^2
  double since_ = 0;                        ///< s since the last edge that was taken
  double scatter_ = 0;                      ///< turns squared, of the edges about where they were expected
  double slack_ = 0;                        ///< turns by which the state may be off after ticks left out
  double last_volts_ = 0, time_ = 0;
  long next_ = 0, in_a_row_ = 0, extra_in_a_row_ = 0, missing_ = 0, extra_ = 0;
  std::size_t unsearched_ = 0;  ///< edges
  bool started_ = false, low_ = false, high_ = false, lost_ = false;
};

}  // namespace whirl::rt
