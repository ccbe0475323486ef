#pragma once
#include "whirl/core/summary.hpp"
#include "whirl/hardware/io_settings.hpp"
#include "whirl/hardware/survey.hpp"
#include "whirl/io/json.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::hardware {

/// Sensitivity of the loop as it runs, the shaft at rest.
struct LoopSensitivity {
  tuning::LoopResponse response;  ///< at the lines of the excitation, Hz, negative: backward whirl
  std::vector<double> deviation;  ///< of |S| at each line, standard deviation from the scatter between periods
  tuning::LoopMargins margins;    ///< of that response
  double peak_deviation = 0;      ///< of the largest |S|
  double excitation = 0;          ///< N rms of an axis
  long periods = 0;               ///< of the excitation that count
  long missed = 0;                ///< ticks that the loop left out
  long limited = 0;               ///< ticks at a force limit: the loop is then not the linear one
  Fault trip = Fault::none;
  Summary summary;  ///< unusable: tripped, or zone D of ISO 14839-3; a warning where the scatter leaves the zone open
};

/// Closes the loop with the design on the shaft at rest, adds a periodic force of many frequencies of both whirl
/// directions (`excitation`, N rms of an axis) and takes S = 1 / (1 + L) = (force of the controller + excitation) /
/// excitation from the periods of 2 s within `seconds` (12 to 600; two of them are for settling). The excitation is
/// kept from the controller, as a disturbance would be. Supervision is off, the trip limits of the settings and of the
/// design act. Throws Error when the rates differ, the shaft turns or nothing trips.
LoopSensitivity measure_sensitivity(const IoSettings& io, const ControllerDesign& design, double seconds,
                                    double excitation, StopRequest stop = never_stop);
/// The same on a rig that `open` opens when everything else is ready.
LoopSensitivity measure_sensitivity(const IoSettings& io, const OpenRig& open, const ControllerDesign& design,
                                    double seconds, double excitation, StopRequest stop = never_stop);

/// whirl.loop-sensitivity/1
io::Json to_json(const LoopSensitivity& measured);

}  // namespace whirl::hardware
