#pragma once
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "problem/shooting_runs.hpp"
#include "problem/sign_bounds.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/regression/gram.hpp"

namespace whirl::identification::detail {

/// Records made ready for the regressions of fit_sindy. Batches may be added one after the other: the sums grow with
/// the number of terms only, and of the samples a part is kept for the refinement.
class SindyData {
 public:
  /// Throws Error for options that do not fit together.
  explicit SindyData(const SindyOptions& options);
  /// Adds records. Samples are kept while they number at most `most`; beyond, every second batch is let go.
  void add(const std::vector<Recording>& records, Eigen::Index most);
  /// Throws Error when there are fewer than 50 usable samples.
  void finish() const;

  const SindyOptions& options() const { return options_; }
  const Candidates& candidates() const { return candidates_; }
  const Signs& signs() const { return signs_; }
  const std::vector<Stretch>& stretches() const { return kept_; }
  const Eigen::VectorXd& noise_sd() const { return sd_; }
  /// rms(x') / rms(x - mean), rad/s, of the first batch; 0 for maps.
  double rate() const { return rate_; }
  Eigen::Index samples() const { return samples_; }
  /// Regression problem of the equation of state k.
  regression::Problem problem(std::size_t state) const;

 private:
  void accumulate(const std::vector<Stretch>& stretches);

  SindyOptions options_;
  Candidates candidates_;
  Signs signs_;
  std::vector<expr::Expr> all_;  // every candidate once
  expr::Tape tape_;
  std::unique_ptr<regression::GramAccumulator> sums_;
  std::vector<Stretch> kept_;
  std::vector<std::size_t> batch_of_;  // of kept_
  std::size_t batches_ = 0, keep_every_ = 1;
  Eigen::VectorXd sd_, energy_;
  double rate_ = 0;
  Eigen::Index half_ = 1, samples_ = 0;
};

std::string lhs_of(const std::string& state, const SindyOptions& options);

/// Left-hand side of the largest rms residual, and that residual by the rms of the left-hand side.
struct LeastExplained {
  std::string lhs;
  double residual = 0;
};
struct Regression {
  /// In its states and inputs. Summary: condition number, residual = that of `least`.
  IdentifiedModel model;
  std::vector<Equation> alternatives;  ///< other right-hand sides found on the path
  LeastExplained least;
  std::vector<TermScore> blocked;  ///< by sign bounds
};
Regression regress(const SindyData& data, const regression::SolveOptions& solver);

}  // namespace whirl::identification::detail
