#pragma once
#include <string>

#include "whirl/core/control_types.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/sliding.hpp"

namespace whirl::pages {

/// What a design must keep and what it keeps: requirement, value, limit, whether it is met, why. Amplitudes are
/// zero-to-peak. Requirements that the design does not state are left out; one without a limit is for information.
report::Table requirements_table(const ControllerDesign& design);

/// The argument that the sliding surface is reached, along one run: what it needs, what the run had.
report::Table sliding_table(const tuning::SlidingStudy& study);
/// The same tick by tick: t_s, s_x_m_s, s_y_m_s, disturbance_x_m_s2, disturbance_y_m_s2, V_m2_s2, dV_dt_m2_s3 and its
/// bound.
std::string sliding_csv(const tuning::SlidingStudy& study);

/// The tuned numbers of law and estimator, SI, by the names of controller.json.
report::Table parameters_table(const ControllerDesign& design);

}  // namespace whirl::pages
