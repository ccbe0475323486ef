#pragma once
#include <Eigen/Core>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "whirl/monitor/frame_source.hpp"

namespace whirl::monitor {

/// Largest |value| allowed per channel. A vibration passes zero twice per cycle: it counts as below its limit again
/// when it has stayed there for a second.
class LimitWatch {
 public:
  struct State {
    Eigen::Index channel = 0;
    double limit = 0;      ///< SI
    double largest = 0;    ///< |value| since the limit was set or reset
    double last_over = 0;  ///< s
    long crossings = 0;
    bool over = false;
  };

  LimitWatch(const StreamInfo& info, const std::map<std::string, double>& limits);
  /// Sets or replaces a limit. Throws Error for an unknown channel or a limit that is not positive.
  void set(const std::string& channel, double limit);
  void reset();
  /// Looks at samples (rows) from `t_first` on; returns a line for the log per change of state. `where`: appended to a
  /// line that says that a limit was crossed, e.g. " at 1650 rpm".
  std::vector<std::string> look(double t_first, const Eigen::Ref<const Eigen::MatrixXd>& rows,
                                const std::string& where);
  const std::vector<State>& states() const { return states_; }

 private:
  StreamInfo info_;
  std::vector<State> states_;
};

/// "x_mm=0.5" as channel and limit in SI. Throws Error.
std::pair<std::string, double> read_limit(const std::string& text);

}  // namespace whirl::monitor
