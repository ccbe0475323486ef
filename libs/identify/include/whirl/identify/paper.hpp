#pragma once
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/regression/regression.hpp"

namespace whirl::identification {

/// What the Gaussian filter is applied to.
enum class PaperFilter {
  data,                 ///< x and y before differentiation
  data_and_derivative,  ///< and again after each differentiation (paper, text after eq. 16)
  equation,             ///< terms formed from raw data, then every column alike: the equation stays true
};

struct PaperOptions {
  RotorRecordOptions record;
  double filter_sd = 6e-3;  ///< of the Gaussian, s, 0 to 0.1; the paper gives none
  PaperFilter filter = PaperFilter::data;
  /// Terms as text in X1..X6 and t; empty: the 17 of eq. 24.
  std::vector<std::string> library;
  /// FRF poles, rad/s: adds the columns e^{lambda t} of eq. 24 as e^{Re t} cos(Im t), e^{Re t} sin(Im t), t from the
  /// start of the record. Their amplitudes belong to that record: see docs on modes.
  std::vector<std::complex<double>> poles;
  /// Eq. 19: lasso path, weight by cross-validation over contiguous time blocks.
  regression::SolveOptions solver = {.method = "lasso", .selection = regression::Selection::cv};
};

/// The paper's chain (section IV, eqs. 14 to 24) on a run-up or run-down, as printed apart from the misprints listed in
/// docs/paper-errata.md: Gaussian filter, fourth-order central differences twice (eq. 15; 4 samples lost at each end),
/// library of eq. 24, one sparse regression per axis, forward simulation of that library model.
///
/// Result: X1' = X2, X2' = ..., X3' = X4, X4' = ... in SI units, inputs X5 = beta, X6 = beta' (and t). `parameters`:
/// k1, k2, c, e, e_phase (rad) as far as their terms were kept: averages of both axes, k2 = -(3 a + b)/4 over the terms
/// a x^3 + b x y^2, the one combination that synchronous whirl shows; the same per axis with suffix _x, _y; rmse_x,
/// rmse_y (m, free run against measured; absent when it diverges), whose squares by the noise variance are
/// summary.chi_square. Standard deviations are those of independent rows and do not contain the bias of one-sided
/// filtering. An unusable record gives an empty model with its reason. The method's own bias at 20 dB is tens of
/// percent: summary.trust says so.
IdentifiedModel identify_paper(const RotorRecord& record, const PaperOptions& options = {});
IdentifiedModel identify_paper(const Recording& recording, const PaperOptions& options = {});

struct ConsistentOptions {
  RotorRecordOptions record;
  double filter_sd = 10e-3;  ///< of the Gaussian on every column, s
  bool offset = true;        ///< constant force (sensor offset) is estimated, never thresholded away
};

/// The same filter on every column and the five-parameter tied rotor by least squares (method "consistent"): the simple
/// method that is within a small factor of the best on a filter of about 10 ms at 10 Hz whirl.
/// Noise bias of the cubic is removed with the noise variance of the record. Sets `rotor`.
IdentifiedModel identify_consistent(const RotorRecord& record, const ConsistentOptions& options = {});
IdentifiedModel identify_consistent(const Recording& recording, const ConsistentOptions& options = {});

}  // namespace whirl::identification
