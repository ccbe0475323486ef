#pragma once
#include <functional>
#include <set>
#include <string>
#include <vector>

#include "output_error/sindy_refine.hpp"
#include "problem/shooting_runs.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification::detail {

/// Another right-hand side of one equation.
struct Rival {
  Equation equation;
  double excess = 0;      ///< of its criterion, rows log(cost) + terms log(rows), over the model's
  double chi_square = 0;  ///< that its free runs leave
};

/// The search for terms on free runs with free starts: what refine_and_select does, step by step.
class TermSearch {
 public:
  TermSearch(const IdentifiedModel& model, const Candidates& candidates, const Signs& signs,
             const std::vector<Stretch>& stretches, const Eigen::VectorXd& sd, double characteristic_rate,
             const SindyOptions& options);

  enum class Outcome { settled, diverged, stopped };

  /// Drops and adds terms until neither changes. `diverged`: free runs of the model do; `stopped`: no passes are left.
  Outcome settle(IdentifiedModel& model);
  bool spent() const { return passes_ >= options_.search.max_passes; }

  /// Shorter runs forgive a poor model. False when they are short already.
  bool shorten() {
    if (length_ <= 10) return false;
    set_length(length_ / 2);
    return true;
  }

  /// Four times longer runs hold more information: fewer starts to estimate, slow and nearly dependent terms told
  /// apart. Kept while the free run still follows (chaos and model error end it). False when it was not.
  bool lengthen(IdentifiedModel& model);

  /// Tries another right-hand side of one equation; keeps it when the criterion of the free runs falls. False when it
  /// did not, or the terms then did not settle. `other` becomes what was fitted, its excess that over the model.
  bool exchange(IdentifiedModel& model, Rival& other);

  /// Tries the sets of terms that the information of the score test hardly speaks against, and takes what is better.
  /// Returns those that the records cannot tell from the model's, best first.
  std::vector<Rival> settle_rivals(IdentifiedModel& model);

  double rmse() const { return followed_.rmse; }
  bool converged() const { return followed_.converged; }
  Followed followed() const {
    return {dt_ * static_cast<double>(length_),
            followed_.output_rmse,
            followed_.output_rows,
            followed_.autocorrelation,
            followed_.covariance,
            followed_.blocked,
            steps_ > 1,
            {}};
  }

 private:
  static constexpr Eigen::Index kMostSamples = 20000;
  static constexpr int kMostSteps = 16;

  struct Fit {
    Eigen::VectorXd output_rmse, output_rows;
    Eigen::MatrixXd autocorrelation, covariance;
    double rmse = 0;
    bool converged = false;
    std::vector<TermScore> blocked;
    Eigen::MatrixXd information = {};  // of all candidates, where the terms settled
    Eigen::VectorXd gradient = {};
  };
  static double square(double x) { return x * x; }

  /// Driven systems: more steps a sample where the records ask for them. True when there are.
  bool take_finer_steps(IdentifiedModel& model);
  Refined refined(const IdentifiedModel& model, const RefineOptions& options,
                  const std::vector<Equation>& candidates = {});
  void take(IdentifiedModel& model, const Refined& refined);
  std::vector<FreeRun> cut(int steps) const {
    return cut_runs(compiled_, stretches_, options_, length_, kMostSamples, steps);
  }
  void set_length(Eigen::Index length) {
    length_ = length;
    runs_ = cut(steps_);
  }
  /// Applies `change` to a copy; all is as before when it returns false.
  bool attempt(IdentifiedModel& model, const std::function<bool(IdentifiedModel&)>& change);
  double samples() const;
  /// Drops several terms at once when together they lower the error by less than t_value^2 each: nearly dependent terms
  /// can each look significant beside the other. Exact on the quadratic approximation (Wald): a best-subset problem
  /// whose Gram matrix is the information matrix.
  bool drop_jointly(IdentifiedModel& model, const Eigen::MatrixXd& covariance, std::set<std::string>& rejected) const;
  /// Adds the absent term with the largest score and tells its name; empty when none is significant. A sign bound in
  /// its way is noted.
  std::string add_best(IdentifiedModel& model, const Refined& scored, const std::set<std::string>& rejected);
  /// Other terms of single equations that the records hardly speak against, by the information of the score test.
  std::vector<Rival> rivals(const IdentifiedModel& model, double margin) const;

  const Candidates& candidates_;
  const Signs& signs_;
  const std::vector<Stretch>& stretches_;
  const SindyOptions& options_;
  CompiledModel compiled_;
  Shares shares_;
  double dt_;
  RefineOptions refine_;
  Eigen::Index length_ = 0;
  int steps_ = 1;              // a sample, of driven systems
  bool coarse_suits_ = false;  // the records speak for the steps there are
  std::vector<FreeRun> runs_;
  Fit followed_;
  int passes_ = 0;
};

}  // namespace whirl::identification::detail
