#pragma once
#include <string>

#include "whirl/core/control_types.hpp"
#include "whirl/report/table.hpp"

namespace whirl::pages {

/// What a design must keep and what it keeps: requirement, value, limit, whether it is met, why. Amplitudes are
/// zero-to-peak. Requirements that the design does not state are left out; one without a limit is for information.
report::Table requirements_table(const ControllerDesign& design);

/// The tuned numbers of law and estimator, SI, by the names of controller.json.
report::Table parameters_table(const ControllerDesign& design);

}  // namespace whirl::pages
