#pragma once
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "whirl/tuning/design.hpp"
#include "whirl/tuning/robustness.hpp"

namespace whirl::tuning {

/// One method of a comparison.
struct ComparedMethod {
  std::string law, estimator;
  bool feedforward = true;
  std::map<std::string, double> fixed = {};  ///< parameters not tuned

  std::string label() const;  ///< e.g. "tsmc, kfe" or "pd, lpf, no feedforward"
};

/// Every law of the catalogue with the filtered difference, the laws worth it with the observers, PD and TSMC
/// without feedforward: the rows of the notes' benchmark and the industry's 1x methods.
std::vector<ComparedMethod> default_methods();

/// "tsmc", "pd:kfe" or "pd:lpf:no-feedforward": law, estimator (default lpf), feedforward. Throws Error with the known
/// names.
ComparedMethod parse_method(const std::string& text);

struct CompareOptions {
  std::vector<ComparedMethod> methods = default_methods();
  DesignOptions
      design;  ///< law, estimator, feedforward and fixed are replaced per method; threads: methods in parallel
  std::vector<std::uint64_t> seeds{101, 102, 103, 104, 105};  ///< of the evaluation; not those of the tuning
  std::optional<std::complex<double>> balanced_eps;  ///< eccentricity identified on the balanced rotor, m; with it the
                                                     ///< balanced run is made, told this eccentricity
  bool matrix = true;                                ///< run the robustness matrix
  /// Label of a method that is done and the fraction done; one call at a time.
  std::function<void(const std::string&, double)> progress;
};

struct ComparedResult {
  std::string label;
  ControllerDesign design;
  ClosedLoopMetrics nominal;             ///< first seed
  double peak_mean = 0, peak_worst = 0;  ///< whole run over all seeds, m
  std::optional<ClosedLoopMetrics> balanced;
  std::complex<double> balanced_eps;  ///< told in the balanced run, m
  std::vector<RobustnessCase> matrix;

  bool stable_everywhere() const;  ///< in every condition of the matrix
};

/// Designs every method with the same budget, scenarios and seeds, and evaluates all on the same rig with
/// seeds the tuning has not seen. Ordered as given. Only a comparison at equal effort is fair: read the force
/// and its variation beside the peaks; differences below about 10 % are within the scatter of the tuning. The result
/// does not depend on the number of threads.
std::vector<ComparedResult> compare(const IdentifiedModel& model, const rig::RigParameters& rig,
                                    const CompareOptions& options);

/// The method to use: of those that pass the nominal run the one that fails in the fewest conditions of the matrix, of
/// equals the one with the smallest whole-run peak.
const ComparedResult& best_result(const std::vector<ComparedResult>& results);

/// What one imperfection of the machine alone leaves.
struct FloorCase {
  std::string name;
  double peak = 0;      ///< whole run of the true disk centre, x axis, zero-to-peak, m
  double balanced = 0;  ///< the same without the added mass, m
};

/// The physical floor: `design` (told the delay that is left, nothing else changed) on the rig with exact sensors,
/// angle and actuators, without delay and modes, and then with one imperfection at a time: runout that is removed as
/// far as the design knows it, runout that is not removed, sensor noise and resolution, delay and lag, actuator errors,
/// structural modes, angle and speed errors; last, the rig as it is.
std::vector<FloorCase> physical_floor(const ControllerDesign& design, const rig::RigParameters& rig,
                                      std::optional<std::complex<double>> balanced_eps = {}, std::uint64_t seed = 101);

}  // namespace whirl::tuning
