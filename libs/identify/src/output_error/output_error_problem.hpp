#pragma once
#include <Eigen/Core>
#include <vector>

#include "output_error/output_error_signals.hpp"
#include "output_error/residual_filter.hpp"

namespace whirl::identification::detail {

/// Cost, normal matrix and gradient of the output-error fit at a point.
class OutputErrorProblem {
 public:
  OutputErrorProblem(const std::vector<RotorRecord>& records, const OutputErrorOptions& options, std::size_t modes)
      : measured_(records),
        options_(options),
        parameters_(parameter_list(static_cast<int>(records.size()), options, static_cast<int>(modes))),
        signals_(records.size()),
        filters_(records.begin(), records.end()) {}

  const std::vector<Parameter>& parameters() const { return parameters_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }
  /// Independent numbers in the residuals of all records.
  double values() const {
    double sum = 0;
    for (const ResidualFilter& f : filters_) sum += f.values();
    return sum;
  }
  /// Cost at p; with `normal` also the normal matrix and gradient. Infinite when the motion diverges.
  double evaluate(Point& p, Eigen::MatrixXd* normal, Eigen::VectorXd* right);
  /// Main mode at sample 0 from a fit of {1, cos beta, sin beta} to the first samples; at rest when it hardly turns.
  void start_state(Point& p);

 private:
  void refresh_all(Point& p) {
    for (std::size_t r = 0; r < measured_.size(); ++r) refresh(p, r, measured_[r], options_, signals_[r]);
  }
  void accumulate(const Point& p, int r, const Sensitivities& sens, const Eigen::VectorXd& residual,
                  Eigen::MatrixXd& normal, Eigen::VectorXd& right) const;

  const std::vector<RotorRecord>& measured_;
  const OutputErrorOptions& options_;
  std::vector<Parameter> parameters_;
  std::vector<Signals> signals_;
  std::vector<ResidualFilter> filters_;
};

}  // namespace whirl::identification::detail
