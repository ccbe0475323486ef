#pragma once
#include <string>
#include <vector>

#include "balance_job.hpp"

namespace whirl::app {

/// Flags of `whirl balance --session`.
struct GuidedOptions {
  std::string file;                         ///< the job; made when it is not there
  std::vector<std::string> planes, probes;  ///< of a new job
  std::vector<double> speeds_rpm, probe_deg;
  double keyphasor_deg = 0, notch_deg = 0, critical_rpm = 0, trial_gram = 0, target_um = 0, allowed_um = 0;
  std::string edge = "leading";
  std::string readings, record, masses, run;  ///< the run just made
  bool undo = false, steady = false;

  void add_to(CommandLine* sub);
  bool states_job() const { return !planes.empty() || !probes.empty() || !speeds_rpm.empty(); }
};

/// Makes or resumes the job, takes down the run just made, and says which run comes next, where the masses go and why.
void balance_session(const GuidedOptions& guided, const JobOptions& job, Session& session);

}  // namespace whirl::app
