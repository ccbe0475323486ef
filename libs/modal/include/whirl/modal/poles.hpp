#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/modal_model.hpp"

namespace whirl::modal {

/// Weight of a line in a fit.
enum class LineWeighting {
  automatic,  ///< measured variance when present, else flat or proportional by the scatter between neighbouring lines
  variance,   ///< 1 / standard deviation from the channels' variance
  flat,       ///< equal noise on every line
  proportional,  ///< 1 / max(|H|, 0.02 max|H|)
};

/// How the poles of each order are found.
enum class PoleMethod {
  plscf,  ///< poly-reference least-squares complex frequency: the default, for many modes and noise
  lsce,   ///< (poly-reference) least-squares complex exponential: linear prediction of the impulse responses
  era,    ///< eigensystem realisation algorithm: singular vectors of a Hankel matrix of impulse responses
  rfp,    ///< rational fraction of orthogonal polynomials; one denominator for all FRFs, best for one FRF and few modes
};

/// Numbers of poles per reference and band, low, low + step, ... up to high. 0: high 32, less for short bands; low a
/// third of high; step for about 10 orders in all.
struct Orders {
  int low = 0, high = 0, step = 0;
};

struct PoleOptions {
  PoleMethod method = PoleMethod::plscf;
  double band_low = 0;   ///< Hz; 0 = first line above 0 Hz
  double band_high = 0;  ///< Hz; 0 = last line
  Orders orders;
  int bands = 0;  ///< equal bands solved apart (with overlapping lines); 0 = one per 2000 lines
  LineWeighting weighting = LineWeighting::automatic;
  double max_damping = 0.10;            ///< larger damping is not taken for a pole
  double frequency_tolerance = 0.0025;  ///< relative change between orders of a stable pole; 0.25 % by default
  double damping_tolerance = 0.10;      ///< the same for damping
  double min_mac = 0.95;                ///< of the participation vectors; used with two or more references
  double presence = 0.5;                ///< share of the orders a cluster must appear in
};

/// A pole of one order in the stabilisation diagram.
struct StabilisationPole {
  int order = 0;
  std::complex<double> pole;       ///< rad/s, Im > 0
  Eigen::VectorXcd participation;  ///< one factor per reference, unit norm
  bool stable_frequency = false;   ///< the previous order has a pole this close
  bool stable_damping = false;
  bool stable_vector = false;
  int cluster = -1;  ///< index of the cluster it joined; -1 = none

  double frequency() const { return std::abs(pole) / 6.283185307179586; }
  double damping() const { return -pole.real() / std::abs(pole); }
  bool stable() const { return stable_frequency && stable_damping && stable_vector; }
};

struct StabilisationDiagram {
  std::vector<int> orders;
  std::vector<StabilisationPole> poles;  ///< ascending in order
  std::vector<std::string> references;   ///< of the participation factors
};

/// Poles found over many orders, taken for one physical pole.
struct PoleCluster {
  std::complex<double> pole;       ///< median of Re and of Im, rad/s
  Eigen::VectorXcd participation;  ///< of the member nearest to the median
  int orders = 0;                  ///< number of orders it appears in
  double frequency_spread = 0;     ///< median absolute deviation, Hz
  double damping_spread = 0;       ///< median absolute deviation
};

/// Poles of every order. pLSCF: right matrix fraction, all orders from one factorisation (Peeters et al., 2004). LSCE
/// and ERA (Brown et al., 1979; Juang and Pappa, 1985) work on impulse responses of the band shifted to 0 Hz, RFP
/// (Richardson and Formenti, 1982) on polynomials orthogonal over the lines (Arnoldi), whose roots need no powers of s;
/// these three take the band as one. Poles with Re < 0, inside the band and below `max_damping`. The exponential
/// window's decay is still in them. Throws Error when the band holds too few lines for the order.
StabilisationDiagram stabilisation_diagram(const FrequencyResponse& frf, const PoleOptions& options = {});

/// Groups the stable poles of a diagram (sets `cluster` there) and keeps the clusters present often enough.
/// Ascending in frequency.
std::vector<PoleCluster> select_poles(StabilisationDiagram& diagram, const PoleOptions& options = {});

/// Modal assurance criterion |a^H b|^2 / (a^H a b^H b), in [0, 1].
double mac(const Eigen::Ref<const Eigen::VectorXcd>& a, const Eigen::Ref<const Eigen::VectorXcd>& b);

}  // namespace whirl::modal
