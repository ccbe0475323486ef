#pragma once
#include "whirl/report/table.hpp"
#include "whirl/study/study.hpp"

namespace whirl::study {

// Tables of the study's report; `accuracy_table` is public (study_report.hpp).
report::Table rig_parameter_table(const Study& study);
report::Table validation_table(const Study& study);
report::Table balanced_table(const Study& study);
report::Table mode_table(const Study& study);
report::Table design_table(const Study& study);

// "tsmc with lpf, no feedforward"
std::string design_label(const ControllerDesign& design);

}  // namespace whirl::study
