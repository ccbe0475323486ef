#pragma once
#include <memory>
#include <string>
#include <vector>

#include "whirl/identify/evidence.hpp"

namespace whirl::identification {

/// `score` of a record that comes part by part, in memory for a part and one horizon or period. The run goes on from
/// part to part; the same as of the whole record but for the noise estimate (by part) and the starts near the ends of
/// parts.
class PartwiseScore {
 public:
  /// `horizon` as for `score`; `period`: characteristic period, s, over which starts are fitted (maps: any).
  PartwiseScore(const IdentifiedModel& model, double horizon, double period);
  /// The samples that follow.
  void add(const Recording& part);
  std::vector<StateScore> finish();

 private:
  struct Sums {
    double origin = 0, first = 0, second = 0;  // of samples - origin
    double noise = 0, noise_samples = 0;
  };
  void follow(bool last);
  void follow_on(Eigen::Index ready, bool last);
  void follow_restarted(Eigen::Index ready, bool last);
  void compare(const Eigen::MatrixXd& inputs, const Eigen::VectorXd& start, Eigen::Index count, Eigen::Index counted);
  Eigen::Index period_samples() const;

  IdentifiedModel model_;
  CompiledModel compiled_;
  double horizon_, period_;
  int steps_;              // a sample, of runs with inputs
  Recording waiting_;      // the samples from a little before next_
  Eigen::Index next_ = 0;  // the sample in waiting_ that is due
  Eigen::Index samples_ = 0;
  Eigen::VectorXd state_;  // there, of a run that goes on
  std::vector<StateScore> scores_;
  std::vector<Sums> sums_;
};

/// Free-run prediction, as one run and restarted every characteristic period, of held-out data that come part by part.
/// The period is that of the first 65536 samples.
class HeldOutParts {
 public:
  HeldOutParts(const IdentifiedModel& model, std::string what);
  void add(const Recording& part);
  HeldOut finish();

 private:
  void begin();
  IdentifiedModel model_;
  HeldOut result_;
  Recording lead_;
  std::unique_ptr<PartwiseScore> whole_, near_;
};

}  // namespace whirl::identification
