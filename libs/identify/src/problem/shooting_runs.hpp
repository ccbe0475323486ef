#pragma once
#include <map>
#include <string>
#include <vector>

#include "weak/integral_rows.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification::detail {

/// Candidate terms of the sought equations, by lhs.
using Candidates = std::map<std::string, std::vector<expr::Expr>>;

/// Free runs of about `length` samples covering the stretches; at most about `most` samples in all, spread evenly.
/// Inputs band-limited, for `steps` steps a sample.
std::vector<FreeRun> cut_runs(const CompiledModel& model, const std::vector<Stretch>& stretches,
                              const SindyOptions& options, Eigen::Index length, Eigen::Index most, int steps = 1);

/// rms over the record of every candidate, and of right-hand sides, for shares.
class Shares {
 public:
  Shares(const Candidates& candidates, const std::vector<Stretch>& stretches, const SindyOptions& options);
  double of(const std::string& function) const;
  double of(const Equation& equation) const;

 private:
  Eigen::VectorXd rms_of(const std::vector<expr::Expr>& functions) const;
  const std::vector<Stretch>& stretches_;
  const SindyOptions& options_;
  std::vector<std::string> names_;
  std::map<std::string, double> size_;
};

}  // namespace whirl::identification::detail
