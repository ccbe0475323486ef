#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <vector>

#include "output_error/rotor/output_error_parameters.hpp"

namespace whirl::identification::detail {

/// Signals that follow from the angle and the poles of one record.
struct Signals {
  AngleSignal angle;                                         // corrected, on the grid of the integration's steps
  Turns turns;                                               // of it
  Eigen::VectorXcd forcing;                                  // F on this grid
  Eigen::MatrixXcd profile;                                  // d F / d correction on this grid
  Eigen::VectorXcd known;                                    // known acceleration on this grid; empty: none
  std::vector<Eigen::VectorXcd> modal, modal_w, modal_zeta;  // q and Gamma dq/dw, Gamma dq/dzeta
  std::vector<Eigen::VectorXcd> decay, decay_w, decay_zeta;  // e^{p t}, e^{conj(p) t} and the derivatives of their sum
  std::vector<Eigen::VectorXcd> runout;
};

/// Brings the signals and the corrected angle of record r up to the point; what cannot have changed is kept. `known`:
/// acceleration on the half grid, m/s^2; may be null.
void refresh(Point& point, std::size_t r, const RotorRecord& measured, const OutputErrorOptions& options,
             const Eigen::VectorXcd* known, Signals& signals);

/// Runge-Kutta steps per sample that the options ask for; 1 where they leave it open.
inline int steps_of(const OutputErrorOptions& options) { return std::max(1, options.solver.substeps); }

}  // namespace whirl::identification::detail
