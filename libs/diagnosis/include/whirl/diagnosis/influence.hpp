#pragma once
#include <Eigen/Core>
#include <complex>
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
  bool phases = true;              ///< false: vibration holds lengths only (fit_amplitudes)
  /// Throws Error when sizes do not fit, a mass is not finite, or there is no run.
  void check() const;
};

/// How the drift of the vibration with time (warming up) is treated.
enum class Drift { none, linear, automatic };  ///< automatic: linear where two spare runs are left beside it

struct InfluenceOptions {
  Drift drift = Drift::automatic;
  double noise = 0;     ///< sd of one reading per component, m; 0: from the scatter of the runs
  double alarm = 0.01;  ///< chance of naming a good job's run (all runs together), for Gaussian scatter
  bool exclude = true;  ///< a run that contradicts the others is left out, where the machine repeats
};

/// Runs are near-repeats of each other when on every plane their masses differ by at most this share of the larger and
/// their angles by at most this: as fitters repeat a run with what they have at hand.
constexpr double kNearMass = 0.03;
constexpr double kNearAngle = 5 * 3.14159265358979323846 / 180;  // rad
/// A machine repeats when near-repeats scatter by at most this share of the rms reading: a trial of the usual effect
/// (40 % of the reading) is then known to a third.
constexpr double kRepeats = 0.1;

/// A run that the others contradict.
struct Contradiction {
  int run = -1;
  double chance = 0;        ///< of so much gain by scatter alone, times the number of explanations tried
  std::string slip;         ///< what it looks as if; empty when no usual slip explains it
  std::vector<int> or_run;  ///< other runs that may as well be the wrong one; then none is left out
  bool left_out = false;
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
  /// By row: what the reading of each run (column) adds to (baseline, [drift,] influence).
  std::vector<Eigen::MatrixXcd> gain;
  /// Rows x rows: E(e e^H) of the readings of one run, m^2, from the residuals, or 2 `noise`^2 when that was stated. A
  /// machine that comes back in another state moves all probes together: then they are one witness, not several.
  Eigen::MatrixXcd scatter;
  double spare = 0;                           ///< runs beyond the unknowns; infinity when the noise was stated
  std::vector<int> speed;                     ///< of each row
  std::vector<bool> used;                     ///< by run
  std::vector<Contradiction> contradictions;  ///< runs left out (or only named), most certain first
  bool angles_reversed = false;  ///< every mass angle looks as if counted the other way; nothing was changed
  double repeatability = 0;      ///< sd per component between near-repeats (kNearMass), m; NaN without such runs
  double repeat_share = 0;       ///< rms difference of near-repeats from their mean over the rms reading; NaN
  Summary summary;

  /// (baseline, [drift,] influence) of a row: what a row of the design multiplies.
  Eigen::VectorXcd unknowns(Eigen::Index row) const;
  /// sd per component of influence(row, plane).
  double sd(Eigen::Index row, Eigen::Index plane) const;
};

/// Least squares over all runs, row by row. Throws Error as job.check() and when the runs do not tell every plane's
/// influence, naming the plane and the missing run.
InfluenceFit fit_influence(const BalancingJob& job, const InfluenceOptions& options = {});

/// Covariance (re, im by plane: 2P x 2P) of the unconstrained weighted least-squares correction, first order in the
/// errors of baseline and influence, which scatter from run to run as `fit.scatter`: readings of one run together. NaN
/// when the scatter is not known.
struct CorrectionUncertainty {
  Eigen::MatrixXd covariance;
  double freedom = 0;   ///< degrees of freedom: two a spare run
  double quantile = 0;  ///< of Student's t, 97.5 %: half width of an interval = quantile * sd
  /// Of one plane, were its true mass d off the computed one: E|w|^2 = own + 2 Re(conj(d) mixed) + |d|^2 grown,
  /// E w^2 = improper + d improper_grown. Where the influence is not well known, a larger mass has the larger error:
  /// the intervals hold all masses that lie within `quantile` of their own error from the computed one (Fieller 1954),
  /// up to infinity.
  struct Spread {
    double own = 0, grown = 0;
    std::complex<double> mixed, improper, improper_grown;
  };
  std::vector<Spread> spread;  ///< by plane; empty: the covariance is that of every mass
  Estimate real(Eigen::Index plane, const Eigen::VectorXcd& masses) const;
  Estimate imag(Eigen::Index plane, const Eigen::VectorXcd& masses) const;
  Estimate magnitude(Eigen::Index plane, const Eigen::VectorXcd& masses) const;
  Estimate angle(Eigen::Index plane,
                 const Eigen::VectorXcd& masses) const;  ///< rad; whole turn when 0 is among the masses
};
CorrectionUncertainty correction_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                             const Eigen::VectorXcd& masses);
/// The same for limits and min-max, where no formula holds: `draws` redrawn fits, each solved again.
CorrectionUncertainty redrawn_uncertainty(const InfluenceFit& fit, const CorrectionProblem& problem,
                                          Criterion criterion, int draws = 200, unsigned seed = 1);

/// |baseline + influence masses| of each row with a 95 % interval, the error of both in it.
std::vector<Estimate> predicted_residual(const InfluenceFit& fit, const Eigen::VectorXcd& masses);

}  // namespace whirl::diagnosis
