#pragma once
#include <set>

#include "whirl/modal/oma.hpp"

namespace whirl::modal {

/// A pole of one model order.
struct SubspacePole {
  int order = 0;
  std::complex<double> pole, discrete;  ///< rad/s; eigenvalue of one step
  Eigen::VectorXcd shape;
  Eigen::VectorXcd right, left;  ///< eigenvectors of the step's matrix, left^T right = 1
  double frequency() const;
  double damping() const;
};

/// Poles that come back over the orders at one place and with one shape.
struct SubspaceCluster {
  std::vector<const SubspacePole*> members;
  std::set<int> orders;
};

struct SubspaceSizes {
  Eigen::Index rows;  ///< block rows of the Hankel matrix
  int max_order;
};

struct SubspaceBand {
  double low, high;  ///< Hz
};

/// Band asked for, or the default one. Throws Error unless ascending and below half the rate.
SubspaceBand subspace_band(const OmaOptions& options, double dt);

/// Block rows beyond which the matrix grows too large.
Eigen::Index most_block_rows(Eigen::Index references);

/// Block rows over two periods of the mean frequency of `y`, where not asked for: correlations of later lags are more
/// chance than structure, and ringing on they make every damping look small. `references`: channels on the right of the
/// correlations.
Eigen::Index block_rows(const OmaOptions& options, Eigen::Index references, const Eigen::MatrixXd& y);

/// Throws Error where `samples` are too few for so many block rows.
SubspaceSizes subspace_sizes(const OmaOptions& options, Eigen::Index references, Eigen::Index rows,
                             Eigen::Index samples);

/// R_i = mean of y_{k+i} r_k^T for i = 0..lags, r the channels `references` of y: channels x references.
std::vector<Eigen::MatrixXd> correlations(const Eigen::MatrixXd& y, const std::vector<Eigen::Index>& references,
                                          Eigen::Index lags);

/// Block rows i < rows, columns j < columns: R_{i + j + 1}, of the channels first..first + count - 1.
Eigen::MatrixXd hankel(const std::vector<Eigen::MatrixXd>& r, Eigen::Index rows, Eigen::Index columns,
                       Eigen::Index first, Eigen::Index count);

/// Weight of SSI-data: the inverse square root of the past's own correlations. `r`: of the references with themselves.
Eigen::MatrixXd past_weight(const std::vector<Eigen::MatrixXd>& r, Eigen::Index rows);

/// Poles of the matrix that takes o1 to o2 (least squares), inside the band. `first`: rows of the channels.
void append_poles(const Eigen::MatrixXd& o1, const Eigen::MatrixXd& o2, const Eigen::MatrixXd& first, double dt,
                  SubspaceBand band, double max_damping, std::vector<SubspacePole>& poles);

std::vector<SubspaceCluster> cluster_poles(const std::vector<SubspacePole>& poles, const std::vector<int>& orders,
                                           const OmaOptions& options);

/// Mean over the orders, with the variance of that mean. `changes`: first-order changes of the pole (rad/s) by the
/// blocks of the record, one each; `extra`: variance of the pole beyond theirs (rad^2/s^2).
OperationalMode mode_of(const SubspaceCluster& cluster, const Eigen::VectorXcd& changes, double extra = 0);

/// Takes tones and, with the rotor's angle, orders off the responses; they are added to `tones`.
void take_off_tones(const Recording& recording, const OmaOptions& options, SubspaceBand band, Eigen::MatrixXd& y,
                    std::vector<Tone>& tones);

/// Takes a mode in, or lists it as a tone, or drops it where it is not known. `kurtosis`: of the response about it;
/// `scale`: of the channels.
void take_mode(OperationalMode mode, double kurtosis, const Eigen::VectorXd& scale, const OmaOptions& options,
               OperationalModes& result);

/// Half width (Hz) of the band about a mode in which a tone would show.
double tone_width(const OperationalMode& mode, double duration);

/// Sorts modes and tones and words the warnings.
void conclude(OperationalModes& result);

}  // namespace whirl::modal
