#pragma once
#include <string>

#include "solve.hpp"
#include "whirl/balancing/session.hpp"

namespace whirl::balancing {

/// The `[[run]]` block of the run just made. Vectors are written in the convention of the file; `typed` is how they
/// were typed. `proposed`: masses (with rotation, kg) taken when none were typed. `name`: of the run.
std::string run_text(const RunMade& run, const VectorConvention& typed, const JobFile& file,
                     const Eigen::VectorXcd& proposed, const std::string& name);

/// Without its last `[[run]]` block. Throws Error when there is none.
std::string without_last_run(const std::string& text, const std::string& path);

}  // namespace whirl::balancing
