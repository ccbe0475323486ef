#pragma once
#include "whirl/io/json.hpp"
#include "whirl/report/document.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/delivered_delay.hpp"
#include "whirl/tuning/loop_margins.hpp"

namespace whirl::pages {

using tuning::MarginStudy;

/// Speed, gain, phase, delay and modulus margin, peak sensitivity and its zone of ISO 14839-3.
report::Table margins_table(const MarginStudy& study, const ControllerDesign& design);

/// "further delay as delivered: 6.50 ms, limited by: supervision".
std::string delivered_text(const tuning::DeliveredDelay& found);
io::Json to_json(const tuning::DeliveredDelay& found);

/// whirl.margins/1
io::Json to_json(const std::vector<MarginStudy>& studies);

/// Tables, Nyquist diagram and sensitivity over frequency at the worst speed, peak sensitivity over speed.
report::Document margins_report(const std::vector<MarginStudy>& studies, const ControllerDesign& design,
                                const Provenance& provenance);

}  // namespace whirl::pages
