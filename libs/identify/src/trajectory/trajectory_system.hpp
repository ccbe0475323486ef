#pragma once
#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "output_error/sensitivity_step.hpp"
#include "trajectory/held_input.hpp"
#include "whirl/expr/tape.hpp"
#include "whirl/identify/trajectory.hpp"

namespace whirl::identification::detail {

/// Sums of one Gauss-Newton step in the unknowns free parameters, dead times, start of each run.
struct TrajectorySums {
  Eigen::MatrixXd normal;    // J'J
  Eigen::VectorXd gradient;  // J'r
  double objective = 0;      // with prior and gaps
  Eigen::VectorXd cost_of;   // per channel, weighted
  Eigen::VectorXd rows_of;   // values compared, per channel
  bool diverged = false;
  double cost() const { return cost_of.sum(); }
};

/// Inputs of one record, ready for any dead time.
struct TrajectoryRecord {
  double dt = 0, t0 = 0;
  std::vector<HeldInput> inputs;
  Eigen::MatrixXd measured;  // samples x channels
};

/// What is estimated and how much it counts.
struct TrajectoryWeights {
  Eigen::VectorXd output, start_prior, gap;  // 1 / sd; empty: 1, none, none
};

/// States and sensitivities of a trajectory model by Runge-Kutta order 4 on held steps.
class TrajectorySystem {
 public:
  TrajectorySystem(const TrajectoryModel& model, const std::vector<std::string>& free_dead_time, int substeps);
  Eigen::Index states() const { return n_; }
  Eigen::Index parameters() const { return p_; }  ///< free ones
  Eigen::Index delays() const { return static_cast<Eigen::Index>(delayed_.size()); }
  /// Values of the free parameters, then dead times in seconds.
  Eigen::VectorXd unknowns() const;
  void set_unknowns(const Eigen::VectorXd& values);
  /// Lower and upper limits of the same.
  std::pair<Eigen::VectorXd, Eigen::VectorXd> limits(double most_dead_time) const;
  TrajectorySums run(const std::vector<TrajectoryRecord>& records, const std::vector<TrajectoryRun>& runs,
                     const std::vector<TrajectoryRun>& given, const TrajectoryWeights& weights);
  /// Outputs, and states where asked for, of one run; empty when it diverges.
  Eigen::MatrixXd follow(const TrajectoryRecord& record, const TrajectoryRun& run, Eigen::MatrixXd* states);
  /// The model with the present values.
  TrajectoryModel model() const;
  /// Steps per sample from now on: none turns the fastest mode of the model, linearised at the starts of runs, by more
  /// than `step` rad.
  void set_steps(const std::vector<TrajectoryRecord>& records, const std::vector<TrajectoryRun>& runs, double step);
  void set_steps(int a_sample) { substeps_ = a_sample; }
  int steps() const { return substeps_; }

 private:
  using Entry = SensitivityStep::Entry;
  struct State {
    Eigen::VectorXd x;
    Eigen::MatrixXd s;  // unknowns x states: parameters, dead times, start
  };
  struct Reached {
    const TrajectoryRecord* of = nullptr;
    double at = 0, value = 0;
  };
  double input(const TrajectoryRecord& record, std::size_t j, double at);
  void load_inputs(const TrajectoryRecord& record, double at);
  void rate(const Eigen::VectorXd& x, bool sensitive);
  void stage(const TrajectoryRecord& record, const HeldStep& step, int k, bool sensitive);
  void step(const TrajectoryRecord& record, const HeldStep& step, bool sensitive, State& at);
  void jump(const TrajectoryRecord& record, const HeldStep& step, State& at);
  void look(const TrajectoryRecord& record, double at, const Eigen::VectorXd& x, bool sensitive);
  Eigen::VectorXd dead_samples(double dt) const;
  /// Sums of one run put where its unknowns are.
  void add_run(const Eigen::MatrixXd& normal, const Eigen::VectorXd& gradient, std::size_t run,
               TrajectorySums& sums) const;
  /// Prior of the start of run `r`, and the gap to the next run where they are `joined`.
  void join(const std::vector<TrajectoryRun>& runs, const std::vector<TrajectoryRun>& given,
            const TrajectoryWeights& weights, std::size_t r, bool joined, const State& end, TrajectorySums& sums) const;

  TrajectoryModel model_;
  int substeps_;
  Eigen::Index n_, m_, p_ = 0, q_;
  std::vector<std::size_t> free_;     // parameters
  std::vector<std::size_t> delayed_;  // inputs
  std::vector<Hold> hold_;
  Eigen::VectorXd dead_;  // s, per input
  bool time_ = false;
  expr::Tape rates_, outputs_;
  std::vector<double> rate_slots_, output_slots_;  // of the tapes at the present parameters
  std::vector<Entry> by_state_, by_parameter_, by_input_, seen_by_state_, seen_by_parameter_;
  std::vector<Eigen::Index> forced_;  // places of by_parameter_ in the forcing of a stage
  std::vector<Reached> reached_;      // of each input
  Eigen::VectorXd in_, out_, dx_, y_;
  Eigen::MatrixXd jacobian_, seen_, seen_parameter_;
  SensitivityStep sensitivities_;
  std::array<Eigen::VectorXd, 4> stage_rates_;
  Eigen::Matrix<double, Eigen::Dynamic, 3> acting_;  // inputs at the beginning, middle and end of a step
};

}  // namespace whirl::identification::detail
