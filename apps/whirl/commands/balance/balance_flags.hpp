#pragma once
#include <string>
#include <vector>

#include "command.hpp"
#include "whirl/balancing/session.hpp"

namespace whirl::app {

/// Flags of `whirl balance` for a job of runs.
struct JobFlags {
  std::string phase, amplitude, angles;  ///< empty: not stated
  std::string criterion, drift, prior, out, html, pdf;
  double slow_roll_rpm = 0, noise_um = 0, noise = 0, limit_gram = 0, piece_gram = 0, hole_gram = 0, first_hole_deg = 0;
  double mass_kg = 0, radius_mm = 0, grade = 0, speed_rpm = 0;
  double mass_error_gram = 0, angle_error_deg = 0, radius_error_mm = 0;
  std::vector<double> zones_um;
  balancing::JobOptions plain;  ///< flags that need no unit

  void add_to(CommandLine* sub);
  bool wants_sheet() const { return !html.empty() || !pdf.empty(); }
  balancing::JobOptions options() const;
  balancing::VectorConvention convention() const;  ///< as stated
};

/// Flags of `whirl balance --session`.
struct GuidedFlags {
  std::string file;                         ///< the job; made when it is not there
  std::vector<std::string> planes, probes;  ///< of a new job
  std::vector<double> speeds_rpm, probe_deg;
  double keyphasor_deg = 0, notch_deg = 0, critical_rpm = 0, trial_gram = 0, target_um = 0, allowed_um = 0;
  double target = 0, allowed = 0;  ///< in `unit`
  std::string edge = "leading", unit = "um";
  balancing::RunMade run;
  bool undo = false;

  void add_to(CommandLine* sub);
  balancing::NewJob job(const JobFlags& flags) const;
};

}  // namespace whirl::app
