#pragma once
#include <Eigen/Core>
#include <vector>

#include "whirl/diagnosis/correction.hpp"
#include "whirl/diagnosis/influence.hpp"

namespace whirl::diagnosis {

/// A row of readings without phase, fitted: reading = |baseline + influence masses|.
struct AmplitudeRow {
  double baseline = 0;         ///< m zero-to-peak, >= 0: the phase of the row is counted from it
  Eigen::VectorXcd influence;  ///< by plane, m per unit of mass
  double misfit = 0;           ///< sum of squares of the residuals, m^2
  Eigen::VectorXd residual;    ///< by run; 0 where nothing was read
  Eigen::MatrixXd gain;        ///< what each run (column) adds to (baseline, re, im of the influence by plane)
};

/// Balancing from amplitudes alone: the four-run method (as found and a trial mass at three angles) and its
/// generalisation by least squares to any runs, planes and rows. The phase of a row stays open, and the masses do not
/// need it: they follow from |baseline|, |influence| and the angle between the two.
struct AmplitudeFit {
  InfluenceFit fit;                ///< of the best answer; noise per reading (not per component), cofactor empty
  std::vector<AmplitudeRow> rows;  ///< of the best answer
  std::vector<Eigen::MatrixXcd> or_influence;  ///< other answers that the readings allow, the best first
  std::vector<Eigen::VectorXcd> or_baseline;
};

/// `job.vibration` holds lengths. Runs are least squares of lengths; every minimum that repeatable machines allow
/// (kAmplitudeScatter) is an answer. Throws Error when fewer than 1 + 2 planes runs read a row, or the runs leave a
/// plane unknown.
AmplitudeFit fit_amplitudes(const BalancingJob& job, const InfluenceOptions& options = {});

/// A minimum is an answer when its residual is at most this share of the level: machines that repeat scatter less. Or
/// at most three times the smallest residual, where that is larger.
constexpr double kAmplitudeScatter = 0.05;

/// First order in the scatter of the readings, from the residuals over the spare runs (Student's t), or as stated.
CorrectionUncertainty amplitude_uncertainty(const AmplitudeFit& amplitudes, const CorrectionProblem& problem,
                                            const std::vector<int>& planes, Criterion criterion,
                                            const Eigen::VectorXcd& masses);

}  // namespace whirl::diagnosis
