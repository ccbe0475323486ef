#pragma once

namespace whirl::modal {

/// Operations for one set: some 10 s of a core of 2.5 GHz.
constexpr double kMostWork = 2e10;

/// Work of the fits of one set, counted where it is done, so that a set that the model does not suit ends: loops that
/// add, split or try poles stop at the limit and keep what they have. Counts operations, not time: the same set gives
/// the same result on every machine. Of the thread; limits may stand inside each other.
class WorkLimit {
 public:
  /// `operations`: multiplications and additions, in all.
  explicit WorkLimit(double operations);
  ~WorkLimit();
  WorkLimit(const WorkLimit&) = delete;
  WorkLimit& operator=(const WorkLimit&) = delete;

  double spent() const { return spent_; }
  bool stopped() const { return stopped_; }

  /// Counts work done.
  static void add(double operations);
  /// True beyond the limit of any, which is then marked as stopped with all limits inside it.
  static bool over();
  /// Marks the innermost as stopped: a part of the result that was cut short is kept.
  static void stop();
  /// Operations left within all; without a limit, no end of them.
  static double left();

 private:
  double limit_, spent_ = 0;
  bool stopped_ = false;
  WorkLimit* outer_;  // counts what this one does too
};

}  // namespace whirl::modal
