#pragma once
#include <Eigen/Core>
#include <vector>

namespace whirl::modal {

/// Spectra of one record, a line per row.
struct LineSpectra {
  double spacing = 0;          ///< Hz
  Eigen::MatrixXcd forces;     ///< lines x forces
  Eigen::MatrixXcd responses;  ///< lines x responses
};

/// What one step of the frequency axis gives.
struct LocalEstimate {
  Eigen::MatrixXcd value;       ///< forces x responses
  Eigen::MatrixXd leverage;     ///< variance of `value` for noise of unit power on every line
  Eigen::VectorXd left;         ///< per response: sum of squares that is left
  Eigen::VectorXd power;        ///< per response: sum of squares without the transient
  Eigen::VectorXd force_power;  ///< per force: the same
  Eigen::VectorXd given_power;  ///< per force: sum of squares
  double freedom = 0;           ///< complex degrees of freedom of `left`
  double lines = 0;             ///< the same of `power`
  bool solved = false;          ///< false: the forces have no power there, or cannot be told apart
};

/// Least lines a step must have, over all records, that four degrees of freedom are left for the noise.
Eigen::Index least_lines(Eigen::Index forces, std::size_t records);

/// Frequency responses at `centre`, Hz, from the lines at most half of `width` away: polynomials of order two in
/// frequency, common to all records, beside one of order two for the transients of each record and response. Where that
/// leaves far more than a model with one denominator of order two for all responses does (a resonance narrower than the
/// step), the latter is taken: local rational method (McKelvey and Guerin, IFAC SYSID 2012).
LocalEstimate local_polynomial(const std::vector<LineSpectra>& records, double centre, double width);

/// Transients of the responses on one line.
struct TransientEstimate {
  Eigen::VectorXcd value;  ///< per response
  Eigen::VectorXd left;    ///< per response: sum of squares that is left
  double leverage = 0;     ///< variance of `value` for noise of unit power
  double freedom = 0;      ///< complex degrees of freedom of `left`; below 1: no estimate
};

/// Transients at line `k`: polynomials of order two through the five nearest lines on either side that are no multiple
/// of `periods` and carry no force.
TransientEstimate transient_at(const Eigen::MatrixXcd& responses, Eigen::Index k, Eigen::Index periods);

}  // namespace whirl::modal
