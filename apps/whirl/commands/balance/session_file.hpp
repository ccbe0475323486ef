#pragma once
#include <string>

#include "balance_session.hpp"

namespace whirl::app {

/// Text of a new job. Throws Error for what is not stated: planes, probes, phase, amplitude, angles.
std::string new_session_text(const GuidedOptions& guided, const JobOptions& job);

/// The `[[run]]` block of the run just made. Vectors are written in the convention of the file; `typed` is how they
/// were typed. `proposed`: masses (with rotation, kg) taken when none were typed. `name`: of the run.
std::string run_text(const GuidedOptions& guided, const VectorConvention& typed, const JobFile& file,
                     const Eigen::VectorXcd& proposed, const std::string& name);

/// Without its last `[[run]]` block. Throws Error when there is none.
std::string without_last_run(const std::string& text, const std::string& path);

}  // namespace whirl::app
