#pragma once
#include <deque>
#include <optional>
#include <string>
#include <vector>

namespace whirl::monitor {

enum class Trend { steady, run_up, run_down };
std::string_view name(Trend trend);

/// Run-ups and run-downs recognised from the speed of each turn.
///
/// The slope of |speed| is fitted by least squares over the last second, at least eight turns. A run begins when the
/// fitted change over that time exceeds 2 % of the speed, and ends when it is below 0.5 % or has turned round.
class SpeedTrend {
 public:
  /// What a run was, once it is over.
  struct Run {
    Trend trend = Trend::steady;
    double begin = 0, end = 0;              ///< s
    double speed_begin = 0, speed_end = 0;  ///< rad/s
    struct Peak {
      double amplitude = 0, speed = 0;
    };
    std::vector<Peak> largest;                                                 ///< of the 1X amplitude per channel
    double rate() const { return (speed_end - speed_begin) / (end - begin); }  ///< rad/s^2
  };

  /// One turn that ended at `t`, s, with the 1X amplitude per channel. Returns the run that this turn ended.
  std::optional<Run> turn(double t, double speed, const std::vector<double>& amplitude);
  /// No turn came for so long that the shaft stands still: ends a run.
  std::optional<Run> stopped(double t);
  /// The next turn does not follow the last one: ends a run, and forgets the turns before.
  std::optional<Run> interrupt();
  Trend trend() const { return trend_; }

 private:
  struct Point {
    double t, speed;
    std::vector<double> amplitude;
  };
  double slope() const;
  void add(const Point& p);
  std::optional<Run> finish();

  std::deque<Point> window_;
  Trend trend_ = Trend::steady;
  Run run_;
};

}  // namespace whirl::monitor
