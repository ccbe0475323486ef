#pragma once
#include <cmath>

/// Whether a rate of success is that of sound code: draws as few seeds as that takes.
namespace whirl::testing {

/// Wald's sequential probability ratio test (Wald 1945) of a rate of success: `sound` against `broken`, each taken for
/// the other with the probability `error`. Draw while `open()`; more than `most` draws count as broken.
class SequentialRate {
 public:
  SequentialRate(double sound, double broken, double error = 0.01, int most = 1000)
      : hit_(std::log(sound / broken)),
        miss_(std::log((1 - sound) / (1 - broken))),
        limit_(std::log((1 - error) / error)),
        most_(most) {}
  bool open() const { return std::abs(evidence_) < limit_ && draws_ < most_; }
  void add(bool success) {
    evidence_ += success ? hit_ : miss_;
    ++draws_;
    successes_ += success;
  }
  bool sound() const { return evidence_ >= limit_; }
  int draws() const { return draws_; }
  int successes() const { return successes_; }

 private:
  double hit_, miss_, limit_, evidence_ = 0;
  int most_, draws_ = 0, successes_ = 0;
};

}  // namespace whirl::testing
