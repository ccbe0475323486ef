#pragma once
#include <functional>
#include <vector>

#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification::detail {

/// Runge-Kutta steps a sample, up to 16, with which the error of the steps moves no estimate by more than a quarter of
/// its standard deviation: from the runs with one step and with two, in units of the noise. `two`: the same runs as
/// `one`, inputs given for two steps. Runs that diverge do not count.
int substeps_needed(const CompiledModel& model, const std::vector<FreeRun>& one, const std::vector<FreeRun>& two,
                    double dt, const RefineOptions& options);

/// The same from the size of the change between the runs, root of its sum of squares by the noise, when `steps` are
/// doubled.
int substeps_for(double change, int steps, int most);

/// A driven model refined with more steps a sample.
struct FinerSteps {
  int steps = 1;
  Refined fit;
  bool against = false;  ///< the records speak clearly for the steps there were
  int passes = 0;
};
/// More steps a sample where the noise asks for them and the runs follow clearly better so: what an input does between
/// its samples is then read from its band. One step needs its middle only, and may suit an input of another kind
/// better. `runs`: cut for so many steps, begun where `model` begins. `steps` is that of before where it stays.
FinerSteps finer_steps(const IdentifiedModel& model, const std::function<std::vector<FreeRun>(int)>& runs, int steps,
                       double dt, RefineOptions options);

}  // namespace whirl::identification::detail
