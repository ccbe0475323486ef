#pragma once
#include <string>

#include "whirl/io/json.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/sliding.hpp"

namespace whirl::pages {

/// The argument that the sliding surface is reached, along one run: what it needs, what the run had.
report::Table sliding_table(const tuning::SlidingStudy& study);
/// The same tick by tick: t_s, s_x_m_s, s_y_m_s, disturbance_x_m_s2, disturbance_y_m_s2, V_m2_s2, dV_dt_m2_s3 and its
/// bound.
std::string sliding_csv(const tuning::SlidingStudy& study);
/// Sliding variables with their layer, disturbance with the switching gain (eq. 42), V, dV/dt with its bound (eq. 39).
report::Figure sliding_figure(const tuning::SlidingStudy& study);
/// Numbers of the table in SI; what is infinite is left out.
io::Json to_json(const tuning::SlidingStudy& study);

}  // namespace whirl::pages
