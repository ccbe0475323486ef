#pragma once
#include <optional>
#include <string>
#include <vector>

#include "balance_runs.hpp"
#include "command.hpp"
#include "whirl/pages/balancing_sheet.hpp"

namespace whirl::app {

/// Flags of `whirl balance` for a job of runs.
struct JobOptions {
  std::string phase, amplitude, angles;  ///< empty: not stated
  std::string criterion = "least-squares", drift = "automatic", out, html;
  double slow_roll_rpm = 0, noise_um = 0, limit_gram = 0, piece_gram = 0, hole_gram = 0, first_hole_deg = 0;
  int holes = 0;
  bool drop_dependent = false, all_runs = false;
  std::string prior;  ///< balance.json of an earlier job: what is known before the trials
  double prior_common = 0.3, prior_each = 0.15;
  std::vector<double> zones_um;  ///< stated limits of zones A, B, C; empty: ISO 20816-3
  double mass_error_gram = 0, angle_error_deg = 0, radius_error_mm = 0;
  double mass_kg = 0, radius_mm = 0, grade = 0, speed_rpm = 0;  ///< of the machine; 0: not stated

  void add_to(CommandLine* sub);
  VectorConvention convention() const;  ///< with what is usual where nothing is stated
};

/// The flags, and where one is not given what the job's file states.
JobOptions with_plan(JobOptions options, const JobFile& file);

/// Degrees in [0, 360) as the job writes angles.
double written_angle(double angle, double sign);
/// Holes and pieces of every plane; empty when any place and mass will do.
std::vector<diagnosis::Places> places_of(const JobOptions& options, const VectorConvention& convention,
                                         std::size_t planes);
diagnosis::InfluenceOptions influence_options(const JobOptions& options);

/// Begin of whirl.balancing: the convention of the vectors and the criterion.
io::Json balancing_document(const pages::BalancingSheet& sheet);

struct SolvedJob {
  pages::BalancingSheet sheet;
  io::Json json;  ///< whirl.balancing
};
/// `on_rotor`: masses that stay, by plane, at the end of a guided job; otherwise those that are prescribed.
SolvedJob solve_job(const std::string& path, const JobFile& file, const JobOptions& options,
                    const std::optional<Eigen::VectorXcd>& on_rotor = {});

/// The same with what an earlier job knew of the influence (options.prior); trials may be missing.
SolvedJob solve_with_prior(const std::string& path, const JobFile& file, const JobOptions& options);

void balance_runs(const std::string& path, const JobOptions& options, Session& session);

}  // namespace whirl::app
