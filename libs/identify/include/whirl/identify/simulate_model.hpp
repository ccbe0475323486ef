#pragma once
#include <Eigen/Core>
#include <limits>
#include <string>
#include <vector>

#include "whirl/core/angle_signal.hpp"
#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/expr/tape.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::identification {

/// Right-hand side of an identified model, compiled to one tape.
///
/// An equation's lhs is "S'" for a differential equation of state S or "S[k+1]" for a map. A state without an equation
/// is the integral of the next state where rotor states demand it (X1' = X2, X3' = X4); other states without an
/// equation are prescribed, like the inputs. "t" in a function is time. Not thread-safe: one object per thread.
class CompiledModel {
 public:
  /// Throws Error when a function cannot be parsed or uses a name that is neither state nor input.
  explicit CompiledModel(const IdentifiedModel& model);
  const std::vector<std::string>& states() const { return states_; }  ///< integrated, in order
  const std::vector<std::string>& inputs() const { return inputs_; }  ///< prescribed, in order; may hold "t"
  bool discrete() const { return discrete_; }
  /// States then inputs in, derivatives (or next values) of the states out. No allocation.
  void rate(const double* states_and_inputs, double* out) const noexcept {
    tape_.evaluate_point(states_and_inputs, out);
  }
  const expr::Tape& tape() const { return tape_; }
  /// The same in two steps for long runs: `signals` are what the right-hand sides need of the inputs alone (cos(beta),
  /// beta'^2 cos(beta), a whole forcing), one column each, evaluated at once for all rows of inputs; `rate_of` then
  /// takes states and signals. It evaluates every function of a state once and multiplies by the matrix of
  /// coefficients.
  Eigen::MatrixXd signals(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const { return signals_.evaluate(inputs); }
  void rate_of(const double* states_and_signals, double* out) const noexcept;

 private:
  std::vector<std::string> states_, inputs_;
  bool discrete_ = false;
  expr::Tape tape_, signals_, functions_;
  Eigen::MatrixXd coefficients_;  // states, padded to whole packets of four, x functions
};

/// A free run of a model.
struct ModelRun {
  double dt = 0;                    ///< s
  std::vector<std::string> states;  ///< columns of `values`
  Eigen::MatrixXd values;           ///< samples x states; NaN after a divergence
  bool diverged = false;
  Eigen::Index valid = 0;  ///< samples before the divergence

  Eigen::VectorXd state(const std::string& name) const;
};

/// Free run from `start` by classical Runge-Kutta of order 4 (order: Hairer, Norsett, Wanner I, table II.1.2),
/// `substeps` steps a sample; 0: as many as keep the error of a sample's steps below 1e-7 of each state's range, at
/// most 16. With inputs there are as many as these are given for: `inputs` has one column per model.inputs() and
/// 2 k (samples - 1) + 1 rows for k steps a sample: with one, sample i in row 2 i and the midpoint between samples in
/// row 2 i + 1 (maps use the even rows). A state beyond `limit` in magnitude or not finite ends the run as diverged:
/// data, not an exception. Throws Error when sizes do not fit.
ModelRun simulate(const CompiledModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                  const Eigen::Ref<const Eigen::VectorXd>& start, double dt, Eigen::Index samples,
                  double limit = std::numeric_limits<double>::infinity(), int substeps = 0);

/// Motion of an identified rotor along an angle, as the probes would see it but for runout, delay and errors of the
/// probes: RotorModel with its modes, and the forces of RotorTerm, whose drifts count from the angle's first
/// sample. From the steady whirl of the RotorModel at the first speed, with as many steps a sample as the motion needs.
/// Throws Error for a model without `rotor`; a motion that diverges is not finite.
rotor::Response simulate_rotor(const IdentifiedModel& model, const AngleSignal& angle);

/// Steps a sample that so many rows of inputs are for; 0: for no whole number of them.
int input_steps(Eigen::Index rows, Eigen::Index samples);
/// Steps a sample for free runs of a model over inputs between their samples: one, or 8 where its inputs act there
/// (`timing`) or time is the only one.
int input_steps_of(const IdentifiedModel& model);

/// Inputs of a rotor model from the angle: X5 = beta, X6 = beta', X7 = beta'', t; midpoints are the angle's own.
Eigen::MatrixXd half_grid_inputs(const CompiledModel& model, const AngleSignal& angle, double t0 = 0);
/// Inputs by channel name, for `steps` steps a sample, between samples by band-limited interpolation; t from the
/// record.
Eigen::MatrixXd half_grid_inputs(const CompiledModel& model, const Recording& recording, int steps = 1);

}  // namespace whirl::identification
