#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/hardware/run_loop.hpp"
#include "whirl/io/json.hpp"

namespace whirl::hardware {

struct RealtimeRunOptions {
  double seconds = 0;                                      ///< 0: until the rig is done or `stop`
  bool require_realtime = false;                           ///< throw Error when the system refuses a real-time property
  std::filesystem::path record;                            ///< HDF5 recording of every cycle; empty: none
  std::vector<std::pair<std::string, std::string>> texts;  ///< head of the recording: controller, settings, ...
  std::function<void(const rt::LoopSample&)> take;         ///< every cycle, in the calling thread
  std::function<void(const LoopOutcome&)> started;         ///< once, with the real-time properties granted and refused
  std::function<void(const std::string&)> note;            ///< the recording has stopped, and why; the loop runs on
  rt::LoopControl* control = nullptr;                      ///< of a person who may arm, disarm and clear a trip
  StopRequest stop = never_stop;
};

/// What one laser delivered.
struct LaserReport {
  bool present = false;
  std::uint64_t frames = 0, frames_lost = 0, bytes_dropped = 0;
  long late = 0;  ///< ticks without a new sample
};

/// A controller on hardware, as it was seen by the sensors.
struct RealtimeRun {
  LoopOutcome loop;
  IoSettings settings;
  double x_peak = 0, y_peak = 0;         ///< m, zero-to-peak, of the valid samples
  double force_rms = 0, force_peak = 0;  ///< N; rms of the x axis, peak of both
  double force_y_rms = 0;                ///< N
  long samples = 0, lost = 0;            ///< ticks, and those without a valid displacement
  long saturated = 0;                    ///< ticks with a limited force
  std::array<LaserReport, 2> lasers{};
  std::vector<std::string> angle;             ///< with a tacho: how the angle was found and what was assumed
  long tacho_missing = -1, tacho_extra = -1;  ///< pulses lost and added since it is followed; -1: no tacho
  long not_recorded = 0;                      ///< cycles that the recording lacks
  std::string record_error;                   ///< why; empty: it is complete
  Summary summary;                            ///< unusable when the loop did not arm or tripped by itself
};

/// Closes the loop on the sensors and actuators of `io`. The displacement that trips is the smaller one of `io` and of
/// the design (margin trip_displacement_m). Throws Error for a controller of another rate, settings out of range, and
/// hardware that cannot be opened.
RealtimeRun run_realtime(const ControllerDesign& design, const IoSettings& io, const RealtimeRunOptions& options);
/// whirl.realtime/1
io::Json to_json(const RealtimeRun& run);

/// Sensors and rotor angle without control.
struct RecordRun {
  LoopOutcome loop;
  std::vector<std::string> angle;  ///< with a tacho: how the angle was found and what was assumed
  long cycles = 0;                 ///< written
  long not_recorded = 0;           ///< cycles that the recording lacks
  std::string record_error;        ///< why; empty: it is complete
  Summary summary;                 ///< unusable when there is none
};
RecordRun record_disarmed(const IoSettings& io, const RealtimeRunOptions& options);
/// whirl.record/1
io::Json to_json(const RecordRun& run);

}  // namespace whirl::hardware
