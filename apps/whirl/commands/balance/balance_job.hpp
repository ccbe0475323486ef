#pragma once
#include <string>

#include "balance_flags.hpp"

namespace whirl::app {

/// `whirl balance runs.csv`.
void balance_runs(const std::string& path, const JobFlags& flags, Session& session);

/// Makes or resumes the job, takes down the run just made, and says which run comes next, where the masses go and why.
void balance_session(const GuidedFlags& guided, const JobFlags& flags, Session& session);

}  // namespace whirl::app
