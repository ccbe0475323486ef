#pragma once
#include <vector>

#include "whirl/pages/run_report_tables.hpp"
#include "whirl/pages/verdict.hpp"
#include "whirl/report/document.hpp"

namespace whirl::pages {

/// The zone of each run's shaft vibration and the balance quality of each model, before all other findings. False:
/// none.
bool add_standard_findings(report::Document& document, const std::vector<Verdict>& runs,
                           const std::vector<BalanceQuality>& models);

}  // namespace whirl::pages
