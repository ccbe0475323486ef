#pragma once
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification {

struct SecondOrderOptions {
  std::string output = "y", input = "u";  ///< channels
  /// Candidate terms in <y>, <y>', <u>, t; empty: 1, y, y^2, y^3, y', u.
  std::vector<std::string> library = {};
  int oversample = 4;  ///< band-limited, before differencing: at 9 samples per cycle eq. 15 biases stiffness by -2.4 %
  double filter_sd = 0;  ///< Gaussian on every column of the equation, s; for noisy records
  /// Default: stlsq, share 2 %; the constant is always kept (a sensor offset is not sparse).
  regression::SolveOptions solver = {};
  bool refine = true;  ///< then minimise the free-run error
  /// Terms that may be added on evidence after refinement; empty: y^2, y^4, y^5, y y', y^2 y', y'|y'|, sgn y', u y.
  std::vector<std::string> candidates = {};
  int max_added = 3;         ///< terms added at most; 0: structure of the regression only
  double holdout = 0.3;      ///< last share of the record, for that decision, 0.05 to 0.8
  double least_gain = 0.02;  ///< a term stays when it lowers the free-run error of the held-out part by this share
  Eigen::Index skip = 50;    ///< samples at the start of a free run that do not count
};

/// Equation of motion y'' = f(y, y', u) of one degree of freedom from displacement and input only.
///
/// 1. band-limited oversampling, 4th-order central differences twice (paper eq. 15), sparse regression; where noise
///    leaves its free run 15 % or more of the motion, the weak form of fit_sindy gives the start instead;
/// 2. output-error refinement of all coefficients and of the start (refine_free_run), u band-limited at the midpoints;
/// 3. forward selection: the candidate (of `library` and `candidates`) with the largest score is added, refined, and
///    kept when the free run of the held-out part improves; then the whole record is fitted once more;
/// 4. where no single run follows the record (chaos), the model of fit_sindy over the library, from short runs.
///
/// Result: states y, y', input u; `parameters`: f0 (Hz) and zeta of the linearisation at the offset-free origin;
/// summary.residual is the rms free-run error on the record (unit of y); status unusable when the free run diverges or
/// leaves 15 % of the motion unexplained beyond the noise.
/// The record needs at least 200 samples. Throws Error on unknown channels or options out of range.
IdentifiedModel identify_second_order(const Recording& recording, const SecondOrderOptions& options = {});

/// rms of (measured - free run) over the record after `skip` samples; start from the measured value and the
/// central-difference velocity, above 0.1 % noise from a spline that leaves the noise. Infinite when the run diverges.
double free_run_error(const IdentifiedModel& model, const Recording& recording, const std::string& output,
                      Eigen::Index skip = 50);

}  // namespace whirl::identification
