#pragma once
#include <filesystem>
#include <optional>
#include <vector>

#include "whirl/balancing/job.hpp"
#include "whirl/balancing/sheet.hpp"
#include "whirl/diagnosis/correction.hpp"
#include "whirl/diagnosis/unbalance_budget.hpp"
#include "whirl/io/json.hpp"

namespace whirl::balancing {

/// What is known of the influence before the trials.
struct PriorOptions {
  std::filesystem::path from;  ///< balance.json of an earlier job, model.json or modes.json
  double common = 0.3;         ///< sd of the error that its coefficients share at a speed (complex part)
  double each = 0.15;          ///< sd of the error of each coefficient alone
};

/// What is asked of a job beside its runs. SI. 0 or empty: as the job's file states (JobFile::plan), else not stated.
struct JobOptions {
  std::optional<diagnosis::Criterion> criterion;  ///< else least squares
  std::optional<diagnosis::Drift> drift;          ///< else automatic
  double noise = 0;                               ///< sd of one reading, SI 0-p; else from the runs
  double noise_written = 0;                       ///< the same in the unit of the readings
  double limit = 0;                               ///< largest mass of a plane, kg
  MassPlaces places;
  bool drop_dependent = false;  ///< no mass on a plane that acts as another (independent part below 0.2, Darlow)
  bool all_runs = false;        ///< a run that contradicts the others is named, but used
  PriorOptions prior;
  std::vector<double> zones;        ///< limits of zones A, B, C, m, in the kind of the readings; empty: ISO 20816-3
  diagnosis::PlacingErrors errors;  ///< of what is put on (95 %), for the error budget
  BalancedRotor rotor;
};

struct SolvedJob {
  BalancingSheet sheet;
  io::Json json;  ///< whirl.balancing
};

/// Masses to put on, readings before and after with intervals, influence coefficients, contradictions, error budget.
/// With options.prior.from, trial runs may be missing (Bayesian combination, least squares and free masses only).
/// `title`: stands on the sheet. `on_rotor`: masses that stay (kg, by plane) where a guided job has ended; else those
/// that are prescribed. Throws Error where the runs do not tell the influence, and for options that contradict.
SolvedJob solve_job(const std::string& title, const JobFile& file, JobOptions options,
                    const std::optional<Eigen::VectorXcd>& on_rotor = {});

}  // namespace whirl::balancing
