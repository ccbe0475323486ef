#pragma once
#include <vector>

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
/// left out (`extra`); a mark without an edge is passed over (`missing`). After three marks, or half a turn of marks,
/// without an edge the angle stands: the tacho is lost, and a rig takes that for a dead encoder.
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
  void pass_marks() noexcept;
  double place(long mark) const noexcept;  ///< turns, of marks counted from marks[0] of turn 0
  double room() const noexcept;            ///< turns from the next mark to the nearer of its neighbours
  double deviation() const noexcept;       ///< turns, of the edges
  double gate() const noexcept;            ///< turns about the next mark

  TachoMarks tacho_;
  double most_missing_;
  double turn_, speed_, acceleration_ = 0;  ///< turns, 1/s, 1/s^2
  double since_ = 0;                        ///< s since the last edge that was taken
  double scatter_ = 0;                      ///< turns squared, of the edges about where they were expected
  double last_volts_ = 0;
  long next_ = 0, in_a_row_ = 0, missing_ = 0, extra_ = 0;
  bool started_ = false, low_ = false, high_ = false, lost_ = false;
};

}  // namespace whirl::rt
