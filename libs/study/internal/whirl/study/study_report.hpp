#pragma once
#include <string>

#include "whirl/report/document.hpp"
#include "whirl/report/table.hpp"
#include "whirl/study/study.hpp"

namespace whirl::study {

/// The report of a study: figures and tables in the paper's order with the paper's numbers beside, the identified
/// equations, the parameters beside the truth of the rig, and what agrees and what does not, computed from the study's
/// own numbers.
report::Document study_report(const Study& study);

/// Parameters found on the ideal rotor at 20 dB: error against the truth per method, and whether the interval covers
/// it.
report::Table accuracy_table(const Study& study);

/// How much of the suppression at 5 g is the unbalance feedforward's and how much the law's: PD and TSMC, each tuned
/// with and without it.
std::string feedforward_statement(const Study& study);

}  // namespace whirl::study
