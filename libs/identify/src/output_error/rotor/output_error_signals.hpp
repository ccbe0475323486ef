#pragma once
#include <Eigen/Core>
#include <vector>

#include "output_error/rotor/output_error_parameters.hpp"

namespace whirl::identification::detail {

/// Signals that follow from the angle and the poles of one record.
struct Signals {
  Eigen::VectorXcd forcing;                                  // half grid
  Eigen::MatrixXcd profile;                                  // d F / d correction on the half grid
  std::vector<Eigen::VectorXcd> modal, modal_w, modal_zeta;  // q and Gamma dq/dw, Gamma dq/dzeta
  std::vector<Eigen::VectorXcd> decay, decay_w, decay_zeta;  // e^{p t}, e^{conj(p) t} and the derivatives of their sum
  std::vector<Eigen::VectorXcd> runout;
};

/// Brings the signals and the corrected angle of record r up to the point; what cannot have changed is kept.
void refresh(Point& point, std::size_t r, const RotorRecord& measured, const OutputErrorOptions& options,
             Signals& signals);

}  // namespace whirl::identification::detail
