#pragma once
#include <string>
#include <vector>

#include "influence_fit.hpp"

namespace whirl::diagnosis {

/// Looks for runs that are not as written. With n runs and p unknowns a sound job leaves the misfit S0 (sum of squares
/// over all readings); a slip of run r, put right, leaves S1. The gain counts as that of one witness a run, because the
/// state of a machine moves all probes together: by scatter alone S1 / S0 < x has at most the chance x^(n - p) for one
/// explanation, times the number tried. A run taken out altogether leaves S2, chance x^(n - p - 1) (the F test of a run
/// against the others); then its unknown slip is believed only where near-repeats among the others show that the
/// machine repeats. Where slips of two runs explain as much, both are named and none goes out.
class ContradictionSearch {
 public:
  ContradictionSearch(const BalancingJob& job, const RunDesign& design, const InfluenceOptions& options)
      : job_(job), design_(design), options_(options) {}
  /// Clears `used` of the runs found when options.exclude.
  std::vector<Contradiction> run(std::vector<bool>& used);
  bool angles_reversed() const { return angles_reversed_; }

 private:
  /// What may be wrong with one run.
  struct Explanation {
    std::size_t run = 0;
    std::string slip;   ///< empty: not known
    double chance = 1;  ///< by scatter
    double score = 0;   ///< - log likelihood
  };
  /// Misfit of a job: sum over readings of |residual|^2 over their level, or over 2 noise^2.
  double misfit(const BalancingJob& job, const std::vector<bool>& used) const;
  /// What a run with these masses and readings adds to the misfit of the others.
  double gap(const InfluenceFit& others, std::size_t run, const Eigen::VectorXcd& masses,
             const Eigen::VectorXcd& vibration) const;
  /// Chance that stated noise makes a run's misfit so large.
  double by_noise(double square) const;
  /// Runs beyond the unknowns, mean over the rows.
  double spare(const std::vector<bool>& used) const;
  double chance(double before, double after, double witnesses, double tried) const;
  std::vector<Explanation> explain(const std::vector<bool>& kept) const;
  bool repeated(const std::vector<bool>& kept, int run) const;  ///< another run is its near-repeat
  Contradiction choose(std::vector<Explanation> found) const;
  void test_reversed(const std::vector<bool>& used);

  const BalancingJob& job_;
  const RunDesign& design_;
  const InfluenceOptions& options_;
  std::vector<double> level_;  ///< by row, square
  bool angles_reversed_ = false;
};

}  // namespace whirl::diagnosis
