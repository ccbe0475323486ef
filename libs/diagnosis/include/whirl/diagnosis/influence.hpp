#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/estimate.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/diagnosis/correction.hpp"

namespace whirl::diagnosis {

/// One reading of all probes at all speeds with known masses on the rotor.
struct BalancingRun {
  std::string name;  ///< for messages
  double time = 0;   ///< any unit, e.g. hours or the number of the run; the drift is linear in it
  Eigen::VectorXcd
      masses;  ///< by plane: all that is on the rotor beyond its state as found, m exp(i angle), with rotation
  Eigen::VectorXcd vibration;  ///< by row, m zero-to-peak, exp(i phase lead); NaN where nothing was read
};

/// A balancing job: what was on the rotor and what the probes read.
struct BalancingJob {
  std::vector<std::string> planes;
  std::vector<std::string> rows;   ///< names of the readings, "probe at speed"
  std::vector<int> speed;          ///< of each row: rows of one speed share one noise; empty: all one speed
  std::vector<BalancingRun> runs;  ///< in any order
  /// Throws Error when sizes do not fit, a mass is not finite, or there is no run.
  void check() const;
};

/// How the drift of the vibration with time (warming up) is treated.
enum class Drift { none, linear, automatic };  ///< automatic: linear where two runs more than unknowns are left

struct InfluenceOptions {
  Drift drift = Drift::automatic;
  double noise = 0;      ///< sd of one reading per component, m; 0: from the scatter of the runs
  double alarm = 0.002;  ///< chance of naming a good job's run (all runs together), for Gaussian scatter
  bool exclude = true;   ///< a run that contradicts the others is left out
};

/// A run that the others contradict.
struct Contradiction {
  int run = -1;
  double chance = 0;        ///< of so large a difference by scatter, times the number of runs tested
  std::string slip;         ///< what it looks as if; empty when no usual slip explains it
  double explained = 0;     ///< part of the difference (sum of squares) that this slip explains
  std::vector<int> or_run;  ///< other runs that may as well be the wrong one: left out instead, the rest agrees too
};

/// Vibration = baseline + drift (time - time of the last run) + influence masses, fitted to all runs.
struct InfluenceFit {
  Eigen::MatrixXcd influence;  ///< rows x planes, m per unit of mass
  Eigen::VectorXcd baseline;   ///< as found, at the time of the last run, m
  Eigen::VectorXcd drift;      ///< per unit of time; zeros when not fitted
  bool with_drift = false;
  Eigen::VectorXd noise;    ///< by row: sd of one reading per component, m; NaN when nothing tells it
  Eigen::VectorXd freedom;  ///< by row: degrees of freedom behind `noise`; infinity when stated by the user
  /// By row: covariance of (baseline, [drift,] influence) over E|noise|^2 = 2 noise^2, Hermitian.
  std::vector<Eigen::MatrixXcd> cofactor;
  std::vector<int> speed;                     ///< of each row
  std::vector<Contradiction> contradictions;  ///< runs left out (or only named), most certain first
  bool angles_reversed = false;       ///< every mass angle looks as if counted the other way; nothing was changed
  double repeatability = 0;           ///< sd per component between runs with the same masses, m; NaN without such runs
  std::vector<std::string> untested;  ///< runs that no other run can contradict
  Summary summary;

  /// sd per component of influence(row, plane).
  double sd(Eigen::Index row, Eigen::Index plane) const;
};

/// Least squares over all runs, row by row. Throws Error as job.check() and when the runs do not tell every plane's
/// influence, naming the plane and the missing run.
InfluenceFit fit_influence(const BalancingJob& job, const InfluenceOptions& options = {});

/// Covariance (re, im by plane: 2P x 2P) of the unconstrained weighted least-squares correction, first order in the
/// noise of baseline and influence. NaN when the noise is not known.
struct CorrectionUncertainty {
  Eigen::MatrixXd covariance;
  double freedom = 0;   ///< effective degrees of freedom (Welch and Satterthwaite)
  double quantile = 0;  ///< of Student's t, 97.5 %: half width of an interval = quantile * sd
  Estimate real(Eigen::Index plane, const Eigen::VectorXcd& masses) const;
  Estimate imag(Eigen::Index plane, const Eigen::VectorXcd& masses) const;
  Estimate magnitude(Eigen::Index plane,
                     const Eigen::VectorXcd& masses) const;  ///< sd across the vector's direction dropped
  Estimate angle(Eigen::Index plane, const Eigen::VectorXcd& masses) const;  ///< rad; whole turn when 0 is covered
};
CorrectionUncertainty correction_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                             const Eigen::VectorXcd& masses);
/// The same for limits and min-max, where no formula holds: `draws` redrawn fits, each solved again.
CorrectionUncertainty redrawn_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                          Criterion criterion, int draws = 200, unsigned seed = 1);

/// |baseline + influence masses| of each row with a 95 % interval, the error of both in it.
std::vector<Estimate> predicted_residual(const InfluenceFit& fit, const Eigen::VectorXcd& masses);

}  // namespace whirl::diagnosis
