#pragma once
#include <string>

#include "whirl/core/control_types.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/io/json.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::hardware {

/// A recording of a loop through a controller that gets the recorded samples and the forces that were really sent.
struct Replay {
  long cycles = 0;
  long compared = 0;                      ///< cycles that were armed, not limited and not tripped
  double force_rms = 0, force_worst = 0;  ///< difference of the forces over these, N
  bool closed = false;                    ///< the writer of the recording came to its end
  Recording log;                          ///< recorded and replayed side by side, with estimates and sliding variables
};

/// The design that stands in the recording. Throws Error when there is none.
ControllerDesign recorded_design(const rt::LoopRecord& record);
/// The same design with another estimator, whose parameters are its defaults. Throws Error for an unknown name.
ControllerDesign with_estimator(ControllerDesign design, const std::string& estimator);
/// Throws Error when the recording has no cycles; `file` names it.
Replay replay(const rt::LoopRecord& record, const ControllerDesign& design, const std::string& file);
/// whirl.replay/1
io::Json to_json(const Replay& replay);

}  // namespace whirl::hardware
