#pragma once
#include <Eigen/Core>
#include <complex>
#include <vector>

#include "whirl/core/quantity.hpp"

namespace whirl::signal {

/// A signal at equal steps of the rotor angle.
struct AngularSignal {
  Eigen::VectorXd samples;
  Eigen::VectorXd time;    ///< s, of each sample, from the start of the record
  double first_angle = 0;  ///< rad, of sample 0: a multiple of the step
  int per_turn = 0;

  Eigen::Index turns() const { return per_turn > 0 ? samples.size() / per_turn : 0; }
};

/// Band-limited interpolation of x(t) at equal angles, starting at the first whole turn. `angle` (rad, continuous and
/// monotone, one value per sample) is the rotor angle; a falling angle is a machine turning backwards and is an Error.
/// Content above per_turn/2 orders is filtered out first. Throws Error for fewer than one whole turn.
AngularSignal resample_in_angle(const Eigen::Ref<const Eigen::VectorXd>& x,
                                const Eigen::Ref<const Eigen::VectorXd>& angle, double dt, int per_turn = 64);

/// Vector of one order, revolution by revolution: Z = (2/N) sum_n x_n exp(-j order theta_n), so that
/// x = Re(Z exp(j order theta)). Peak amplitude; a positive phase leads the mark.
struct OrderVectors {
  double order = 1;
  AmplitudeKind kind = AmplitudeKind::peak;
  Eigen::VectorXd time;    ///< s, middle of each block
  Eigen::VectorXd speed;   ///< rad/s, mean over the block
  Eigen::VectorXcd value;  ///< unit of the signal
};

/// `turns` whole turns per block; blocks do not overlap. The order must be a multiple of 1/turns.
OrderVectors order_vectors(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& angle,
                           double dt, double order = 1, int turns = 1);

struct VoldKalmanOptions {
  double bandwidth = 2;  ///< Hz between the -3 dB points of each order's filter
  int poles = 2;         ///< 1..3: order of the differences that are kept small; steeper filters with more
};

/// Vold-Kalman filter, second generation: complex envelopes a_k(t), one column per order, of x = Re sum a_k e^{j k
/// theta}, all found together so that crossing orders are separated:
///
///   min sum_k r^2 |nabla^p a_k|^2 + |2 x - sum_k a_k e^{j k theta}|^2,   r from the bandwidth.
///
/// Peak amplitudes at every sample. Throws Error when the bandwidth is too narrow for double precision at this sample
/// rate (decimate first) or too wide.
Eigen::MatrixXcd track_orders(const Eigen::Ref<const Eigen::VectorXd>& x,
                              const Eigen::Ref<const Eigen::VectorXd>& angle, double dt,
                              const std::vector<double>& orders, const VoldKalmanOptions& options = {});

/// The ellipse of two vectors of one order, X of the x probe and Y of the y probe: z = R_f e^{j theta} + R_b e^{-j
/// theta}.
struct OrbitEllipse {
  std::complex<double> forward;   ///< R_f = (X + j Y)/2
  std::complex<double> backward;  ///< R_b = (X* + j Y*)/2
  double semi_major = 0, semi_minor = 0;
  double axis = 0;  ///< direction of the major axis, rad from x towards y
  double area = 0;  ///< pi (|R_f|^2 - |R_b|^2): positive = forward whirl
};
OrbitEllipse orbit_ellipse(std::complex<double> x, std::complex<double> y);

}  // namespace whirl::signal
