#pragma once
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "whirl/pipeline/design.hpp"
#include "whirl/pipeline/robustness.hpp"

namespace whirl {

/// One method of a comparison.
struct ComparedMethod {
  std::string law, estimator;
  bool feedforward = true;
  std::map<std::string, double> fixed;  ///< parameters not tuned

  std::string label() const;  ///< e.g. "tsmc, kfe" or "pd, lpf, no feedforward"
};

/// Every law of the catalogue with the filtered difference, the laws worth it with the observers, PD and TSMC
/// without feedforward: the rows of the notes' benchmark and the industry's 1x methods.
std::vector<ComparedMethod> default_methods();

struct CompareOptions {
  std::vector<ComparedMethod> methods = default_methods();
  DesignOptions design;  ///< law, estimator, feedforward and fixed are replaced per method
  std::vector<std::uint64_t> seeds{101, 102, 103, 104, 105};  ///< of the evaluation; not those of the tuning
  std::optional<std::complex<double>>
      balanced_eps;    ///< eccentricity identified on the balanced rotor, m; with it the
                       ///< balanced run is made, told this eccentricity
  bool matrix = true;  ///< run the robustness matrix
  std::function<void(const std::string&)> progress;  ///< label of the method that starts
};

struct ComparedResult {
  std::string label;
  ControllerDesign design;
  ClosedLoopMetrics nominal;             ///< first seed
  double peak_mean = 0, peak_worst = 0;  ///< whole run over all seeds, m
  std::optional<ClosedLoopMetrics> balanced;
  std::vector<RobustnessCase> matrix;
};

/// Designs every method with the same budget, scenarios and seeds, and evaluates all on the same rig with
/// seeds the tuning has not seen. Ordered as given. Only a comparison at equal effort is fair: read the force
/// and its variation beside the peaks; differences below about 10 % are within the scatter of the tuning.
std::vector<ComparedResult> compare(const IdentifiedModel& model, const RigParameters& rig,
                                    const CompareOptions& options);

}  // namespace whirl
