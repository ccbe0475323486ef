#pragma once
#include <string>
#include <vector>

#include "influence_fit.hpp"

namespace whirl::diagnosis {

/// Looks for runs that the others contradict: each run is predicted from all others, and the difference compared with
/// their scatter (F test over all rows, Bonferroni over the runs). The one without which the rest agrees best goes;
/// then again. Where the rest agrees as well without another run (two trials of one plane that contradict each other),
/// a usual slip of one of them decides; otherwise all are named.
class ContradictionSearch {
 public:
  ContradictionSearch(const BalancingJob& job, const RunDesign& design, const InfluenceOptions& options)
      : job_(job), design_(design), options_(options) {}
  /// Clears `used` of the runs found when options.exclude.
  std::vector<Contradiction> run(std::vector<bool>& used);
  bool angles_reversed() const { return angles_reversed_; }
  const std::vector<std::string>& untested() const { return untested_; }

 private:
  struct Difference {
    bool tested = false;
    double square = 0;   ///< sum over rows of |difference|^2 / its expected square
    double freedom = 0;  ///< of `square` (numerator)
    double chance = 1;
  };
  /// Of a run's readings (perhaps changed) from the fit of the others, with these masses on the rotor.
  Difference difference(const InfluenceFit& fit, std::size_t run, const Eigen::VectorXcd& masses,
                        const Eigen::VectorXcd& vibration) const;
  /// One run left out: what the others say of it.
  struct LeftOut {
    std::size_t run = 0;
    InfluenceFit others;
    Difference difference;
    double misfit = 0;  ///< -2 log likelihood of the others
  };
  std::vector<LeftOut> leave_out_each(const std::vector<bool>& kept);
  Contradiction choose(const std::vector<LeftOut>& tests, std::size_t worst) const;
  Contradiction name_slip(const InfluenceFit& others, std::size_t run, const Difference& as_written) const;
  void test_reversed(const std::vector<bool>& used);

  const BalancingJob& job_;
  const RunDesign& design_;
  const InfluenceOptions& options_;
  bool angles_reversed_ = false;
  std::vector<std::string> untested_;
};

}  // namespace whirl::diagnosis
