#pragma once
#include <Eigen/Core>

#include "whirl/core/recording.hpp"
#include "whirl/identify/output_error_rotor.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/records/check.hpp"

namespace whirl::identification::detail {

/// Takes the findings of the record check over: masks (and bridges masked samples of z along the curve through their
/// neighbours that turns with the rotor), hum, drift, texts. Needs z and the angle.
void take_findings(const records::RecordReport& report, const RotorRecordOptions& options, RotorRecord& record);

/// Sets the size of the noise and, where it is not white, its colour: an autoregression fitted to the spectrum above
/// 2.5 times the top speed (Whittle likelihood, order by BIC), where nothing synchronous moves. Whether it holds at the
/// speed as well, chi-square of the fit tells.
void measure_noise(const RotorRecordOptions& options, RotorRecord& record);

/// Size and colour once more, from what a fit leaves where the motion is below a third of its peak: at the speed itself
/// too. Does nothing to white noise.
void refine_noise(const OutputErrorRecord& fit, RotorRecord& record);

}  // namespace whirl::identification::detail
