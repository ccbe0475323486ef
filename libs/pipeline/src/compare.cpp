#include "whirl/pipeline/compare.hpp"

#include <algorithm>

#include "robustness_parallel.hpp"
#include "whirl/control/catalogue.hpp"

namespace whirl {

std::string ComparedMethod::label() const {
  return law + ", " + estimator + (feedforward ? "" : ", no feedforward");
}

std::vector<ComparedMethod> default_methods() {
  std::vector<ComparedMethod> out;
  for (const MethodInfo& law : laws()) {
    // The adaptive 1x methods find the synchronous force themselves.
    out.push_back({law.name, "lpf", !law.name.starts_with("pd_"), {}});
  }
  out.push_back({"pd", "lpf", false, {}});
  out.push_back({"tsmc_paper", "lpf", false, {}});
  for (const char* estimator : {"red_implicit", "eso", "kalman", "kfo", "kfe"})
    out.push_back({"tsmc", estimator, true, {}});
  for (const char* law : {"pd", "lsmc", "ftsmc", "sta_implicit"}) out.push_back({law, "kfe", true, {}});
  out.push_back({"pd", "kfo", true, {}});
  return out;
}

std::vector<ComparedResult> compare(const IdentifiedModel& model, const RigParameters& rig,
                                    const CompareOptions& options) {
  ClosedLoopOptions run;
  run.run.seed = options.seeds.empty() ? 101 : options.seeds.front();
  const ClosedLoopPlant plant(rig, run);
  std::optional<ClosedLoopPlant> balanced;
  if (options.balanced_eps) {
    RigParameters p = rig;
    p.rotor.added_mass = 0;
    balanced.emplace(p, run);
  }
  std::vector<ComparedResult> out;
  for (const ComparedMethod& method : options.methods) {
    if (options.progress) options.progress(method.label());
    DesignOptions d = options.design;
    d.law = method.law;
    d.estimator = method.estimator;
    d.feedforward = method.feedforward;
    d.fixed = method.fixed;
    ComparedResult r;
    r.label = method.label();
    r.design = design(model, d);
    r.nominal = plant.run(r.design);
    std::vector<double> peaks(options.seeds.size());
    parallel_for(static_cast<int>(peaks.size()), d.threads, [&](int i) {
      const auto s = static_cast<std::size_t>(i);
      peaks[s] = plant.run(r.design, nullptr, options.seeds[s]).closed.all;
    });
    for (double p : peaks) {
      r.peak_mean += p / static_cast<double>(peaks.size());
      r.peak_worst = std::max(r.peak_worst, p);
    }
    if (balanced) {
      ControllerDesign told = r.design;
      told.model.eps = *options.balanced_eps;
      r.balanced = balanced->run(told);
    }
    if (options.matrix) r.matrix = robustness_matrix(r.design, rig, run.run.seed, d.threads);
    out.push_back(std::move(r));
  }
  return out;
}

}  // namespace whirl
