#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"

namespace whirl::modal {

/// First-order response of one run through a critical speed, one entry per revolution.
struct RunupResponse {
  Eigen::VectorXd omega;    ///< rotor speed, rad/s
  Eigen::VectorXd time;     ///< s; empty: from the speeds, one revolution between entries
  Eigen::VectorXcd vector;  ///< 1X vector Z, m peak, x(t) = Re(Z e^{i beta}): a phase LAG enters with minus
};

enum class RunupModel {
  transient,  ///< modes swept at the constant rate of the run: beats after the passage
  steady,     ///< modes in their steady state at each speed
};

struct TransientRunupOptions {
  RunupModel model = RunupModel::transient;
  int modes = 2;                              ///< 1 or 2
  double zeta_low = 0.004, zeta_high = 0.12;  ///< damping ratios searched
  double omega_low = 0, omega_high = 0;       ///< natural frequencies searched, rad/s; 0: the speeds of the run
};

struct RunupMode {
  Estimate omega;                      ///< undamped natural frequency, rad/s
  Estimate zeta;                       ///< damping ratio
  std::complex<double> participation;  ///< m: eccentricity as seen by the probe
};

/// Percent of a run from which on its modes are taken to explain it, where noise does not take the rest. Runs that
/// linear modes do not describe read 84 to 87 %: the kit of examples/data, and the simulated rig, whose stiffness
/// depends on the amplitude.
inline constexpr double kRunupExplained = 95;
/// Times the residual that one of two models with as many parameters may leave by chance.
inline constexpr double kLeftOver = 2;

struct TransientRunupFit {
  std::vector<RunupMode> modes;  ///< ascending in frequency
  std::complex<double> runout;   ///< constant 1X vector, m peak
  double omega0 = 0, alpha = 0;  ///< line through the speeds: omega0 + alpha t, rad/s and rad/s^2
  Eigen::VectorXcd simulated;    ///< 1X vector at the measured revolutions, m peak
  double fit_percent = 0;        ///< 100 (1 - ||Z - simulated|| / ||Z - mean Z||), complex
  double peak_speed = 0;         ///< of the simulated amplitude, rad/s
  std::vector<double> beats;     ///< speeds of the amplitude maxima after the peak, simulated, rad/s
  double peak_speed_measured = 0;
  std::vector<double> beats_measured;
  double amplification = 0;  ///< N_c / (N_2 - N_1) at 0.707 of the measured peak; biased by the sweep; 0: not crossed
  Summary summary;           ///< residual: rms of |Z - simulated|, m
};

/// Natural frequencies and damping from the 1X vector of a linear run-up or run-down through critical speeds.
///
/// Model: Z(t) = runout + sum_k Gamma_k Q_k(t), Q_k e^{i beta} the response of q'' + 2 zeta w q' + w^2 q = F to
/// F = e^{i beta} (beta'^2 - i beta''), beta' = omega0 + alpha t, started in its steady state. Gamma_k and runout are
/// linear and solved inside (variable projection); w_k, zeta_k by a grid and Gauss-Newton from its best cells. Beats
/// after the passage, spaced by 4 pi alpha in (w - w_k)^2, exist in the transient model only.
///
/// Summary unusable for fewer than 20 revolutions or a run that changes speed by less than 10 %, for modes that explain
/// no more than chance, and where a model error as large as what is left could move a mode beyond its half-power width.
/// Warning where more is left than noise and less than 95 % explained, when the speed
/// leaves its line by more than 1 % or a frequency lies at the edge of the search. Throws Error for unequal lengths or
/// options out of range.
TransientRunupFit fit_transient_runup(const RunupResponse& run, const TransientRunupOptions& options = {});

/// Lags read as leads, or the other way, are no modes: makes the summary unusable where less than kRunupExplained is
/// explained and the conjugate vectors leave less than half.
void judge_phase(const RunupResponse& run, const TransientRunupOptions& options, TransientRunupFit& fit);

}  // namespace whirl::modal
