#pragma once
#include <Eigen/Core>

namespace whirl::modal {

/// Phase of a tone whose frequency wanders, at even instants.
struct PhaseTrack {
  Eigen::VectorXd phase;  ///< rad
  Eigen::VectorXd rate;   ///< rad/s
  double length = 0;      ///< -2 log likelihood of the increments, less is better
};

/// Phase of `z` = exp(j phase) + noise of variance `noise` (of the complex sample), the frequency a random walk: Kalman
/// filter and smoother (Rauch, Tung and Striebel, 1965) about their own last path, iterated. The size of the walk is
/// that of the largest likelihood. `dt`: s; `reach`: frequencies of the tone lie within so many rad/s of 0.
PhaseTrack track_phase(const Eigen::VectorXcd& z, double noise, double dt, double reach);

/// The same from phases measured about `path`: `off` (rad) with the variances `noise`.
PhaseTrack smooth_phase(const PhaseTrack& path, const Eigen::VectorXd& off, const Eigen::VectorXd& noise, double dt,
                        double reach);

/// A track between its instants: cubic through phase and rate. `at`: s after the first instant, held inside the track.
double phase_at(const PhaseTrack& track, double dt, double at);
double rate_at(const PhaseTrack& track, double dt, double at);

}  // namespace whirl::modal
