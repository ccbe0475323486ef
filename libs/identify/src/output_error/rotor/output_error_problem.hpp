#pragma once
#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "output_error/output_error.hpp"
#include "output_error/rotor/output_error_signals.hpp"
#include "output_error/rotor/residual_filter.hpp"

namespace whirl::identification::detail {

/// Known accelerations of the main mode on the half grid (2 N - 1), m/s^2, per record; empty: none.
using KnownForces = std::vector<Eigen::VectorXcd>;

/// fit_output_error_rotor with known accelerations beside the forces of the model.
OutputErrorFit fit_with_forces(const std::vector<RotorRecord>& records, const RotorModel& start,
                               const OutputErrorOptions& options, const std::vector<std::complex<double>>& start_eps,
                               double start_delay, const KnownForces& forces);

/// Where a fit ended, for a problem with `parameters` that may have more than the fit: these keep their values of
/// `options`.
Point point_of(const OutputErrorFit& fit, const OutputErrorOptions& options, const std::vector<Parameter>& parameters);

/// The rotor as a problem of output error: main mode integrated with its sensitivities, readings through the axes of
/// the probes beside offset, modes, decays and runout, residual whitened by the filter of each record.
class OutputErrorProblem {
 public:
  /// `forces`: as for fit_with_forces; it must live as long as the problem.
  OutputErrorProblem(const std::vector<RotorRecord>& records, const OutputErrorOptions& options, std::size_t modes,
                     const KnownForces& forces)
      : measured_(records),
        options_(options),
        forces_(forces),
        parameters_(parameter_list(records, options, modes)),
        signals_(records.size()),
        filters_(records.begin(), records.end()) {
    expect_unseen_starts();
  }

  const std::vector<Parameter>& parameters() const { return parameters_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  double values() const {
    double sum = 0;
    for (const ResidualFilter& f : filters_) sum += f.values();
    return sum + static_cast<double>(expected_.size());
  }

  void linearise(Point& p, SquareSum& sum);
  void last(Point& p, SquareSum& sum);
  Point moved(const Point& p, const Eigen::VectorXd& step) const;
  /// No parameter moves by more than the share `tolerance` of its standard deviation.
  bool small(const SquareSum& sum, const Eigen::VectorXd& step, double decrease) const {
    const double n = static_cast<double>(step.size()), variance = std::max(1.0, sum.cost / (values() - n));
    return decrease < options_.solver.tolerance * options_.solver.tolerance * variance * n;
  }

  /// Runge-Kutta steps per sample, at most 16, whose error moves no parameter by more than a quarter of its standard
  /// deviation: from the motion at p, simulated with one, and with two. `chi_square`: of the fit at p.
  int substeps_needed(Point p, double chi_square) const;

  /// Main mode at sample 0: from the first samples, or of velocity and acceleration the model's whirl at that speed.
  void start_state(Point& p);

 private:
  /// A parameter that lies near a value before the records are read.
  struct Expected {
    Eigen::Index parameter;
    double value, sd;
  };
  void expect_unseen_starts();
  void refresh_all(Point& p) {
    for (std::size_t r = 0; r < measured_.size(); ++r) {
      refresh(p, r, measured_[r], options_, known_force(r), signals_[r]);
    }
  }
  const Eigen::VectorXcd* known_force(std::size_t r) const { return forces_.empty() ? nullptr : &forces_[r]; }
  StepGrid grid(std::size_t r) const { return {measured_[r].dt, steps_of(options_), measured_[r].derivative()}; }
  TermForces forces(const Point& p, std::size_t r, const Signals& s) const {
    return {p.terms, s.angle, measured_[r].t0, s.known.size() > 0 ? &s.known : nullptr, &s.turns};
  }
  Eigen::VectorXd residual(const Point& p, std::size_t r, OutputErrorRecord& record);
  void jacobian(const Point& p, std::size_t r, const std::vector<Eigen::Index>& unknowns);

  const std::vector<RotorRecord>& measured_;
  const OutputErrorOptions& options_;
  const KnownForces& forces_;
  std::vector<Parameter> parameters_;
  std::vector<Signals> signals_;
  std::vector<ResidualFilter> filters_;
  std::vector<Expected> expected_;  ///< initial state of axes that are not measured
  // Megabytes each; kept from one step to the next.
  Sensitivities motion_;
  Eigen::MatrixXd slopes_;
  Eigen::ArrayXd likelihood_slope_;  // of the last residual of a clipped record
};

}  // namespace whirl::identification::detail
