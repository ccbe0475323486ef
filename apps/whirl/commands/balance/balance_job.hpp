#pragma once
#include <string>

#include "balance_runs.hpp"
#include "command.hpp"

namespace whirl::app {

/// Flags of `whirl balance` for a job of runs.
struct JobOptions {
  VectorConvention convention;
  std::string criterion = "least-squares", drift = "automatic", out, html;
  double slow_roll_rpm = 0, noise_um = 0, limit_gram = 0, piece_gram = 0, hole_gram = 0, first_hole_deg = 0;
  int holes = 0;
  bool drop_dependent = false, all_runs = false;

  void add_to(CommandLine* sub);
};

void balance_runs(const std::string& path, const JobOptions& options, Session& session);

}  // namespace whirl::app
