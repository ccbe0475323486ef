#pragma once
#include <memory>
#include <string>

#include "whirl/monitor/frame_source.hpp"
#include "whirl/rt/loop_control.hpp"
#include "whirl/rt/loop_sample.hpp"

namespace whirl::monitor {

/// The view of a running loop: what the loop recorded goes in, what a person wants comes out as LoopControl.
class LoopView {
 public:
  struct About {
    std::string name;        ///< what runs
    double rate = 1000;      ///< Hz
    double force_limit = 0;  ///< of the controller, N; 0: none
    bool attended = false;   ///< may the page command the loop?
  };
  explicit LoopView(const About& about);
  ~LoopView();

  /// What a Hub shows; this view must outlive it.
  std::unique_ptr<FrameSource> source();
  /// For the loop; null when nobody may command.
  rt::LoopControl* control();
  /// Each cycle in the order of time, from the thread that empties the loop's queue.
  void take(const rt::LoopSample& sample);
  /// A line of the page's log.
  void note(const std::string& line);
  /// The loop is over; what was shown stays.
  void ended(const std::string& reason);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace whirl::monitor
