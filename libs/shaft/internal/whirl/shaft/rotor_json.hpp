#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/io/json.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/shaft/transient.hpp"

namespace whirl::shaft {

/// A motion read at a place: what the sensor of a rotor file, or a disc, shows. SI.
struct Reading {
  std::string name;
  double position = 0;      ///< m
  double angle = 0;         ///< rad; of a probe
  std::vector<Peak> peaks;  ///< of the reading over speed
};

/// Documents of docs/formats.md.
io::Json modes_json(const System& system, double speed, const std::vector<Mode>& modes, const Sag& sag,
                    const MeshCheck& mesh);
io::Json import_json(const ImportedRotor& imported, const Summary& summary);
/// Speed, frequency and direction; null for none.
io::Json threshold_json(const std::optional<Threshold>& threshold);
io::Json campbell_json(const std::vector<CampbellPoint>& points);
io::Json criticals_json(const std::vector<Critical>& criticals, double spin_per_whirl,
                        const std::optional<Threshold>& threshold, double highest);
io::Json response_json(const std::vector<Reading>& readings);
io::Json run_json(const RotorRun& run, const std::vector<std::string>& stations, const std::vector<RunPeak>& peaks,
                  double reduction_error);

}  // namespace whirl::shaft
