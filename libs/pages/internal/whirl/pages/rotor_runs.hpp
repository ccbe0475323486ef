#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/pages/rotor_curves.hpp"
#include "whirl/shaft/centrifuge/load_check.hpp"
#include "whirl/shaft/control/passages.hpp"
#include "whirl/shaft/fit/order_run.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/shaft/transient.hpp"

namespace whirl::pages {

/// A name that may stand in the header of a CSV file: letters, digits and underscores.
std::string column_name(std::string text);

/// The synchronous vectors of all probes of a rotor in a record that shows its turning shaft (key, keyphasor, tacho,
/// beta). Throws Error where it does not, and where a probe has no channel.
shaft::OrderRun probe_run(const Recording& record, const shaft::Rotor& rotor, const std::string& name);

/// The same of the sensors of a centrifuge that the record has a channel of, or of those named in `wanted`.
struct SensorRun {
  shaft::OrderRun run;
  std::vector<shaft::CentrifugeSensor> sensors;
};
SensorRun sensor_run(const Recording& record, const shaft::RotorJob& job, const std::vector<std::string>& wanted = {});

struct SimulatedRun {
  shaft::RunOptions run;
  bool full = false;    ///< every coordinate instead of the reduced model
  int modes = 8;        ///< of a plane, of the reduced model
  double noise_db = 0;  ///< rms of a channel over that of the noise added to it; 0: none
  std::uint64_t seed = 1;
  double probe_noise = 0;                            ///< rms of what the controller reads, m
  std::optional<shaft::RotorController> controller;  ///< the run is made with it, and without it beside
};
/// A run of the rotor and what its sensors record: probes (or discs, _x and _y), accelerometers, forces, beta.
struct RotorRecord {
  shaft::RotorRun run;
  std::vector<RotorPlace> places;
  std::vector<shaft::RunPeak> peaks;  ///< by place
  Recording record;
  Eigen::Index coordinates = 0, all_coordinates = 0;  ///< of a plane: used, and of the whole model
  double reduction_error = 0, reduction_speed = 0;    ///< worst difference of the unbalance response, where (rad/s)
  std::vector<shaft::ControlledPassage> passages;     ///< with a controller
  std::optional<double> unstable;                     ///< without the controller, from this speed on, rad/s
  Summary summary;
};
/// Throws Error for a rotor without probes and discs.
RotorRecord simulated_record(const shaft::RotorJob& job, const SimulatedRun& options, const std::string& source);

}  // namespace whirl::pages
